#pragma once

#include <span>
#include <string_view>

namespace oblique::expressions {

/// A function of an expression; all but the one for its number of arguments are null.
struct Function {
  std::string_view name;
  double (*of_one)(double) = nullptr;
  double (*of_two)(double, double) = nullptr;
  double (*of_three)(double, double, double) = nullptr;
};

/// All of them. Each is the same bits on every machine.
std::span<const Function> functions();

/// The circle's constant, the one name that is no key.
inline constexpr std::string_view kPiName = "pi";

}  // namespace oblique::expressions
