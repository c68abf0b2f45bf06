#include "proto/program/process.h"

#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proto/program/usage.h"
#include "tests/support/temporary_folder.h"

namespace oblique::protocol {
namespace {

using namespace std::chrono_literals;

/// A service manager's socket.
class NotifierTest : public testing::Test {
 protected:
  ~NotifierTest() override {
    close(socket_);
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) {
      unsetenv(name);
    }
  }

  void listen(const std::string& name) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name.data(), name.size());
    const bool is_abstract = name.front() == '@';
    address.sun_path[0] = is_abstract ? '\0' : name.front();
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size() +
                                               (is_abstract ? 0 : 1));
    ASSERT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), length), 0);
    setenv("NOTIFY_SOCKET", name.c_str(), 1);
  }

  /// All that has come.
  std::vector<std::string> heard() const {
    std::vector<std::string> all;
    std::array<char, 4096> bytes{};
    ssize_t got = 0;
    while ((got = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0) {
      all.emplace_back(bytes.data(), static_cast<std::size_t>(got));
    }
    return all;
  }

  test::TemporaryFolder folder_;
  int socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  Notifier::Clock::time_point now_;
};

TEST_F(NotifierTest, SaysThatTheProgramIsReadyAtAPathOrAnAbstractName) {
  for (const std::string& name :
       {folder_.file("notify"), "@oblique-test-" + std::to_string(getpid())}) {
    close(socket_);
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    listen(name);
    Notifier notifier;
    notifier.ready("clients at x");
    EXPECT_EQ(heard(), std::vector<std::string>{"READY=1\nSTATUS=clients at x"}) << name;
  }
}

TEST_F(NotifierTest, SendsAStatusOnceInOneLineAndAnEndWithTheTimeThatItMayTake) {
  listen(folder_.file("notify"));
  Notifier notifier;
  notifier.status("one\nREADY=1");
  notifier.status("one\nREADY=1");
  notifier.stopping("draining", 120s);
  EXPECT_EQ(heard(), (std::vector<std::string>{
                         "STATUS=one\\nREADY=1",
                         "STOPPING=1\nSTATUS=draining\nEXTEND_TIMEOUT_USEC=120000000"}));
}

TEST_F(NotifierTest, SaysThatItLivesAtHalfOfTheTimeAndOnlyWhenItTurns) {
  listen(folder_.file("notify"));
  setenv("WATCHDOG_USEC", "1000000", 1);
  setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  Notifier notifier;
  EXPECT_EQ(std::getenv("NOTIFY_SOCKET"), nullptr) << "no child inherits it";
  EXPECT_EQ(std::getenv("WATCHDOG_USEC"), nullptr);
  std::size_t said = 0;
  for (int turn = 0; turn < 100; ++turn, now_ += 100ms) {  // 10 s
    notifier.turn(now_);
    said += heard().size();
  }
  EXPECT_EQ(said, 20U);
  setenv("NOTIFY_SOCKET", folder_.file("notify").c_str(), 1);
  setenv("WATCHDOG_USEC", "1000000", 1);
  setenv("WATCHDOG_PID", "1", 1);
  Notifier of_another_process;
  of_another_process.turn(now_);
  EXPECT_TRUE(heard().empty());
}

TEST_F(NotifierTest, WithoutASocketOrWithABrokenOneNothingHappens) {
  for (const std::string& name : {std::string(), std::string("relative"), std::string("@"),
                                  std::string(1000, '/'), folder_.file("nobody")}) {
    setenv("NOTIFY_SOCKET", name.c_str(), 1);
    Notifier notifier;
    notifier.ready("ready");
    notifier.turn(now_);
    notifier.stopping("stopping", 1s);
  }
}

