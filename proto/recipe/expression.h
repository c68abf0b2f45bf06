#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::expressions {

/// Longest text of an expression [bytes].
inline constexpr std::size_t kLongestText = 1000;

/// The functions that an expression may call.
std::vector<std::string_view> function_names();

/// An expression such as `A^2 / (4 * pi)` or `mu > 0.5 and not e == 1`, compiled to steps of a
/// stack machine: numbers, names, `pi`, + - * / ^, comparisons, `and` `or` `not` (&& || !),
/// brackets and functions.
class Expression {
 public:
  /// Throws solver::InputError, which says what is wrong and what is allowed but does not repeat
  /// the text.
  explicit Expression(std::string_view text);

  /// The names in the text, each once, in the order of `value_at`'s values.
  const std::vector<std::string>& names() const { return names_; }

  /// Makes name i the value number `places[i]` of `value_at`.
  void place_names(std::span<const std::size_t> places);

  /// The value, which may be NaN or infinite. A comparison is 1 or 0, or NaN if a side is NaN.
  double value_at(std::span<const double> values) const;

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
  std::vector<Step> steps_;  ///< at most one for each byte of the text
};

}  // namespace oblique::expressions
