#include "worker/solver/model/number.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace oblique::solver {
namespace {

/// Large enough for 309 digits before the point and 17 after it.
using Digits = std::array<char, 352>;

std::string formatted(double value, std::chars_format form, int precision) {
  Digits digits;
  return {digits.data(),
          std::to_chars(digits.data(), digits.data() + digits.size(), value, form, precision).ptr};
}

}  // namespace

char* write_exact_number(double value, char* at) {
  const double size = std::abs(value);
  const bool is_plain = size == 0.0 || (size >= 1e-4 && size < 1e6);
  char* const end = at + kLongestExactNumber;
  return is_plain ? std::to_chars(at, end, value, std::chars_format::fixed).ptr
                  : std::to_chars(at, end, value).ptr;
}

std::string exact_number(double value) {
  std::array<char, kLongestExactNumber> text;
  return {text.data(), write_exact_number(value, text.data())};
}

std::string readable_number(double value, int significant) {
  std::string text = formatted(value == 0.0 ? 0.0 : value, std::chars_format::general, significant);
  if (const auto at = text.find('e'); at != std::string::npos) {
    const int exponent = std::stoi(text.substr(at + 1));
    if (exponent >= 0 && exponent < 6) {
      return fixed_number(value, 0);
    }
  }
  return text;
}

std::string fixed_number(double value, int decimals) {
  std::string text = formatted(value, std::chars_format::fixed, decimals);
  if (text.starts_with('-') && text.find_first_of("123456789in") == std::string::npos) {
    text.erase(0, 1);  // -0.00
  }
  return text;
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

std::string_view why_no_number(std::string_view text) {
  double value = 0.0;
  text.remove_prefix(text.starts_with('+') ? 1 : 0);
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  const bool is_number = error == std::errc::result_out_of_range && rest == end;
  return is_number ? ": it is too small or too large" : "";
}

}  // namespace oblique::solver