/// What `begin` gives in a process of its own, started with these words; −1 when the words are
/// wrong.
int began(std::vector<std::string> words) {
  const pid_t child = fork();
  if (child == 0) {
    StopWithParent parent;
    CLI::App app;
    app.option_defaults()->always_capture_default();
    parent.add_to(app);
    try {
      app.parse(std::move(words));
      int signal = 0;
      const bool begins = parent.begin();
      const bool watches = prctl(PR_GET_PDEATHSIG, &signal) == 0 && signal == SIGTERM;
      _exit((begins ? 1 : 0) + (watches ? 2 : 0));
    } catch (const CLI::ParseError&) {
      _exit(100);
    }
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return WIFEXITED(status) && WEXITSTATUS(status) != 100 ? WEXITSTATUS(status) : -1;
}

constexpr int kBegins = 1;
constexpr int kWatches = 2;

TEST(StopWithParent, TheSystemIsAskedForSigtermWhenTheParentEnds) {
  EXPECT_EQ(began({}), kBegins) << "without the option";
  EXPECT_EQ(began({"--stop-with-parent"}), kBegins + kWatches);
  EXPECT_EQ(began({std::to_string(getpid()), "--stop-with-parent"}), kBegins + kWatches);
  EXPECT_EQ(began({std::to_string(getppid()), "--stop-with-parent"}), kWatches) << "it has ended";
}

TEST(StopWithParent, WhatIsNoProcessIsRefused) {
  for (const char* const text : {"-1", "0", "1.5", "me"}) {
    EXPECT_EQ(began({text, "--stop-with-parent"}), -1) << text;
  }
}

TEST(StopSignals, TheFirstOfSeveralIsTheExitCode) {
  StopSignals stop;
  EXPECT_FALSE(stop.requested());
  EXPECT_FALSE(stop.wait(1ms));
  raise(SIGHUP);
  EXPECT_TRUE(stop.wait(0ms));
  EXPECT_TRUE(stop.requested());
  raise(SIGINT);
  EXPECT_TRUE(stop.requested());
  EXPECT_EQ(stop.exit_code(), 128 + SIGHUP);
}

TEST(StopSignals, AHangUpThatIsIgnoredStaysIgnored) {
  const auto before = std::signal(SIGHUP, SIG_IGN);
  {
    StopSignals stop;
    raise(SIGHUP);
    EXPECT_FALSE(stop.requested());
  }
  std::signal(SIGHUP, before);
}

TEST(StopSignals, AfterItSignalsArePassedOnButNotOneThatHasCome) {
  {
    const StopSignals stop;
    raise(SIGTERM);  // would end this process below if it were left pending
  }
  sigset_t blocked;
  ASSERT_EQ(pthread_sigmask(SIG_BLOCK, nullptr, &blocked), 0);
  EXPECT_EQ(sigismember(&blocked, SIGTERM), 0);
  EXPECT_EQ(sigismember(&blocked, SIGINT), 0);
}

/// 2026-11-22T05:00:00Z
const std::chrono::system_clock::time_point kNow{std::chrono::seconds(1'795'323'600)};

TEST(TimeUntil, ReadsTimesInUtcAndDurations) {
  for (const auto& [text, expected_s] :
       std::vector<std::pair<std::string, std::int64_t>>{{"0s", 0},
                                                         {"5400s", 5400},
                                                         {"90m", 5400},
                                                         {"1.5h", 5400},
                                                         {"2026-11-22T05:01:00Z", 60},
                                                         {"2026-11-22T04:59:00Z", -60}}) {
    EXPECT_EQ(time_until(text, kNow), std::chrono::seconds(expected_s)) << text;
  }
}

TEST(TimeUntil, RefusesEverythingElse) {
  for (const char* text : {"", "soon", "s", "5400", "-5s", "5x", "1h30m", "nans", "infs", "1e300h",
                           "2026-11-22", "2026-11-22T05:00:00", "2026-13-01T00:00:00Z",
                           "2026-02-30T00:00:00Z", "2026-11-22T05:00:00Z "}) {
    EXPECT_EQ(time_until(text, kNow), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace oblique::protocol
