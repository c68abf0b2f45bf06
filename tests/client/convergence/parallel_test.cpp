#include "client/convergence/parallel.h"

#include <atomic>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

TEST(ForEachInParallel, CallsTheWorkOnceForEveryIndex) {
  std::vector<std::atomic<int>> calls(100);
  for_each_in_parallel(calls.size(), [&](std::size_t i) { ++calls[i]; });
  for (const auto& count : calls) {
    EXPECT_EQ(count, 1);
  }
}

TEST(ForEachInParallel, ThrowsWhatTheWorkThrowsAndStartsNoMore) {
  std::atomic<int> calls{0};
  EXPECT_THROW(for_each_in_parallel(1'000'000,
                                    [&](std::size_t) {
                                      ++calls;
                                      throw std::runtime_error("no");
                                    }),
               std::runtime_error);
  EXPECT_LT(calls, 1'000'000);
}

TEST(ForEachInParallel, DoesNothingForNothing) {
  for_each_in_parallel(0, [](std::size_t) { FAIL(); });
}

}  // namespace
}  // namespace oblique::client
