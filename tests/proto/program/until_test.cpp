#include "proto/program/usage.h"

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

using std::chrono::seconds;
using std::chrono::system_clock;

/// 2026-11-22T05:00:00Z
const system_clock::time_point kNow{seconds(1'795'323'600)};

std::optional<std::int64_t> left_s(const std::string& text) {
  const auto left = time_until(text, kNow);
  return left ? std::optional(std::chrono::duration_cast<seconds>(*left).count()) : std::nullopt;
}

TEST(TimeUntil, ReadsDurationsAndTimesWithAZone) {
  for (const auto& [text, expected_s] :
       std::vector<std::pair<std::string, std::int64_t>>{{"0", 0},
                                                         {"5400", 5400},
                                                         {"5400s", 5400},
                                                         {"90m", 5400},
                                                         {"2h", 7200},
                                                         {"2d", 172'800},
                                                         {"2026-11-22T05:01:00Z", 60},
                                                         {"2026-11-22T06:01:00+01:00", 60},
                                                         {"2026-11-22T00:31:00-0430", 60},
                                                         {"2026-11-22T04:59:00Z", -60}}) {
    EXPECT_EQ(left_s(text), expected_s) << text;
  }
}

TEST(TimeUntil, ATimeWithoutAZoneIsLocal) {
  const char* const before = std::getenv("TZ");
  const std::string zone = before == nullptr ? "" : before;
  setenv("TZ", "Asia/Tokyo", 1);
  tzset();
  EXPECT_EQ(left_s("2026-11-22T14:01:00"), 60);
  before == nullptr ? unsetenv("TZ") : setenv("TZ", zone.c_str(), 1);
  tzset();
}

TEST(TimeUntil, RefusesEverythingElse) {
  for (const char* text : {"",
                           "soon",
                           "-5",
                           "5.5",
                           "5x",
                           "1h30m",
                           "m",
                           "99999999999",
                           "1e3",
                           "40000d",
                           "2026-11-22",
                           "2026-13-01T00:00:00Z",
                           "2026-02-30T00:00:00Z",
                           "2026-02-30T00:00:00",
                           "2026-11-22T25:00:00Z",
                           "2026-11-22T05:00:00X",
                           "2026-11-22T05:00:00Z ",
                           "2026-11-22T05:00:00+25:00",
                           "0001-01-01T00:00:00Z",
                           "9999-01-01T00:00:00Z"}) {
    EXPECT_EQ(left_s(text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace oblique::protocol
