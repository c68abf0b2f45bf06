// Connections on loopback that are slow, stall or break silently.
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/networks/small_study.h"
#include "tests/system/tcp_proxy.h"

namespace oblique::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A server with keys, and two workers and a client with slow connections to it.
class LongLines : public ::testing::Test {
 protected:
  /// Starts all programs and waits for the first result. All bytes are delayed by `delay`.
  void start(milliseconds delay) {
    ASSERT_EQ(run_oblique(folder_, {"keygen", keys_}).exit_code, 0);
    server_ = std::make_unique<Server>(folder_, folder_.file("study.db"),
                                       Environment{{"OBLIQUE_KEYS", keys_ + "/server.key"}});
    to_workers_port_ = std::make_unique<TcpProxy>(server_->worker_url(), delay);
    to_clients_port_ = std::make_unique<TcpProxy>(server_->client_url(), delay);
    for (auto* worker : {&worker_, &other_worker_}) {
      worker->emplace(folder_, to_workers_port_->url(),
                      std::vector<std::string>{"--threads", "1", "--keys", keys_ + "/worker.key"});
    }
    auto arguments = submit_and_watch();
    // On a busy machine slow connections may exceed the default timeout of ten seconds.
    arguments.insert(arguments.end(), {"--server", to_clients_port_->url(), "--keys", client_key_,
                                       "--timeout", "600"});
    client_.emplace(folder_, client_program(), arguments);
    wait_for_rows(database_, 1);
  }

  void expect_completed() {
    test::expect_completed(*client_, database_, [this] {
      return run_oblique(folder_, {"workers", "--format", "json", "--server", server_->client_url(),
                                   "--keys", client_key_})
          .out;
    });
  }

  TemporaryFolder folder_;
  std::string keys_{folder_.file("keys")};
  std::string client_key_{keys_ + "/client.key"};
  Database database_{folder_.file("study.db")};
  std::unique_ptr<Server> server_;
  std::unique_ptr<TcpProxy> to_workers_port_;
  std::unique_ptr<TcpProxy> to_clients_port_;
  std::optional<Worker> worker_;
  std::optional<Worker> other_worker_;
  std::optional<Process> client_;
};

TEST_F(LongLines, AHandshakeMayTakeLongerThanTheFirstTimeout) {
  start(milliseconds(600));  // waits until a study is submitted and points are stored
  EXPECT_GE(to_workers_port_->connections(), 4) << "both workers reconnected";
}

TEST_F(LongLines, AStudyCompletesAlthoughLinesStallRepeatedlyForSeconds) {
  start(milliseconds(200));
  // The second stall exceeds the duration of a lease.
  for (const milliseconds time : {milliseconds(1500), milliseconds(4000)}) {
    for (const bool stalls : {true, false}) {
      to_workers_port_->stall(stalls);
      to_clients_port_->stall(stalls);
      std::this_thread::sleep_for(stalls ? time : milliseconds(800));
    }
  }
  expect_completed();
}

TEST_F(LongLines, AStudyCompletesAlthoughConnectionsBreakSilently) {
  start(milliseconds(200));
  to_workers_port_->swallow();
  to_clients_port_->swallow();
  expect_completed();
  EXPECT_GE(to_workers_port_->connections(), 4) << "both workers reconnected";
}

}  // namespace
}  // namespace oblique::test
