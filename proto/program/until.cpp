#include "proto/program/usage.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <string>
#include <system_error>

namespace oblique::protocol {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

struct Unit {
  char letter;
  std::int64_t length_s;
};
constexpr std::array<Unit, 4> kUnits{{{'d', 86'400}, {'h', 3600}, {'m', 60}, {'s', 1}}};
constexpr std::int64_t kLongest_s = 36'525 * kUnits.front().length_s;

std::optional<std::int64_t> duration_s(std::string_view text) {
  const char* at = text.data();
  const char* const last = at + text.size();
  const Unit* unit = kUnits.begin();  // each at most once, the largest first
  std::int64_t sum_s = 0;
  do {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(at, last, value);
    if (error != std::errc() || value < 0 || *at == '-') {
      return std::nullopt;
    }
    const char letter = end == last ? 's' : *end;
    unit = std::find_if(unit, kUnits.end(), [&](const Unit& u) { return u.letter == letter; });
    if (unit == kUnits.end() || value > kLongest_s / unit->length_s) {
      return std::nullopt;
    }
    sum_s += value * unit->length_s;
    ++unit;
    at = end == last ? last : end + 1;
  } while (at != last);
  return sum_s <= kLongest_s ? std::optional(sum_s) : std::nullopt;
}

/// Seconds since 1970 of a time in ISO 8601.
std::optional<std::int64_t> moment_s(std::string text) {
  constexpr std::size_t kDateLength = 10;
  if (text.size() > kDateLength && text[kDateLength] == ' ') {
    text[kDateLength] = 'T';
  }
  for (const char* const form : {"%Y-%m-%dT%H:%M:%S", "%Y-%m-%dT%H:%M"}) {
    std::tm parts{};
    const char* rest = strptime(text.c_str(), form, &parts);
    const bool is_local = rest != nullptr && *rest == '\0';
    if (rest != nullptr && !is_local) {
      rest = strptime(rest, "%z", &parts);
    }
    if (rest == nullptr || *rest != '\0') {
      continue;
    }
    const std::tm written = parts;
    parts.tm_isdst = -1;
    const std::int64_t moment = is_local ? std::mktime(&parts) : timegm(&parts) - written.tm_gmtoff;
    // A day that the month does not have has become one of the next month.
    const bool is_sound =
        parts.tm_mday == written.tm_mday && std::abs(written.tm_gmtoff) < kUnits.front().length_s;
    return is_sound ? std::optional(moment) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

std::optional<milliseconds> time_until(std::string_view text,
                                       std::chrono::system_clock::time_point now) {
  if (const auto duration = duration_s(text)) {
    return seconds(*duration);
  }
  const auto moment = moment_s(std::string(text));
  if (!moment) {
    return std::nullopt;
  }
  const auto now_ms = std::chrono::duration_cast<milliseconds>(now.time_since_epoch());
  const milliseconds left = seconds(*moment) - now_ms;
  return std::chrono::abs(left) <= seconds(kLongest_s) ? std::optional(left) : std::nullopt;
}

}  // namespace oblique::protocol
