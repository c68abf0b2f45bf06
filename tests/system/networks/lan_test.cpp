// Programs on separate machines: broken, lossy and stalled connections, changed addresses, captured
// packets, and the commands of README.md for a second machine.
#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <regex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/system/descriptor.h"
#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/networks/lan.h"
#include "tests/system/networks/small_study.h"

namespace oblique::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

/// A server, two workers and a client, each on its own machine, and a study that takes seconds. The
/// tests are skipped if no networks can be created.
class StudyOnLan : public ::testing::Test {
 protected:
  void SetUp() override {
    try {
      lan_.emplace(folder_);
    } catch (const NoNamespaces& reason) {
      GTEST_SKIP() << reason.what();
    }
    server_host_ = &lan_->add("server", 2);
    worker_hosts_[0] = &lan_->add("worker1", 3);
    worker_hosts_[1] = &lan_->add("worker2", 4);
    client_host_ = &lan_->add("client", 5);
    server_name_ = server_host_->v4();
    keys_ = folder_.file("keys");
    const Outcome made = run_oblique(folder_, {"keygen", keys_});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }

  /// Returns the options for a client or worker (`role`) to connect to the server.
  std::vector<std::string> access(const std::string& role) const {
    const std::string port = role == "worker" ? "7601" : "7600";
    std::vector<std::string> options{"--server", "tcp://" + server_name_ + ":" + port};
    if (!keys_.empty()) {
      options.insert(options.end(), {"--keys", keys_ + "/" + role + ".key"});
    }
    return options;
  }

  /// Starts the server at its default ports; `::` means all IPv4 and IPv6 addresses.
  void start_server(const std::string& address = "::") {
    const Inside inside(*server_host_);
    std::vector<std::string> arguments{"--db", folder_.file("study.db"), "--listen", address};
    if (keys_.empty()) {
      arguments.emplace_back("--insecure");
    } else {
      arguments.insert(arguments.end(), {"--keys", keys_ + "/server.key"});
    }
    server_ = std::make_unique<Server>(folder_, arguments);
  }
  /// Starts a worker on `host`; the worker has the name of the host.
  std::unique_ptr<Process> worker_on(const Host& host) const {
    const Inside inside(host);
    auto arguments = access("worker");
    arguments.insert(arguments.end(), {"--threads", "1", "--name", host.name(),
                                       "--stop-with-parent", std::to_string(getpid())});
    return std::make_unique<Process>(folder_, worker_program(), arguments);
  }
  /// Starts `oblique` on the client's machine with `arguments` and the server's address.
  std::unique_ptr<Process> client(std::vector<std::string> arguments) const {
    const Inside inside(*client_host_);
    const auto options = access("client");
    arguments.insert(arguments.end(), options.begin(), options.end());
    return std::make_unique<Process>(folder_, client_program(), arguments);
  }

  /// Starts all programs that do not run yet, and calls `fault` when the first results are stored;
  /// `fault` causes and repairs a fault. Then the study must complete (small_study.h), and all
  /// workers must still run. Prints the time until new results are stored.
  void expect_completion_after(const std::function<void()>& fault, std::size_t workers = 2) {
    if (server_ == nullptr) {
      start_server();
    }
    for (std::size_t i = 0; i < workers; ++i) {
      workers_.push_back(worker_on(*worker_hosts_.at(i)));
    }
    if (client_ == nullptr) {
      client_ = client(submit_and_watch());
    }
    wait_for_rows(database_, 1);
    fault();
    const auto repaired = std::chrono::steady_clock::now();
    const double rows = database_.rows();
    ASSERT_LT(rows, kManyPoints) << "the study was too short for this fault";
    wait_for_rows(database_, rows + 1);
    print_measured("new results after", repaired);
    expect_completed(*client_, database_, [this] {
      return client({"workers", "--format", "json"})->outcome().out;
    });
    for (const auto& worker : workers_) {
      EXPECT_FALSE(worker->exit_code()) << worker->err();
    }
  }

  TemporaryFolder folder_;
  std::optional<Lan> lan_;
  Host* server_host_ = nullptr;
  std::array<Host*, 2> worker_hosts_{};
  Host* client_host_ = nullptr;

