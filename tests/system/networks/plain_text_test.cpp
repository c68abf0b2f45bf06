// With keys on, nothing that people wrote or that was computed can be read on the way.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/system/networks/capture.h"
#include "tests/system/networks/study_on_lan.h"

namespace oblique::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class PlainText : public StudyOnLan {
 protected:
  /// What goes to the server and comes from it while a study with a conspicuous name is solved and
  /// asked for.
  std::string captured() {
    Capture capture(*server_host_);
    start_server();
    workers_.push_back(worker_on(*worker_hosts_[0]));  // it says its name, worker1
    using Words = std::vector<std::string>;
    for (const Words& asked :
         {Words{"submit", "--watch", "--name", "conspicuous", "--preset", "paper", "--H", "1",
                "--mu", "1.2", "--e", "1"},
          Words{"query", "conspicuous", "--select", "fn_peak_N,mode", "--where", "e > 0.95"},
          Words{"sql", "SELECT count(*) FROM runs"}, Words{"workers"}}) {
      const Outcome ran = client(asked)->outcome();
      EXPECT_EQ(ran.exit_code, 0) << ran.err;
    }
    return capture.bytes();
  }

  /// What says something: names of the study and the worker, a column, words of a statement, the
  /// states of a contact, a unit's instruction set.
  const std::vector<std::string> telling_{"conspicuous", "worker1", "fn_peak_N",
                                          "SELECT",      "SC SR",   "0.95"};
};

TEST_F(PlainText, CanBeReadOnTheWayWithoutKeys) {
  keys_.clear();
  const std::string bytes = captured();
  for (const std::string& words : telling_) {
    EXPECT_THAT(bytes.find(words), Not(std::string::npos)) << words;
  }
}

TEST_F(PlainText, IsNotToBeFoundWithKeys) {
  const std::string bytes = captured();
  ASSERT_THAT(bytes.find("CURVE"), Not(std::string::npos)) << "nothing was captured";
  for (const std::string& words : telling_) {
    EXPECT_EQ(bytes.find(words), std::string::npos) << words;
  }
}

}  // namespace
}  // namespace oblique::test
