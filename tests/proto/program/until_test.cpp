#include "proto/program/usage.h"

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

using std::chrono::seconds;

/// 2026-11-22T05:00:00Z
const std::chrono::system_clock::time_point kNow{seconds(1'795'323'600)};

TEST(TimeUntil, ReadsTimesInUtcAndDurations) {
  for (const auto& [text, expected_s] :
       std::vector<std::pair<std::string, std::int64_t>>{{"0s", 0},
                                                         {"5400s", 5400},
                                                         {"90m", 5400},
                                                         {"1.5h", 5400},
                                                         {"2026-11-22T05:01:00Z", 60},
                                                         {"2026-11-22T04:59:00Z", -60}}) {
    EXPECT_EQ(time_until(text, kNow), seconds(expected_s)) << text;
  }
}

TEST(TimeUntil, RefusesEverythingElse) {
  for (const char* text : {"", "soon", "s", "5400", "-5s", "5x", "1h30m", "nans", "infs", "1e300h",
                           "2026-11-22", "2026-11-22T05:00:00", "2026-13-01T00:00:00Z",
                           "2026-02-30T00:00:00Z", "2026-11-22T05:00:00Z "}) {
    EXPECT_EQ(time_until(text, kNow), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace oblique::protocol
