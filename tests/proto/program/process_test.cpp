#include "proto/program/process.h"

#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>
#include <array>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace oblique::protocol {
namespace {

using namespace std::chrono_literals;

/// Takes the role of the service manager: receives the program's datagrams on a socket.
class NotifierTest : public testing::Test {
 protected:
  NotifierTest() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, path_.size());
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  }
  ~NotifierTest() override {
    close(socket_);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
  }

  /// All received datagrams.
  std::vector<std::string> received() const {
    std::vector<std::string> all;
    std::array<char, 4096> bytes{};
    ssize_t got = 0;
    while ((got = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0) {
      all.emplace_back(bytes.data(), static_cast<std::size_t>(got));
    }
    return all;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("notify");
  int socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  Notifier::Clock::time_point now_;
};

TEST_F(NotifierTest, SendsReadinessEachStatusOnceAndStoppingWithItsLongestTime) {
  Notifier notifier;
  notifier.ready("clients at x");
  notifier.status("one\nREADY=1");
  notifier.status("one\nREADY=1");
  notifier.stopping("draining", 120s);
  EXPECT_EQ(received(), (std::vector<std::string>{
                            "READY=1\nSTATUS=clients at x", "STATUS=one\\nREADY=1",
                            "STOPPING=1\nSTATUS=draining\nEXTEND_TIMEOUT_USEC=120000000"}));
}

TEST_F(NotifierTest, FeedsTheWatchdogAtHalfOfItsTimeOnlyWhenCalled) {
  setenv("WATCHDOG_USEC", "1000000", 1);
  Notifier notifier;
  std::size_t sent = 0;
  for (int turn = 0; turn < 100; ++turn, now_ += 100ms) {  // 10 s
    notifier.feed_watchdog(now_);
    sent += received().size();
  }
  EXPECT_EQ(sent, 20U);
}

TEST_F(NotifierTest, WithoutASocketOrWithABrokenOneNothingHappens) {
  for (const std::string& name : {std::string(), std::string("relative"), std::string("@"),
                                  std::string(1000, '/'), folder_.file("nobody")}) {
    setenv("NOTIFY_SOCKET", name.c_str(), 1);
    Notifier notifier;
    notifier.ready("ready");
    notifier.feed_watchdog(now_);
    notifier.stopping("stopping", 1s);
  }
  EXPECT_TRUE(received().empty());
}

TEST_F(NotifierTest, AnAbstractSocketIsNotified) {
  const std::string name = "@oblique-test-" + std::to_string(getpid());
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(address.sun_path, name.size());
  address.sun_path[0] = '\0';
  close(std::exchange(socket_, ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)));
  ASSERT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address),
                 static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size())),
            0);
  setenv("NOTIFY_SOCKET", name.c_str(), 1);
  Notifier().ready("x");
  EXPECT_EQ(received(), std::vector<std::string>{"READY=1\nSTATUS=x"});
}

/// Calls `stop_with_parent` in a child process. Returns its result, and whether the child will get
/// SIGTERM when its parent ends.
std::pair<bool, bool> stops_with(pid_t parent) {
  const pid_t child = fork();
  if (child == 0) {
    int signal = 0;
    const bool begins = stop_with_parent(parent);
    const bool watches = prctl(PR_GET_PDEATHSIG, &signal) == 0 && signal == SIGTERM;
    _exit((begins ? 1 : 0) + (watches ? 2 : 0));
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return {(WEXITSTATUS(status) & 1) != 0, (WEXITSTATUS(status) & 2) != 0};
}

TEST(StopWithParent, TheProcessGetsSigtermWhenItsParentEnds) {
  EXPECT_EQ(stops_with(0), std::pair(true, false)) << "parent 0 means that the option is not used";
  EXPECT_EQ(stops_with(getpid()), std::pair(true, true));
  EXPECT_EQ(stops_with(getppid()), std::pair(false, true))
      << "the given parent is no longer the parent";
}

TEST(StopSignals, TheFirstOfSeveralSignalsDeterminesTheExitCode) {
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

TEST(StopSignals, AnIgnoredSighupStaysIgnored) {
  const auto before = std::signal(SIGHUP, SIG_IGN);
  {
    StopSignals stop;
    raise(SIGHUP);
    EXPECT_FALSE(stop.requested());
  }
  std::signal(SIGHUP, before);
}

TEST(StopSignals, TheDestructorRestoresSignalsAndDropsPendingOnes) {
  {
    const StopSignals stop;
    raise(SIGTERM);  // if SIGTERM stayed pending, it would end the process after this block
  }
  sigset_t blocked;
  ASSERT_EQ(pthread_sigmask(SIG_BLOCK, nullptr, &blocked), 0);
  EXPECT_EQ(sigismember(&blocked, SIGTERM), 0);
  EXPECT_EQ(sigismember(&blocked, SIGINT), 0);
}

}  // namespace
}  // namespace oblique::protocol
