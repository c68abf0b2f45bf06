// Lines that are long, stall and end without a word, on loopback: they need no network of their
// own.
#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/networks/slow_proxy.h"
#include "tests/system/networks/small_study.h"

namespace oblique::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A server, and two workers and a client behind a line of 200 ms to it.
class LongLines : public ::testing::Test {
 protected:
  void expect_completed() {
    test::expect_completed(client_, database_, [this] {
      return run_oblique(folder_, {"workers", "--server", server_.client_url(), "--format", "json"})
          .out;
    });
  }

  std::vector<std::string> submit_through_proxy() const {
    auto arguments = submit_and_watch();
    arguments.insert(arguments.end(), {"--server", to_clients_port_.url()});
    return arguments;
  }

  TemporaryFolder folder_;
  Database database_{folder_.file("study.db")};
  Server server_{folder_, folder_.file("study.db")};
  SlowProxy to_workers_port_{server_.worker_url(), milliseconds(200)};
  SlowProxy to_clients_port_{server_.client_url(), milliseconds(200)};
  Worker worker_{folder_, to_workers_port_.url(), {"--threads", "1"}};
  Worker other_worker_{folder_, to_workers_port_.url(), {"--threads", "1"}};
  Process client_{folder_, client_program(), submit_through_proxy()};
};

TEST_F(LongLines, TheyAreStalledForSecondsAgainAndAgain) {
  wait_for_rows(database_, 1);
  // The second time for longer than a lease lasts.
  for (const milliseconds time : {milliseconds(1500), milliseconds(4000)}) {
    for (const bool stalls : {true, false}) {
      to_workers_port_.stall(stalls);
      to_clients_port_.stall(stalls);
      std::this_thread::sleep_for(stalls ? time : milliseconds(800));
    }
  }
  expect_completed();
}

TEST_F(LongLines, TheyEndWithoutAWord) {
  wait_for_rows(database_, 1);
  to_workers_port_.swallow();
  to_clients_port_.swallow();
  expect_completed();
  EXPECT_GE(to_workers_port_.connections(), 4) << "both workers had to connect again";
}

}  // namespace
}  // namespace oblique::test