  /// The host name of the server in addresses; initially its IPv4 address.
  std::string server_name_;
  std::string keys_;  ///< folder with the keys of all programs; empty: no keys

  std::unique_ptr<Server> server_;
  std::vector<std::unique_ptr<Process>> workers_;
  std::unique_ptr<Process> client_;
  Database database_{folder_.file("study.db")};
};

// ---- Broken connections -------------------------------------------------------------------------

class BrokenLines : public StudyOnLan {
 protected:
  static void pull_for(const Host& host, milliseconds time) {
    host.pull_cable();
    std::this_thread::sleep_for(time);
    host.plug_cable();
  }
};

TEST_F(BrokenLines, AStudyCompletesAfterTheServersCableIsPulledForTenSeconds) {
  expect_completion_after([this] { pull_for(*server_host_, seconds(10)); });
}

TEST_F(BrokenLines, AStudyCompletesAfterTheCableOfTheOnlyWorkerIsPulledForTenSeconds) {
  expect_completion_after([this] { pull_for(*worker_hosts_[0], seconds(10)); }, 1);
}

TEST_F(BrokenLines, AStudyCompletesAfterTheServersCableIsPulledForLessTimeThanALeaseLasts) {
  expect_completion_after([this] { pull_for(*server_host_, milliseconds(1500)); });
}

TEST_F(BrokenLines, AStudyCompletesAlthoughFivePercentOfThePacketsAreLost) {
  for (const Host* host : {server_host_, worker_hosts_[0], worker_hosts_[1], client_host_}) {
    host->lose_percent(5);
  }
  expect_completion_after([] {});
}

TEST_F(BrokenLines, AStudyCompletesAfterAWorkerIsCutOffSilentlyAndRestarted) {
  expect_completion_after([this] {
    worker_hosts_[0]->lose_everything();
    workers_[0]->send(SIGKILL);
    workers_[0]->wait();
    worker_hosts_[0]->lose_nothing();  // the server still has a connection to the killed worker
    workers_[0] = worker_on(*worker_hosts_[0]);
  });
}

TEST_F(BrokenLines, AStudyCompletesAfterTheServerIsCutOffSilentlyForTenSeconds) {
  expect_completion_after([this] {
    server_host_->lose_everything();
    std::this_thread::sleep_for(seconds(10));
    server_host_->lose_nothing();
  });
}

TEST_F(BrokenLines, AStudyCompletesAfterTheServersMachineGoesDownSilentlyAndComesBack) {
  expect_completion_after([this] {
    server_host_->pull_cable();
    server_->process().send(SIGKILL);
    server_->process().wait();
    std::this_thread::sleep_for(seconds(4));
    server_host_->plug_cable();
    start_server();
  });
}

// ---- Changed addresses --------------------------------------------------------------------------

using ChangedAddresses = StudyOnLan;

TEST_F(ChangedAddresses, AStudyCompletesAfterTheMachineOfTheOnlyWorkerGetsAnotherAddress) {
  expect_completion_after([this] { worker_hosts_[0]->renumber(13); }, 1);
}

TEST_F(ChangedAddresses, AStudyCompletesAfterTheClientsMachineGetsAnotherAddress) {
  start_server();
  client_ = client(submit_and_watch());
  const auto has_printed = [this](const std::string& words) {
    return client_->err().find(words) != std::string::npos;
  };
  wait_until("the client watches", [&] { return has_printed("waits for a worker"); });
  client_host_->renumber(15);
  const auto renumbered = std::chrono::steady_clock::now();
  wait_until("the client receives replies again", [&] { return has_printed("answers again"); });
  print_measured("the client receives replies again after", renumbered);
  expect_completion_after([] {});
}

TEST_F(ChangedAddresses, AStudyCompletesAfterTheServersMachineGetsAnotherAddressUnderItsName) {
  lan_->set_addresses("coordinator", {server_host_->v4()});
  server_name_ = "coordinator";
  expect_completion_after([this] {
    server_host_->renumber(12);
    lan_->set_addresses("coordinator", {server_host_->v4()});
  });
}

