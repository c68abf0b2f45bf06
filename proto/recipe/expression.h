#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

namespace oblique::expressions {

/// Maximum length of an expression [bytes].
inline constexpr std::size_t kLongestText = 1000;

/// A function of the language. NaN as an argument or value means undefined.
struct Function {
  std::string_view name;
  std::size_t arguments;
  double (*compute)(const double* x);
};

/// Returns the functions that an expression may call.
std::span<const Function> functions();

/// An expression such as `A^2 / (4 * pi)` or `mu > 0.5 and not e == 1`, compiled to steps of a
/// stack machine. It may contain numbers, names, `pi`, + - * / ^, comparisons, `and` `or` `not`
/// (in any case; also && || !), brackets and functions.
class Expression {
 public:
  /// `meaning_of` is called for each name, in the order of the text. It returns the index of the
  /// name's value in the argument of `value_at`, or a constant, or throws. Throws
  /// solver::InputError, which states the fault and what is allowed, but not the text.
  using MeaningOf = std::function<std::variant<std::size_t, double>(std::string_view name)>;
  Expression(std::string_view text, const MeaningOf& meaning_of);

  /// Returns the value, which may be NaN or infinite. A comparison is 1 or 0, or NaN if a side is
  /// NaN.
  double value_at(std::span<const double> values) const;

 private:
  class Parser;
  /// Replaces the top `arguments` values of the stack by the result of `compute`. Without
  /// `compute`, pushes a constant, or the value of the name with the index `pushed`.
  struct Step {
    double (*compute)(const double* x) = nullptr;
    std::size_t arguments = 0;
    std::variant<std::size_t, double> pushed = 0.0;
  };

  std::vector<Step> steps_;  ///< at most one step per byte of the text
};

}  // namespace oblique::expressions
