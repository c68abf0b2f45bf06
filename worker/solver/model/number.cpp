#include "worker/solver/model/number.h"

#include "worker/solver/model/written_number.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

namespace oblique::solver {
namespace {

constexpr double kSmallestPlain = 1e-4;
constexpr int kPlainDigits = 6;  // before the point

/// Room for the longest fixed form: 309 digits before the point, 17 after it.
using Digits = std::array<char, 352>;

template <typename... Form>
std::string formatted(double value, Form... form) {
  Digits digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, form...).ptr;
  return {digits.data(), end};
}

/// "-0.00" without its sign.
std::string without_minus_zero(std::string text) {
  if (text.starts_with('-') && text.find_first_of("123456789in") == std::string::npos) {
    text.erase(0, 1);
  }
  return text;
}

/// "2.500" as "2.5", "4.000" as "4".
std::string without_end_zeros(std::string text) {
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.ends_with('.')) {
      text.pop_back();
    }
  }
  return text;
}

}  // namespace

char* write_exact_number(double value, char* at) {
  const double size = std::abs(value);
  const bool is_plain = size == 0.0 || (size >= kSmallestPlain && size < 1e6);
  char* const end = at + kLongestExactNumber;
  return is_plain ? std::to_chars(at, end, value, std::chars_format::fixed).ptr
                  : std::to_chars(at, end, value).ptr;
}

std::string exact_number(double value) {
  std::array<char, kLongestExactNumber> text;
  return {text.data(), write_exact_number(value, text.data())};
}

std::string exact_real(double value) {
  auto text = exact_number(value);
  if (text.find_first_of(".e") == std::string::npos) {
    text += ".0";
  }
  return text;
}

std::string readable_number(double value, int significant) {
  if (value == 0.0 || !std::isfinite(value)) {
    return without_minus_zero(formatted(value));
  }
  // The exponent after rounding: 9.99 of two digits is 10.
  auto rounded = formatted(value, std::chars_format::scientific, significant - 1);
  const auto at = rounded.find('e');
  const int exponent = std::stoi(rounded.substr(at + 1));
  if (exponent < -4 || exponent >= std::max(significant, kPlainDigits)) {
    return without_end_zeros(rounded.substr(0, at)) + rounded.substr(at);
  }
  return without_end_zeros(
      formatted(value, std::chars_format::fixed, std::max(0, significant - 1 - exponent)));
}

std::string fixed_number(double value, int decimals) {
  return without_minus_zero(formatted(value, std::chars_format::fixed, decimals));
}

std::string signed_number(double value, int decimals) {
  const auto text = fixed_number(value, decimals);
  const bool is_nothing = text.find_first_of("123456789i") == std::string::npos;
  return is_nothing || text.starts_with('-') ? text : '+' + text;
}

std::optional<double> number_of(std::string_view text) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && rest == end ? std::optional(value) : std::nullopt;
}

}  // namespace oblique::solver
