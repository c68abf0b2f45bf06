#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::expressions {

/// Longest text of an expression [bytes], and the most nested brackets and signs.
inline constexpr std::size_t kLongestText = 1000;
inline constexpr std::size_t kDeepestNesting = 32;

/// A function that an expression may call. `compute` reads as many values as `arguments`.
struct Function {
  std::string_view name;
  std::size_t arguments;
  double (*compute)(const double* x);
};
std::span<const Function> functions();
std::vector<std::string_view> function_names();

/// An expression such as `A^2 / (4 * pi)` or `mu > 0.5 and not e == 1`, compiled to steps of a
/// stack machine: numbers, names, `pi`, + - * / ^, comparisons, `and` `or` `not` (&& || !),
/// brackets and functions. Not thread-safe.
class Expression {
 public:
  /// Throws solver::InputError, which says what is wrong and what is allowed but does not repeat
  /// the text.
  explicit Expression(std::string_view text);

  /// The names in the text, each once, in the order of `value_at`'s values.
  const std::vector<std::string>& names() const { return names_; }

  /// The value, which may be NaN or infinite. A comparison is 1 or 0, or NaN if a side is NaN.
  double value_at(std::span<const double> values);

 private:
  class Parser;
  /// Replaces the topmost `arguments` values of the stack by the result of `compute`; without
  /// `compute`, pushes `number`, or the value of name `index`.
  struct Step {
    double (*compute)(const double* x) = nullptr;
    std::size_t arguments = 0;
    double number = 0.0;
    std::size_t index = kNoName;
  };
  static constexpr std::size_t kNoName = ~std::size_t{0};

  std::vector<std::string> names_;
  std::vector<Step> steps_;
  std::vector<double> stack_;  ///< as long as `steps_`
};

}  // namespace oblique::expressions
