#include "worker/solver/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <latch>
#include <stdexcept>
#include <vector>

namespace oblique::solver {
namespace {

TEST(ParallelFor, EachIndexIsPassedOnceOnAnyNumberOfThreads) {
  for (const std::size_t threads : {0U, 1U, 3U, 50U}) {
    std::vector<std::atomic<int>> calls(20);
    parallel_for(calls.size(), threads, [&](std::size_t i) { ++calls.at(i); });
    for (const auto& count : calls) {
      EXPECT_EQ(count, 1);
    }
  }
}

TEST(ParallelFor, TasksRunAtTheSameTime) {
  std::latch all_begun(3);
  parallel_for(3, 3, [&](std::size_t) { all_begun.arrive_and_wait(); });
}

TEST(ParallelFor, TheFirstExceptionIsRethrownAndNoFurtherTaskBegins) {
  std::atomic<int> begun = 0;
  std::latch both_begun(2);
  EXPECT_THROW(parallel_for(1000, 2,
                            [&](std::size_t i) {
                              ++begun;
                              if (i < 2) {
                                both_begun.arrive_and_wait();
                                throw std::runtime_error("for the test");
                              }
                            }),
               std::runtime_error);
  EXPECT_EQ(begun, 2);
}

}  // namespace
}  // namespace oblique::solver
