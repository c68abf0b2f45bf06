#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

#include "worker/solver/solve.h"

namespace {

std::atomic<std::uint64_t>& allocations() {
  static std::atomic<std::uint64_t> count{0};
  return count;
}

}  // namespace

// Every allocation of this program is counted.
void* operator new(std::size_t bytes) {
  ++allocations();
  if (void* memory = std::malloc(bytes)) {
    return memory;
  }
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace oblique::solver {
namespace {

struct Solved {
  std::int64_t steps;
  std::uint64_t allocations;
};

/// Solves one point in lanes; the fall is solved before.
Solved solve_with_step(double dt_s) {
  ModelParameters model;
  model.dt_s = dt_s;
  const Finger finger(model);
  finger.largest_drop_m();
  std::optional<PointRequest> request = PointRequest{0, 1.0, 0.4, 1.0};
  Solved solved{};
  const std::uint64_t before = allocations();
  finger.solve_points([&] { return std::exchange(request, std::nullopt); },
                      [&](PointOutcome&& outcome) { solved.steps = outcome.result->solver.steps; });
  solved.allocations = allocations() - before;
  return solved;
}

TEST(Allocations, AStepInLanesMakesNone) {
  solve_with_step(1e-6);  // what is made once in a process
  const Solved coarse = solve_with_step(1e-6);
  const Solved fine = solve_with_step(0.25e-6);
  EXPECT_GT(fine.steps, 3 * coarse.steps);
  EXPECT_EQ(fine.allocations, coarse.allocations);
}

/// Allocations of one point that has no answer.
std::uint64_t allocations_of_a_failure(const Finger& finger) {
  std::optional<PointRequest> request = PointRequest{0, 1.0, 0.4, 1.0};
  const std::uint64_t before = allocations();
  finger.solve_points([&] { return std::exchange(request, std::nullopt); },
                      [](PointOutcome&& outcome) { EXPECT_NE(outcome.error, ""); });
  return allocations() - before;
}

TEST(Allocations, AFallThatFailsIsSolvedOnceForAllPoints) {
  ModelParameters model;
  model.integrator = Integrator::kGeneralizedAlpha;
  model.elements_per_link = 1;
  model.dt_fall_s = 0.025;  // some steps on, Newton's method does not converge
  const Finger finger(model);
  const std::uint64_t first = allocations_of_a_failure(finger);
  for (int again = 0; again < 3; ++again) {
    EXPECT_LT(allocations_of_a_failure(finger), first / 4) << "every implicit step makes some";
  }
  EXPECT_THROW(finger.largest_drop_m(), SolveError);
}

}  // namespace
}  // namespace oblique::solver
