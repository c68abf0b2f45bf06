#include "server/asking/lists/unpacking.h"

#include <array>
#include <charconv>

namespace oblique::server {
namespace {

/// So many decimal digits a double has: what is written with them is what was read.
constexpr std::size_t kMostDigits = 15;

void separate(std::string& to) {
  if (to.size() > 1) {
    to += ',';
  }
}

/// The value that begins `rest`, without what follows: a number, a word or a text without escapes.
std::string_view value_before_end(std::string_view rest) {
  if (!rest.empty() && rest.front() == '"') {
    const std::size_t end = rest.find_first_of("\"\\", 1);
    return end == std::string_view::npos || rest[end] == '\\' ? std::string_view()
                                                              : rest.substr(0, end + 1);
  }
  const std::size_t end = rest.find_first_not_of("-+.0123456789eE");
  return rest.substr(0, end);
}

}  // namespace

bool read_packed(std::string_view packed, std::vector<std::int64_t>& numbers) {
  numbers.clear();
  if (packed == "[]") {
    return true;
  }
  const char* at = packed.data();
  const char* const end = at + packed.size();
  if (packed.size() < 3 || *at++ != '[') {
    return false;
  }
  while (true) {
    std::int64_t number = 0;
    const bool is_negative = at < end && *at == '-';
    const char* const digits = at + (is_negative ? 1 : 0);
    const auto [behind, error] = std::from_chars(at, end, number);
    const auto length = static_cast<std::size_t>(behind - digits);
    const bool has_odd_zero = behind > digits && *digits == '0' && (length > 1 || is_negative);
    if (error != std::errc() || behind == end || length > kMostDigits || has_odd_zero) {
      return false;
    }
    numbers.push_back(number);
    at = behind;
    if (*at == ']') {
      return at + 1 == end;
    }
    if (*at++ != ',') {
      return false;
    }
  }
}

void append_decimal(std::int64_t number, int decimals, std::string& to) {
  if (number == 0) {
    to += "0.0";
    return;
  }
  std::array<char, kMostDigits + 1> text;
  const std::int64_t magnitude = number < 0 ? -number : number;
  const char* const end = std::to_chars(text.data(), text.data() + text.size(), magnitude).ptr;
  std::string_view digits(text.data(), static_cast<std::size_t>(end - text.data()));
  const int exponent = static_cast<int>(digits.size()) - 1 - decimals;
  digits.remove_suffix(digits.size() - 1 - digits.find_last_not_of('0'));
  to += number < 0 ? "-" : "";
  constexpr int kLeastPlain = -4;
  constexpr int kTen = 10;
  if (exponent < kLeastPlain) {
    to += digits.front();
    to += '.';
    to += digits.size() > 1 ? digits.substr(1) : "0";
    to += "e-";
    to += static_cast<char>('0' + -exponent / kTen);
    to += static_cast<char>('0' + -exponent % kTen);
  } else if (exponent < 0) {
    to += "0.";
    to.append(static_cast<std::size_t>(-exponent - 1), '0');
    to += digits;
  } else {
    const auto whole = static_cast<std::size_t>(exponent) + 1;
    to += digits.substr(0, whole);
    to.append(whole > digits.size() ? whole - digits.size() : 0, '0');
    to += '.';
    to += whole < digits.size() ? digits.substr(whole) : "0";
  }
}

bool unpack_peaks(const std::vector<std::int64_t>& numbers, std::string& to) {
  constexpr std::size_t kOfAPeak = 3;
  to = '[';
  for (std::size_t i = 0; i + 2 < numbers.size(); i += kOfAPeak) {
    const std::int64_t force = numbers[i + 1];
    separate(to);
    to += '[';
    append_decimal(numbers[i], kTimeDecimals, to);
    to += ',';
    append_decimal(force < 0 ? -force : force, kForceDecimals, to);
    to += ',';
    append_decimal(numbers[i + 2], kForceDecimals, to);
    to += force < 0 ? ",0]" : ",1]";
  }
  to += ']';
  return numbers.size() % kOfAPeak == 0;
}

bool unpack_pairs(const std::vector<std::int64_t>& numbers, const Pairs& pairs, std::string& to) {
  if (pairs.second >= pairs.stride || numbers.size() % pairs.stride != 0) {
    return false;
  }
  to = '[';
  for (std::size_t i = 0; i < numbers.size(); i += pairs.stride) {
    separate(to);
    to += '[';
    append_decimal(numbers[i], pairs.first_decimals, to);
    to += ',';
    append_decimal(numbers[i + pairs.second], pairs.second_decimals, to);
    to += ']';
  }
  to += ']';
  return true;
}

bool unpack_phases(const std::vector<std::int64_t>& ends, std::string& to) {
  to = '[';
  for (std::size_t i = 0; i < ends.size(); ++i) {
    separate(to);
    to += i % 2 == 0 ? "[\"compression\"," : "[\"restitution\",";
    append_decimal(i == 0 ? 0 : ends[i - 1], kTimeDecimals, to);
    to += ',';
    append_decimal(ends[i], kTimeDecimals, to);
    to += ']';
  }
  to += ']';
  return true;
}

bool member_of_elements(std::string_view list, int member, int where, std::string& to) {
  to = '[';
  if (list == "[]") {
    to += ']';
    return true;
  }
  if (list.size() < 4 || list.substr(0, 2) != "[[") {
    return false;
  }
  std::size_t at = 2;
  while (true) {
    std::string_view wanted;
    std::string_view condition = where < 0 ? "1" : "";
    for (int i = 0;; ++i) {
      const std::string_view value = value_before_end(list.substr(at));
      at += value.size();
      if (value.empty() || at >= list.size() || (list[at] != ',' && list[at] != ']')) {
        return false;
      }
      wanted = i == member ? value : wanted;
      condition = i == where ? value : condition;
      if (list[at++] == ']') {
        break;
      }
    }
    if (wanted.empty() || (condition != "1" && condition != "0")) {
      return false;
    }
    if (condition == "1") {
      separate(to);
      to += wanted;
    }
    if (list.substr(at) == "]") {
      to += ']';
      return true;
    }
    if (list.substr(at, 2) != ",[") {
      return false;
    }
    at += 2;
  }
}

}  // namespace oblique::server
