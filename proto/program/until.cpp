#include "proto/program/until.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <ctime>
#include <iterator>
#include <system_error>

namespace oblique::protocol {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::int64_t kMinute_s = 60;
constexpr std::int64_t kHour_s = 60 * kMinute_s;
constexpr std::int64_t kDay_s = 24 * kHour_s;
constexpr std::int64_t kLongest_s = 36'525 * kDay_s;

/// Takes text from its front.
class Taker {
 public:
  explicit Taker(std::string_view text) : left_(text) {}

  bool is_at_end() const { return left_.empty(); }
  bool take(char c) {
    const bool is_there = left_.starts_with(c);
    left_.remove_prefix(is_there ? 1 : 0);
    return is_there;
  }
  /// A whole number of so many digits at least and at most.
  std::optional<std::int64_t> number(std::size_t least, std::size_t most) {
    const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
    const auto end = std::find_if_not(left_.begin(), left_.end(), is_digit);
    const std::size_t digits =
        std::min(static_cast<std::size_t>(std::distance(left_.begin(), end)), most);
    std::int64_t value = 0;
    if (digits < least ||
        std::from_chars(left_.data(), left_.data() + digits, value).ec != std::errc()) {
      return std::nullopt;
    }
    left_.remove_prefix(digits);
    return value;
  }
  /// The same with bounds on its value; two digits.
  std::optional<int> pair(int least, int most) {
    const auto value = number(2, 2);
    return value && *value >= least && *value <= most ? std::optional(static_cast<int>(*value))
                                                      : std::nullopt;
  }
  char front() const { return left_.empty() ? '\0' : left_.front(); }

 private:
  std::string_view left_;
};

std::optional<std::int64_t> duration_s(std::string_view text) {
  Taker in(text);
  std::int64_t sum = 0;
  std::int64_t smaller_than = kLongest_s;  // units come once each, the largest first
  do {
    constexpr std::size_t kMostDigits = 10;
    const auto value = in.number(1, kMostDigits);
    const std::int64_t unit = in.take('d')                     ? kDay_s
                              : in.take('h')                   ? kHour_s
                              : in.take('m')                   ? kMinute_s
                              : in.take('s') || in.is_at_end() ? 1
                                                               : kLongest_s;
    if (!value || unit >= smaller_than || *value > kLongest_s / unit) {
      return std::nullopt;
    }
    smaller_than = unit;
    sum += *value * unit;
  } while (!in.is_at_end());
  return sum <= kLongest_s ? std::optional(sum) : std::nullopt;
}

/// Seconds east of UTC; nothing when what follows is no zone.
std::optional<std::int64_t> zone_s(Taker& in) {
  if (in.take('Z')) {
    return 0;
  }
  const std::int64_t sign = in.front() == '-' ? -1 : 1;
  if (!in.take('+') && !in.take('-')) {
    return std::nullopt;
  }
  const auto hours = in.pair(0, 23);
  (void)in.take(':');
  const auto minutes = in.is_at_end() ? std::optional(0) : in.pair(0, 59);
  return hours && minutes ? std::optional(sign * (*hours * kHour_s + *minutes * kMinute_s))
                          : std::nullopt;
}

/// Seconds since 1970.
std::optional<std::int64_t> moment_s(std::string_view text) {
  Taker in(text);
  const auto year = in.number(4, 4);
  const bool has_month = in.take('-');
  const auto month = in.pair(1, 12);
  const bool has_day = in.take('-');
  const auto day = in.pair(1, 31);
  const bool has_time = in.take('T') || in.take(' ');
  const auto hour = in.pair(0, 23);
  const bool has_minute = in.take(':');
  const auto minute = in.pair(0, 59);
  const auto second = in.take(':') ? in.pair(0, 60) : std::optional(0);
  if (!year || !has_month || !month || !has_day || !day || !has_time || !hour || !has_minute ||
      !minute || !second) {
    return std::nullopt;
  }
  std::tm parts{};
  parts.tm_year = static_cast<int>(*year) - 1900;
  parts.tm_mon = *month - 1;
  parts.tm_mday = *day;
  parts.tm_hour = *hour;
  parts.tm_min = *minute;
  parts.tm_sec = *second;
  parts.tm_isdst = -1;
  if (in.is_at_end()) {
    const std::tm written = parts;
    const std::time_t local = std::mktime(&parts);
    return parts.tm_mday == written.tm_mday ? std::optional<std::int64_t>(local) : std::nullopt;
  }
  const auto zone = zone_s(in);
  const std::int64_t utc = timegm(&parts);
  return zone && in.is_at_end() && parts.tm_mday == *day ? std::optional(utc - *zone)
                                                         : std::nullopt;
}

}  // namespace

std::optional<milliseconds> time_until(std::string_view text,
                                       std::chrono::system_clock::time_point now) {
  if (const auto duration = duration_s(text)) {
    return seconds(*duration);
  }
  const auto moment = moment_s(text);
  if (!moment) {
    return std::nullopt;
  }
  const auto now_ms = std::chrono::duration_cast<milliseconds>(now.time_since_epoch());
  const milliseconds left = seconds(*moment) - now_ms;
  return std::chrono::abs(left) <= seconds(kLongest_s) ? std::optional(left) : std::nullopt;
}

}  // namespace oblique::protocol
