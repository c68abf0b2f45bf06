#include "server/program/limits.h"

#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

namespace oblique::server {
namespace {

class LimitsTest : public testing::Test {
 protected:
  LimitsTest() { add_limits(app_, network_, service_, queries_); }

  NetworkLimits network_;
  ServiceSettings service_;
  QueueSettings queries_;
  CLI::App app_;
};

TEST_F(LimitsTest, ReachTheStructuresThatTheyAreNamedAfter) {
  app_.parse(std::vector<std::string>{"--limits-connections=77", "--limits-unstored-bytes=5",
                                      "--limits-running-queries=3"});
  EXPECT_EQ(network_.connections, 77U);
  EXPECT_EQ(service_.ledger.bytes, 5U);
  EXPECT_EQ(queries_.readers, 3U);
}

TEST_F(LimitsTest, StayAsTheyAreWhereNothingIsSaid) {
  app_.parse(std::vector<std::string>{});
  EXPECT_EQ(network_.connections, NetworkLimits().connections);
  EXPECT_EQ(service_.ledger.bytes, LedgerLimits().bytes);
}

TEST_F(LimitsTest, DefaultsAreAllowedAndNegativeNumbersAreNot) {
  for (const CLI::Option* option : app_.get_options()) {
    if (!option->get_name().starts_with("--limits-")) {
      continue;
    }
    const auto set_to = [&](const std::string& value) {
      app_.parse(std::vector<std::string>{option->get_name() + "=" + value});
    };
    EXPECT_NO_THROW(set_to(option->get_default_str())) << option->get_name();
    for (const char* value : {"-1", "nan", "1.5", "99999999999999999999", "all"}) {
      EXPECT_THROW(set_to(value), CLI::ParseError) << option->get_name() << "=" << value;
    }
  }
}

TEST_F(LimitsTest, EachOptionSetsABoundOfItsOwn) {
  const auto all = [this] {
    const auto& ledger = service_.ledger;
    return std::vector<std::int64_t>{static_cast<std::int64_t>(network_.connections),
                                     network_.handshake_ms,
                                     network_.active_ms,
                                     static_cast<std::int64_t>(network_.handshakes),
                                     static_cast<std::int64_t>(network_.held_in_bytes),
                                     static_cast<std::int64_t>(network_.busy_bytes),
                                     static_cast<std::int64_t>(network_.waiting_out_bytes),
                                     static_cast<std::int64_t>(network_.all_waiting_out_bytes),
                                     static_cast<std::int64_t>(ledger.bytes),
                                     static_cast<std::int64_t>(queries_.readers),
                                     static_cast<std::int64_t>(queries_.most_running_each),
                                     static_cast<std::int64_t>(queries_.most_waiting),
                                     static_cast<std::int64_t>(queries_.most_waiting_each),
                                     static_cast<std::int64_t>(queries_.most_waiting_bytes),
                                     service_.scheduler.max_credit};
  };
  std::set<std::size_t> changed;
  for (const CLI::Option* option : app_.get_options()) {
    if (!option->get_name().starts_with("--limits-")) {
      continue;
    }
    const auto before = all();
    // One more is allowed of every default.
    app_.parse(std::vector<std::string>{option->get_name() + "=" +
                                        std::to_string(std::stoll(option->get_default_str()) + 1)});
    const auto after = all();
    for (std::size_t i = 0; i < after.size(); ++i) {
      if (after[i] != before[i]) {
        EXPECT_EQ(after[i], before[i] + 1) << option->get_name();
        changed.insert(i);
      }
    }
  }
  EXPECT_EQ(changed.size(), all().size());
}

}  // namespace
}  // namespace oblique::server
