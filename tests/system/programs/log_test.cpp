// Log lines of server and worker.
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <regex>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::test {
namespace {

/// A time zone that differs from UTC all year.
const Environment kInTokyo{{"TZ", "Asia/Tokyo"}};

/// Expects that every line has the log format and contains the present time in UTC.
void expect_log(const std::string& log, const std::string& program) {
  const std::regex form(R"((\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d)\.\d{3}Z )" + program +
                        " (info|warning|error): .*");
  std::istringstream lines(log);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    std::smatch found;
    ASSERT_TRUE(std::regex_match(line, found, form)) << line;
    std::tm utc{};
    ASSERT_NE(strptime(found[1].str().c_str(), "%Y-%m-%dT%H:%M:%S", &utc), nullptr) << line;
    constexpr double kHour_s = 3600.0;
    EXPECT_LT(std::abs(std::difftime(timegm(&utc), std::time(nullptr))), kHour_s) << line;
  }
  EXPECT_GE(count, 2);
}

TEST(LogTest, HasTimesInUtc) {
  const TemporaryFolder folder;
  Server server(folder, folder.file("a.db"), kInTokyo);
  Worker worker(folder, server.worker_url(), {}, kInTokyo);
  wait_until("the worker has joined",
             [&] { return server.process().err().find(" joins") != std::string::npos; });
  for (Process* process : {static_cast<Process*>(&worker), &server.process()}) {
    process->send(SIGTERM);
    EXPECT_EQ(process->wait(), 0) << process->err();
  }
  expect_log(server.process().err(), "oblique-server");
  expect_log(worker.err(), "oblique-worker");
}

TEST(LogTest, EscapesControlCharactersOfTextFromOutside) {
  const TemporaryFolder folder;
  Server server(folder, folder.file("a\x1b[2J\u202e\nforged.db"));
  server.process().send(SIGTERM);
  EXPECT_EQ(server.process().wait(), 0);
  const std::string log = server.process().err();
  expect_log(log, "oblique-server");
  EXPECT_NE(log.find("a\\x1b[2J\\u202e\\nforged.db"), std::string::npos) << log;
}

}  // namespace
}  // namespace oblique::test
