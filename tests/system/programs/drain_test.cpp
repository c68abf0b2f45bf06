// Draining: a server that is stopped while batches run, and its notifications to systemd.
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::test {
namespace {

/// Fake systemd for one program. The system queues at most ten messages; further ones are lost.
class Manager {
 public:
  explicit Manager(const TemporaryFolder& folder, const std::string& name = "notify")
      : path_(folder.file(name)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path_.data(), path_.size());
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
      throw std::runtime_error("cannot listen at " + path_);
    }
  }
  ~Manager() { close(socket_); }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  Environment environment() const {
    return {{"NOTIFY_SOCKET", path_}, {"OBLIQUE_SERVER_DRAIN", "600"}};
  }
  /// Returns the environment of a service with a watchdog.
  Environment watching() const {
    Environment all = environment();
    all["WATCHDOG_USEC"] = "400000";
    return all;
  }
  /// Returns true if a message with the text `what` has been received.
  bool received(const std::string& what) {
    std::array<char, 4096> bytes{};
    ssize_t got = 0;
    while ((got = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0) {
      all_ += std::string(bytes.data(), static_cast<std::size_t>(got)) + "\n";
    }
    return all_.find(what) != std::string::npos;
  }

 private:
  std::string path_;
  int socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  std::string all_;
};

class DrainTest : public testing::Test {
 protected:
  /// Submits points whose fall takes more than a minute to solve.
  void submit() {
    const Outcome outcome = run_oblique(
        folder_, {"submit", "--server", server_.client_url(), "--preset", "paper", "--H", "1",
                  "--mu", "0.1:2:40", "--e", "1", "--elements-per-link", "64", "--name", "study"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  Outcome status() {
    return run_oblique(folder_,
                       {"status", "study", "--server", server_.client_url(), "--format", "json"});
  }
  void wait_until_leased() {
    wait_until("the worker has a batch", [&] {
      return status().out.find("\"leased\":0") == std::string::npos &&
             status().out.find("\"leased\": 0") == std::string::npos;
    });
  }

  TemporaryFolder folder_;
  Manager manager_{folder_};
  Server server_{folder_, folder_.file("a.db"), manager_.environment()};
};

TEST_F(DrainTest, WaitsForRunningBatchesAndReportsThisToClientsAndSystemd) {
  submit();
  Worker worker(folder_, server_.worker_url(), {"--threads", "1"});
  wait_until_leased();
  server_.process().send(SIGTERM);
  wait_until("the server drains", [&] { return manager_.received("STATUS=draining"); });
  EXPECT_TRUE(manager_.received("STOPPING=1"));
  const Outcome refused =
      run_oblique(folder_, {"submit", "--server", server_.client_url(), "--preset", "paper", "--H",
                            "1", "--mu", "0.5", "--e", "1", "--name", "another"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("draining"), std::string::npos) << refused.err;
  EXPECT_NE(status().out.find("draining"), std::string::npos);
  worker.send(SIGTERM);  // the worker returns its batch
  EXPECT_EQ(server_.process().wait(), 0);
  const std::string log = server_.process().err();
  EXPECT_NE(log.find(" drained: "), std::string::npos) << log;
}

TEST_F(DrainTest, ASecondSignalEndsADrainAtOnce) {
  submit();
  Worker worker(folder_, server_.worker_url(), {"--threads", "1"});
  wait_until_leased();
  server_.process().send(SIGTERM);
  wait_until("the server drains", [&] { return manager_.received("STATUS=draining"); });
  server_.process().send(SIGINT);
  EXPECT_EQ(server_.process().wait(), 0);
  EXPECT_EQ(server_.process().err().find(" drained: "), std::string::npos);
}

TEST_F(DrainTest, ADrainEndsAtOnceWithoutRunningBatches) {
  server_.process().send(SIGTERM);
  EXPECT_EQ(server_.process().wait(), 0);
  EXPECT_NE(server_.process().err().find(" drained: "), std::string::npos);
}

TEST_F(DrainTest, ServerAndWorkerNotifySystemdOfReadinessAndFeedItsWatchdog) {
  Manager of_server(folder_, "of_server");
  const Server server(folder_, folder_.file("b.db"), of_server.watching());
  Manager of_worker(folder_, "of_worker");
  Worker worker(folder_, server.worker_url(), {}, of_worker.watching());
  for (Manager* manager : {&of_server, &of_worker}) {
    wait_until("READY=1 is received", [&] { return manager->received("READY=1"); });
    wait_until("WATCHDOG=1 is received", [&] { return manager->received("WATCHDOG=1"); });
  }
  worker.send(SIGTERM);
  wait_until("the worker sends STOPPING=1", [&] { return of_worker.received("STOPPING=1"); });
  EXPECT_EQ(worker.wait(), 0);
}

}  // namespace
}  // namespace oblique::test
