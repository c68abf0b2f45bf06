#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/database.h"
#include "tests/support/process.h"
#include "tests/system/many_points.h"

namespace oblique::test {

/// Returns arguments of `oblique` to submit and watch the study, without the server's address.
inline std::vector<std::string> submit_and_watch() {
  return many_points("many", {"submit", "--watch"});
}

/// Waits until at least `at_least` results are stored.
inline void wait_for_rows(const Database& database, double at_least) {
  wait_until("rows", [&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return database.rows() >= at_least;
  });
}

/// Prints the time since `since`.
inline void print_measured(const std::string& what, std::chrono::steady_clock::time_point since) {
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - since;
  const auto* const test = testing::UnitTest::GetInstance()->current_test_info();
  std::printf("[ MEASURED ] %s: %s: %.1f s\n", test->name(), what.c_str(), time.count());
}

/// Expects that `client` reports the end of the study, that each point has one row and none failed,
/// and that no worker has stalled. `workers` returns the output of `oblique workers --format
/// json`.
inline void expect_completed(Process& client, const Database& database,
                             const std::function<std::string()>& workers) {
  wait_for_rows(database, kManyPoints);
  const auto completed = std::chrono::steady_clock::now();
  EXPECT_EQ(client.wait(), 0) << client.err();
  print_measured("the client reports the end after", completed);
  EXPECT_EQ(database.number("SELECT count(DISTINCT point) FROM results WHERE status = 'solved'"),
            kManyPoints);
  EXPECT_EQ(database.rows(), kManyPoints);
  for (const auto& worker : nlohmann::json::parse(workers())) {
    EXPECT_NE(worker.at("state"), "stalled") << worker;
  }
}

}  // namespace oblique::test
