// Clients that watch a study while its server stops and starts.
#include <csignal>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"

namespace oblique::test {
namespace {

constexpr double kPoints = 10;

/// A server with a study and no worker.
class ServerAwayTest : public ::testing::Test {
 protected:
  std::vector<std::string> submit_and_watch() const {
    return {"submit",   "--server", server_->client_url(),
            "--watch",  "--preset", "paper",
            "--H",      "1",        "--mu",
            "0.1:2:10", "--e",      "1",
            "--name",   "waiting"};
  }

  std::vector<std::string> watch() const {
    return {"watch", "waiting", "--server", server_->client_url()};
  }

  static void wait_until_printed(const Process& client, const std::string& words) {
    wait_until("the client prints: " + words,
               [&] { return client.err().find(words) != std::string::npos; });
  }

  void kill_server() {
    server_->process().send(SIGKILL);
    EXPECT_EQ(server_->process().wait(), -SIGKILL);
  }

  void start_server_again() { server_ = std::make_unique<Server>(folder_, database_, *server_); }

  TemporaryFolder folder_;
  std::string database_{folder_.file("waiting.db")};
  std::unique_ptr<Server> server_ = std::make_unique<Server>(folder_, database_);
};

TEST_F(ServerAwayTest, WatchingContinuesAfterTheServerIsKilledAndRestarted) {
  Process submitting(folder_, client_program(), submit_and_watch());
  wait_until_printed(submitting, "waits for a worker");
  Process watching(folder_, client_program(), watch());
  wait_until_printed(watching, "waits for a worker");
  kill_server();
  for (const Process* client : {&submitting, &watching}) {
    wait_until_printed(*client, "no answer from " + server_->client_url());
  }
  start_server_again();
  const Worker worker(folder_, server_->worker_url());
  for (Process* client : {&submitting, &watching}) {
    wait_until_printed(*client, "answers again");
    EXPECT_EQ(client->wait(), 0) << client->err();
  }
  EXPECT_EQ(Database(database_).rows(), kPoints);
}

TEST_F(ServerAwayTest, AServerThatNeverAnsweredIsNotWaitedFor) {
  kill_server();
  for (auto arguments : {submit_and_watch(), watch()}) {
    arguments.insert(arguments.end(), {"--timeout", "0.2"});
    const Outcome ran = run_oblique(folder_, arguments);
    EXPECT_EQ(ran.exit_code, 1) << ran.err;
    EXPECT_NE(ran.err.find("no answer from"), std::string::npos) << ran.err;
  }
}

TEST_F(ServerAwayTest, ASignalEndsWatchingWithTheExitCodeOfTheSignal) {
  // The first four clients get their signal while the server runs, the others while it is away.
  std::vector<std::unique_ptr<Process>> clients;
  for (int i = 0; i < 8; ++i) {
    const auto arguments = i % 2 == 0 ? submit_and_watch() : watch();
    clients.push_back(std::make_unique<Process>(folder_, client_program(), arguments));
    // The study must exist before the next client watches it.
    wait_until("the study is stored", [this] {
      const std::string count = "SELECT count(*) FROM studies";
      try {
        return Database(database_).number(count) == 1.0;
      } catch (const std::runtime_error&) {
        return false;  // no tables yet
      }
    });
  }
  for (const auto& client : clients) {
    wait_until_printed(*client, "waiting: 0 of");
  }
  for (std::size_t i = 0; i < clients.size(); ++i) {
    if (i == 4) {
      kill_server();
    }
    if (i >= 4) {
      wait_until_printed(*clients[i], "no answer from");
    }
    const int signal = i % 4 < 2 ? SIGINT : SIGTERM;
    clients[i]->send(signal);
    EXPECT_EQ(clients[i]->wait(), 128 + signal) << clients[i]->err();
    EXPECT_NE(clients[i]->err().find("Watching ended"), std::string::npos) << clients[i]->err();
  }
}

}  // namespace
}  // namespace oblique::test
