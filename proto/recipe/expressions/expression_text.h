#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::expressions {

/// Longest text of an expression, in bytes, and how deep brackets may stand in each other.
inline constexpr std::size_t kLongestText = 1000;
inline constexpr std::size_t kDeepestBrackets = 32;

/// An expression in its tokens, as `A^2 / (4 * pi)`.
struct ExpressionText {
  /// The same for all ways of spacing it and of writing its numbers: "A^2/(4*pi)".
  std::string canonical;
  /// The names that values are wanted for, each once, in the order in which they come.
  std::vector<std::string> names;
};

/// Reads a text from outside: numbers, names, `pi`, + - * / ^, comparisons (< <= > >= == !=), && ||
/// ! or `and` `or` `not`, brackets, and functions. There is nothing else: no strings, nothing that
/// assigns. Throws solver::InputError with a sentence about the text, which does not hold the text.
/// Whether the tokens make an expression is not judged here.
ExpressionText read_expression(std::string_view text);

/// The names of the functions that an expression may use.
std::vector<std::string_view> function_names();

}  // namespace oblique::expressions
