#include "tests/system/networks/small_study.h"

#include <chrono>
#include <cstdio>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace oblique::test {

std::vector<std::string> submit_and_watch() {
  std::vector<std::string> words{"submit", "--watch"};
  const auto points = many_points("many");
  words.insert(words.end(), points.begin(), points.end());
  return words;
}

void wait_for_rows(const Database& database, double at_least) {
  wait_until("rows", [&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return database.rows() >= at_least;
  });
}

void expect_completed(Process& client, const Database& database,
                      const std::function<std::string()>& workers) {
  wait_for_rows(database, kManyPoints);
  const auto completed = std::chrono::steady_clock::now();
  EXPECT_EQ(client.wait(), 0) << client.err();
  print_measured("the client knows of the end after", seconds_since(completed));
  EXPECT_EQ(database.number("SELECT count(DISTINCT point) FROM results WHERE status = 'solved'"),
            kManyPoints);
  EXPECT_EQ(database.rows(), kManyPoints);
  for (const auto& worker : nlohmann::json::parse(workers())) {
    EXPECT_NE(worker.at("standing"), "set aside") << worker;
  }
}

double seconds_since(std::chrono::steady_clock::time_point then) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - then).count();
}

void print_measured(const std::string& what, double time_s) {
  const auto* const test = testing::UnitTest::GetInstance()->current_test_info();
  std::printf("[ MEASURED ] %s: %s: %.1f s\n", test->name(), what.c_str(), time_s);
}

}  // namespace oblique::test
