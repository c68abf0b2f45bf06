#include "proto/program/process.h"

#include <csignal>

#include <chrono>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

using std::chrono::milliseconds;

TEST(StopSignals, NoneHasComeAtFirstAndTheWaitEnds) {
  StopSignals stop;
  EXPECT_FALSE(stop.requested());
  EXPECT_FALSE(stop.wait(milliseconds(1)));
}

TEST(StopSignals, ASignalIsNoticedAndBecomesTheExitCode) {
  StopSignals stop;
  raise(SIGTERM);
  EXPECT_TRUE(stop.wait(milliseconds(0)));
  EXPECT_EQ(stop.exit_code(), 128 + SIGTERM);
}

TEST(StopSignals, TheFirstOfSeveralIsTheExitCode) {
  StopSignals stop;
  raise(SIGHUP);
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

TEST(StopSignals, ASignalThatIsOnlySeenAtTheDescriptorEndsNothingAfterwards) {
  {
    const StopSignals stop;
    raise(SIGTERM);
  }
  SUCCEED() << "or the signal would have ended the test";
}

TEST(StopSignals, AfterItSignalsAreBlockedNoMore) {
  { const StopSignals stop; }
  sigset_t blocked;
  ASSERT_EQ(pthread_sigmask(SIG_BLOCK, nullptr, &blocked), 0);
  EXPECT_EQ(sigismember(&blocked, SIGTERM), 0);
  EXPECT_EQ(sigismember(&blocked, SIGINT), 0);
}

}  // namespace
}  // namespace oblique::protocol