TEST_F(ChangedAddresses, ANameWithoutAddressIsReported) {
  server_name_ = "nowhere";
  const Outcome status = client({"status", "--timeout", "0.2"})->outcome();
  EXPECT_EQ(status.exit_code, 1);
  EXPECT_NE(status.err.find("the name nowhere has no address"), std::string::npos) << status.err;
}

using IPv6 = StudyOnLan;

TEST_F(IPv6, CarriesAStudy) {
  server_name_ = "[" + server_host_->v6() + "]";
  expect_completion_after([] {});
}

TEST_F(IPv6, CarriesAStudyOverLinkLocalAddresses) {
  const std::string address = server_host_->link_local() + "%eth0";
  server_name_ = "[" + address + "]";
  start_server(address);
  expect_completion_after([] {});
}

TEST_F(IPv6, AddressesAreFoundByName) {
  lan_->set_addresses("coordinator", {server_host_->v6()});
  server_name_ = "coordinator";
  expect_completion_after([] {});
}

TEST_F(IPv6, IsTriedIfTheIPv4AddressOfTheSameNameDoesNotAnswer) {
  lan_->set_addresses("coordinator", {server_host_->v4(), server_host_->v6()});
  server_name_ = "coordinator";
  start_server(server_host_->v6());
  expect_completion_after([] {});
}

// ---- Encryption ---------------------------------------------------------------------------------

/// Captures all packets on the cable of a machine, in both directions.
class Capture {
 public:
  /// Throws std::runtime_error if the system refuses a packet socket.
  explicit Capture(const Host& host)
      : socket_(socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, htons(ETH_P_ALL))) {
    sockaddr_ll cable{};
    cable.sll_family = AF_PACKET;
    cable.sll_protocol = htons(ETH_P_ALL);
    cable.sll_ifindex = static_cast<int>(if_nametoindex(("to-" + host.name()).c_str()));
    // A large buffer avoids lost packets on a busy machine. Without the right to exceed the
    // system's limit the default buffer must suffice.
    constexpr int kWaitingBytes = 64 << 20;
    static_cast<void>(setsockopt(socket_.number(), SOL_SOCKET, SO_RCVBUFFORCE, &kWaitingBytes,
                                 sizeof kWaitingBytes));
    if (bind(socket_.number(), reinterpret_cast<const sockaddr*>(&cable), sizeof cable) != 0) {
      throw std::runtime_error(std::string("cannot capture: ") + std::strerror(errno));
    }
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }

  /// Ends the capture and returns all packets with their headers.
  const std::string& bytes() {
    thread_.request_stop();
    thread_.join();
    return bytes_;
  }

 private:
  void run(const std::stop_token& stop) {
    // The buffer is large, because virtual cables transmit packets that a real cable would split.
    std::vector<char> packet(std::size_t{1} << 17U);
    while (!stop.stop_requested()) {
      pollfd polled{socket_.number(), POLLIN, 0};
      poll(&polled, 1, 20);
      ssize_t count = 0;
      while ((count = recv(socket_.number(), packet.data(), packet.size(), 0)) > 0) {
        bytes_.append(packet.data(), static_cast<std::size_t>(count));
      }
    }
  }

  protocol::Descriptor socket_;
  std::string bytes_;
  std::jthread thread_;  ///< declared last, because the thread uses the other members
};

class PlainText : public StudyOnLan {
 protected:
  /// Returns all traffic of the server while a study named "conspicuous" is solved and queried.
  std::string captured() {
    Capture capture(*server_host_);
    start_server();
    workers_.push_back(
        worker_on(*worker_hosts_[0]));  // the worker's first message contains its name, worker1
    using Words = std::vector<std::string>;
    for (const Words& words :
         {Words{"submit", "--watch", "--name", "conspicuous", "--preset", "paper", "--H", "1",
                "--mu", "1.2", "--e", "1"},
          Words{"query", "conspicuous", "--select", "fn_peak_N,mode", "--where", "e > 0.95"},
          Words{"sql", "SELECT count(*) FROM runs"}, Words{"workers"}}) {
      const Outcome ran = client(words)->outcome();
      EXPECT_EQ(ran.exit_code, 0) << ran.err;
    }
    return capture.bytes();
  }

