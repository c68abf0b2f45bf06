// Runs the tests of a program all at once, each in a process of its own: they wait most of the
// time, and each makes a network that only its own process is in. The exit code is 0 when all
// passed, 77 when none failed and some were skipped, else 1. With --gtest_filter it runs those one
// after another in this process.
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace oblique::test {
namespace {

constexpr int kPassed = 0;
constexpr int kFailed = 1;
constexpr int kSkipped = 77;

/// By full name.
std::vector<std::string> names_of_tests() {
  std::vector<std::string> names;
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  for (int i = 0; i < all.total_test_suite_count(); ++i) {
    const testing::TestSuite& suite = *all.GetTestSuite(i);
    for (int j = 0; j < suite.total_test_count(); ++j) {
      names.push_back(std::string(suite.name()) + "." + suite.GetTestInfo(j)->name());
    }
  }
  return names;
}

/// Runs the tests of the filter here.
int run_here() {
  if (RUN_ALL_TESTS() != 0) {
    return kFailed;
  }
  return testing::UnitTest::GetInstance()->skipped_test_count() > 0 ? kSkipped : kPassed;
}

/// Starts one test with its output in a file.
pid_t start(const std::string& name, const std::string& output) {
  const pid_t pid = fork();
  if (pid != 0) {
    return pid;
  }
  if (std::freopen(output.c_str(), "w", stdout) == nullptr || dup2(1, 2) == -1) {
    std::_Exit(kFailed);
  }
  GTEST_FLAG_SET(filter, name);
  const int code = run_here();
  std::cout.flush();
  std::fflush(stdout);
  std::_Exit(code);
}

/// Waits for the end of all and prints what each wrote. The names with this exit code.
int outcome_of(const std::map<pid_t, std::string>& tests, const TemporaryFolder& folder) {
  std::vector<std::string> failed;
  std::vector<std::string> skipped;
  for (std::size_t i = 0; i < tests.size(); ++i) {
    int status = 0;
    const pid_t ended = wait(&status);
    const std::string& name = tests.at(ended);
    std::cout << std::ifstream(folder.file(name)).rdbuf() << std::flush;
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : kFailed;
    if (code == kSkipped) {
      skipped.push_back(name);
    } else if (code != kPassed) {
      failed.push_back(name);
    }
  }
  std::cout << tests.size() << " tests, " << skipped.size() << " skipped, " << failed.size()
            << " failed\n";
  for (const std::string& name : failed) {
    std::cout << "FAILED " << name << "\n";
  }
  if (!failed.empty()) {
    return kFailed;
  }
  return skipped.empty() ? kPassed : kSkipped;
}

int run_all() {
  const TemporaryFolder folder;
  std::map<pid_t, std::string> tests;
  for (const std::string& name : names_of_tests()) {
    tests[start(name, folder.file(name))] = name;
  }
  return outcome_of(tests, folder);
}

}  // namespace
}  // namespace oblique::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const bool are_chosen = GTEST_FLAG_GET(list_tests) || GTEST_FLAG_GET(filter) != "*";
  return are_chosen ? oblique::test::run_here() : oblique::test::run_all();
}
