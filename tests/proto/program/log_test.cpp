#include "proto/program/log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include "proto/text.h"
#include "tests/support/temporary_folder.h"

namespace oblique::protocol {
namespace {

/// Captures standard error.
class ProgramLogTest : public testing::Test {
 protected:
  ProgramLogTest() : before_(dup(STDERR_FILENO)) {
    const int file = open(file_.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    dup2(file, STDERR_FILENO);
    close(file);
  }
  ~ProgramLogTest() override {
    dup2(before_, STDERR_FILENO);
    close(before_);
    unsetenv("JOURNAL_STREAM");
    set_up_log("tests");
  }

  std::vector<std::string> lines() const {
    std::ifstream file(file_);
    std::vector<std::string> all;
    for (std::string line; std::getline(file, line);) {
      all.push_back(line);
    }
    return all;
  }

  test::TemporaryFolder folder_;
  std::string file_ = folder_.file("err");
  int before_;
};

TEST_F(ProgramLogTest, EachJsonLineIsOneValidObjectWhateverTextPeersSend) {
  set_up_log("oblique-server", {"debug", "json"});
  const std::vector<std::string> messages{
      "plain",
      "worker \"x\\\" joins\n{\"forged\": true}",
      std::string("zero \0 inside", 13),
      "\xff\xfe no UTF-8 \xc3",
      "\x1b[2J \xe2\x80\xae turned \xe2\x80\xa8 line",
      "",
  };
  for (const std::string& message : messages) {
    spdlog::warn("{}", message);
  }
  const auto written = lines();
  ASSERT_EQ(written.size(), messages.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    ASSERT_TRUE(is_visible(written[i])) << visible(written[i]);
    const auto object = nlohmann::json::parse(written[i], nullptr, false);
    ASSERT_TRUE(object.is_object()) << written[i];
    EXPECT_EQ(object.size(), 4U);
    EXPECT_EQ(object.at("level"), "warning");
    EXPECT_EQ(object.at("program"), "oblique-server");
    EXPECT_TRUE(std::regex_match(object.at("time").get<std::string>(),
                                 std::regex(R"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z)")));
    if (is_utf8(messages[i])) {
      EXPECT_EQ(object.at("message"), messages[i]);
    }
  }
}

TEST_F(ProgramLogTest, TheJournalGetsLevelsAndNoTimes) {
  struct stat file {};
  ASSERT_EQ(fstat(STDERR_FILENO, &file), 0);
  const std::string stream = std::to_string(file.st_dev) + ":" + std::to_string(file.st_ino);
  setenv("JOURNAL_STREAM", stream.c_str(), 1);
  set_up_log("oblique-worker");
  spdlog::info("one\ntwo");
  spdlog::warn("low");
  spdlog::error("broken");
  EXPECT_EQ(lines(), (std::vector<std::string>{"<6>one\\ntwo", "<4>low", "<3>broken"}));
}

TEST_F(ProgramLogTest, LinesHaveTimesWithoutAJournal) {
  setenv("JOURNAL_STREAM", "1:1", 1);
  set_up_log("oblique-worker");
  spdlog::info("ready");
  spdlog::debug("below the level");
  const auto written = lines();
  ASSERT_EQ(written.size(), 1U);
  EXPECT_TRUE(written[0].ends_with("Z oblique-worker info: ready")) << written[0];
}

}  // namespace
}  // namespace oblique::protocol
