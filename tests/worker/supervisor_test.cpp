#include "worker/supervisor.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::worker {
namespace {

constexpr int kAsExpected = 5;
constexpr int kOtherwise = 6;

/// Ends this process by a signal, without a handler or a core file.
[[noreturn]] void die_of(int signal) {
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  std::signal(signal, SIG_DFL);
  raise(signal);
  std::abort();
}

class SupervisorTest : public testing::Test {
 protected:
  using Hello = protocol::WorkerHello;

  /// Supervises children that run `work`, which may die.
  int run(const std::function<int(const Hello&)>& work) {
    return supervise(stop_, slots_,
                     [&](const Hello& hello, int) -> int { std::_Exit(work(hello)); });
  }
  static std::vector<std::uint64_t> points_of(const Hello& hello) {
    return {hello.replaced().points().begin(), hello.replaced().points().end()};
  }
  /// Lets a child begin point 3 of study 7 and die, and the following ones run `next`.
  int run_after_death_by(int signal, const std::function<int(const Hello&)>& next) {
    return run([&](const Hello& hello) {
      if (hello.has_replaced()) {
        return next(hello);
      }
      slots_[1].study_id = 7;
      slots_[1].begin(3);
      slots_[1].begin(4);
      slots_[1].end(4);
      die_of(signal);
    });
  }

  protocol::StopSignals stop_;
  std::span<SolvingSlot> slots_ = make_shared_slots(2);
};

TEST_F(SupervisorTest, TheExitCodeOfTheChildIsReturned) {
  for (const int code : {0, 1, 77}) {
    EXPECT_EQ(run([&](const Hello& hello) {
                return !hello.has_replaced() && hello.process_id().size() == 32 ? code : kOtherwise;
              }),
              code);
  }
}

TEST_F(SupervisorTest, TheServiceManagerGetsMessagesOfTheChildFromTheParent) {
  const std::string name = "@oblique-supervisor-" + std::to_string(getpid());
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  name.copy(address.sun_path + 1, name.size() - 1, 1);
  const int manager = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  ASSERT_EQ(setsockopt(manager, SOL_SOCKET, SO_PASSCRED, &yes, sizeof(yes)), 0);
  ASSERT_EQ(bind(manager, reinterpret_cast<const sockaddr*>(&address),
                 static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size())),
            0);
  setenv("NOTIFY_SOCKET", name.c_str(), 1);
  EXPECT_EQ(supervise(stop_, slots_,
                      [&](const Hello&, int forwarder) -> int {
                        protocol::Notifier(forwarder).ready("x");
                        std::_Exit(kAsExpected);
                      }),
            kAsExpected);
  unsetenv("NOTIFY_SOCKET");
  std::array<char, 100> text{};
  std::array<char, CMSG_SPACE(sizeof(ucred))> control{};
  iovec part{text.data(), text.size()};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  ASSERT_GT(recvmsg(manager, &message, MSG_DONTWAIT), 0);
  close(manager);
  EXPECT_STREQ(text.data(), "READY=1\nSTATUS=x");
  ucred sender{};
  std::memcpy(&sender, CMSG_DATA(CMSG_FIRSTHDR(&message)), sizeof(sender));
  EXPECT_EQ(sender.pid, getpid());
}

TEST_F(SupervisorTest, AfterACrashTheNextChildReportsSignalAndPoints) {
  for (const int signal : {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT}) {
    EXPECT_EQ(run_after_death_by(signal,
                                 [&](const Hello& hello) {
                                   const bool is_reported =
                                       hello.replaced().signal() == signal &&
                                       hello.replaced().process_id() != hello.process_id() &&
                                       points_of(hello) == std::vector<std::uint64_t>{7, 3};
                                   return is_reported ? kAsExpected : kOtherwise;
                                 }),
              kAsExpected)
        << signal;
  }
}

TEST_F(SupervisorTest, AChildThatWasKilledReportsNoPoints) {
  for (const int signal : {SIGKILL, SIGUSR1, SIGPIPE}) {
    EXPECT_EQ(run_after_death_by(signal,
                                 [&](const Hello& hello) {
                                   return hello.replaced().signal() == signal &&
                                                  points_of(hello).empty()
                                              ? kAsExpected
                                              : kOtherwise;
                                 }),
              kAsExpected)
        << signal;
  }
}

TEST_F(SupervisorTest, ACrashDuringATraceReportsNoPoints) {
  EXPECT_EQ(run([&](const Hello& hello) {
              if (hello.has_replaced()) {
                return points_of(hello).empty() ? kAsExpected : kOtherwise;
              }
              slots_[2].begin(5);
              slots_[2].end(6);
              slots_[0].begin(0);
              die_of(SIGABRT);
            }),
            kAsExpected);
}

TEST_F(SupervisorTest, FallsThatAreSolvedAheadAreReported) {
  EXPECT_EQ(run([&](const Hello& hello) {
              if (hello.has_replaced()) {
                return points_of(hello) == std::vector<std::uint64_t>{7, 8, 7, 9} ? kAsExpected
                                                                                  : kOtherwise;
              }
              slots_[1].study_id = 7;
              slots_[1].begin_fall(1);
              slots_[1].end_falls();
              slots_[1].begin(8);
              slots_[1].begin_fall(9);
              slots_[1].end(10);  // a point without a record
              die_of(SIGABRT);
            }),
            kAsExpected);
}

TEST_F(SupervisorTest, AChildThatDiesBeforeItReportedKeepsTheReport) {
  int* const lives = static_cast<int*>(
      mmap(nullptr, sizeof(int), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  EXPECT_EQ(run_after_death_by(SIGABRT,
                               [&](const Hello& hello) {
                                 if (++*lives == 1) {
                                   die_of(SIGKILL);
                                 }
                                 return hello.replaced().signal() == SIGABRT ? kAsExpected
                                                                             : kOtherwise;
                               }),
            kAsExpected);
  munmap(lives, sizeof(int));
}

TEST_F(SupervisorTest, ASignalToStopIsForwarded) {
  EXPECT_EQ(run([&](const Hello&) {
              kill(getppid(), SIGINT);
              return stop_.wait(std::chrono::hours(1)) ? kAsExpected : kOtherwise;
            }),
            kAsExpected);
}

TEST_F(SupervisorTest, NoChildIsStartedAfterASignalToStop) {
  EXPECT_EQ(run([&](const Hello& hello) {
              if (hello.has_replaced()) {
                return kOtherwise;
              }
              slots_[1].end(0);
              kill(getppid(), SIGTERM);
              die_of(SIGKILL);
            }),
            0);
}

TEST_F(SupervisorTest, TheChildGetsASignalToStopWhenItsParentEnds) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  if (fork() == 0) {
    run([&](const Hello&) {
      kill(getppid(), SIGKILL);
      const char stopped = stop_.wait(std::chrono::hours(1)) ? 'y' : 'n';
      return write(ends[1], &stopped, 1) == 1 ? 0 : 1;
    });
    std::_Exit(0);
  }
  close(ends[1]);
  char stopped = ' ';
  EXPECT_EQ(read(ends[0], &stopped, 1), 1);
  EXPECT_EQ(stopped, 'y');
  close(ends[0]);
}

}  // namespace
}  // namespace oblique::worker