  /// Texts that plain traffic reveals: names of study and worker, a column, a word of a statement,
  /// states of a contact and a value.
  const std::vector<std::string> revealing_texts_{"conspicuous", "worker1", "fn_peak_N",
                                                  "SELECT",      "SC SR",   "0.95"};
};

TEST_F(PlainText, IsReadableOnTheNetworkWithoutKeys) {
  keys_.clear();
  const std::string bytes = captured();
  for (const std::string& words : revealing_texts_) {
    EXPECT_THAT(bytes.find(words), Not(std::string::npos)) << words;
  }
}

TEST_F(PlainText, IsNotReadableOnTheNetworkWithKeys) {
  const std::string bytes = captured();
  ASSERT_THAT(bytes.find("CURVE"), Not(std::string::npos)) << "no packets were captured";
  for (const std::string& words : revealing_texts_) {
    EXPECT_EQ(bytes.find(words), std::string::npos) << words;
  }
}

// ---- The commands of README.md ------------------------------------------------------------------

std::string readme() {
  std::ifstream file(OBLIQUE_SOURCE_DIR "/README.md");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Returns the first fenced code block with the language `kind` after the text `place`.
std::string block_after(const std::string& text, const std::string& place,
                        const std::string& kind) {
  const std::string fence = "\n```" + kind + "\n";
  const auto begin = text.find(fence, text.find(place)) + fence.size();
  return text.substr(begin, text.find("\n```", begin) + 1 - begin);
}

/// A command of README.md and the machine on which a user types it.
struct Typed {
  std::string machine;
  std::string command;
};

std::vector<Typed> commands_of(const std::string& block) {
  std::vector<Typed> commands;
  const std::regex line("(\\w+)\\$ +(.*)\n");
  for (std::sregex_iterator found(block.begin(), block.end(), line), end; found != end; ++found) {
    commands.push_back({found->str(1), found->str(2)});
  }
  return commands;
}

class ReadmeCommands : public StudyOnLan {
 protected:
  void SetUp() override {
    StudyOnLan::SetUp();
    if (lan_) {
      lan_->set_addresses("coordinator", {server_host_->v4(), server_host_->v6()});
    }
  }

  /// Runs the command on its machine. Replaces scp, which needs a login, by cp between the folders
  /// of the machines.
  std::unique_ptr<Process> type(const Typed& typed) const {
    const bool is_coordinator = typed.machine == "coordinator";
    const Inside inside(is_coordinator ? *server_host_ : *client_host_);
    std::string command = "exec " + typed.command;
    if (typed.command.starts_with("scp ")) {
      const std::regex login("coordinator:");
      command = "cp " + std::regex_replace(typed.command.substr(4), login,
                                           coordinator_.path().string() + "/");
    }
    const std::string programs = server_program().substr(0, server_program().rfind('/'));
    return std::make_unique<Process>(is_coordinator ? coordinator_ : elsewhere_, "/bin/sh",
                                     std::vector<std::string>{"-ec", command},
                                     Environment{{"PATH", programs + ":/usr/bin:/bin"}});
  }

  TemporaryFolder coordinator_;
  TemporaryFolder elsewhere_;
};

TEST_F(ReadmeCommands, FiveCommandsLeadFromNewKeysToAResultOfAnotherMachine) {
  const std::string text = readme();
  std::ofstream(elsewhere_.file("first.toml")) << block_after(text, "## A study", "toml");
  const auto commands = commands_of(block_after(text, "## More than one machine", ""));
  ASSERT_EQ(commands.size(), 5U);
  std::vector<std::unique_ptr<Process>> stay;
  Outcome last{};
  for (const Typed& typed : commands) {
    auto process = type(typed);
    if (typed.command.starts_with("oblique-")) {
      stay.push_back(std::move(process));
      continue;
    }
    last = process->outcome();
    ASSERT_EQ(last.exit_code, 0) << typed.command << "\n" << last.err;
  }
  EXPECT_EQ(stay.size(), 2U) << "expected a server and a worker";
  EXPECT_THAT(last.out, HasSubstr("fn_peak_N"));
  EXPECT_THAT(last.out, HasSubstr("solved"));
}

}  // namespace
}  // namespace oblique::test
