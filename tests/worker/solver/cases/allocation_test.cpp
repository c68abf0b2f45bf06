#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

#include "worker/solver/chain/chain.h"
#include "worker/solver/motion/generalized_alpha.h"
#include "worker/solver/motion/motion.h"
#include "worker/solver/solve.h"

namespace {

std::atomic<std::uint64_t>& allocations() {
  static constinit std::atomic<std::uint64_t> count{0};
  return count;
}

}  // namespace

// Every allocation of this program is counted: those of the C library, from which Eigen and
// operator new take their memory, or, where a sanitizer keeps books of its own, those of operator
// new alone.
#if defined(__has_feature)
#define OBLIQUE_HAS_FEATURE(feature) __has_feature(feature)
#else
#define OBLIQUE_HAS_FEATURE(feature) 0
#endif
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    !OBLIQUE_HAS_FEATURE(address_sanitizer) && !OBLIQUE_HAS_FEATURE(thread_sanitizer)
extern "C" void* __libc_malloc(std::size_t bytes);  // NOLINT
extern "C" void* malloc(std::size_t bytes) {
  ++allocations();
  return __libc_malloc(bytes);
}
#define OBLIQUE_COUNTS_MALLOC
#else
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
#endif

namespace oblique::solver {
namespace {

struct Solved {
  std::int64_t steps;
  std::uint64_t allocations;
};

/// Solves one point in lanes; the fall is solved before.
Solved solve_with_step(double dt_s) {
  ModelParameters model = preset("paper");
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

#ifdef OBLIQUE_COUNTS_MALLOC
TEST(Allocations, ThoseOfEigenAreCounted) {
  const std::uint64_t before = allocations();
  const Eigen::VectorXd vector = Eigen::VectorXd::Zero(1000);
  EXPECT_EQ(vector.sum(), 0.0);
  EXPECT_GT(allocations(), before);
}
#endif

/// Allocations of steps of `h_s` without contact and of those under a contact force, after the
/// first, which makes room. Events are not among them.
void expect_no_allocations(const Motion& motion, double h_s) {
  ChainState state = motion.at_rest();
  ChainState next;
  Eigen::Matrix2Xd reactions_N;
  const AffineContactForce<double> spring{0.0, 0.0, 2.7e7, 0.0, 2.1e7, motion.tip(state).x_m, 0.0};
  for (const auto& force : {AffineContactForce<double>{}, spring}) {
    motion.restart(force, state);
    std::uint64_t before = 0;
    for (int i = 0; i < 20; ++i) {
      if (i == 2) {
        before = allocations();  // both states have their room
      }
      motion.step(state, force, h_s, next);
      std::swap(state, next);
    }
    EXPECT_EQ(allocations(), before);
  }
  motion.reactions(spring, state, reactions_N);
  EXPECT_EQ(reactions_N.cols(), 3);
}

TEST(Allocations, AnExplicitStepMakesNone) {
  const Chain chain(preset("paper"));
  expect_no_allocations(ExplicitMotion(chain), 1e-6);
}

TEST(Allocations, AStepOfGeneralizedAlphaMakesNoneNorDoesRestarting) {
  const GeneralizedAlphaMotion motion(preset("paper"));
  expect_no_allocations(motion, 1e-6);
  ChainState state = motion.at_rest();
  ChainState next;
  Eigen::Matrix2Xd reactions_N;
  std::uint64_t before = 0;
  for (int i = 0; i < 20; ++i) {
    if (i == 2) {
      before = allocations();
    }
    motion.restart({}, state);
    motion.step(state, {}, 1e-6, next);
    motion.reactions({}, next, reactions_N);
    std::swap(state, next);
  }
  EXPECT_EQ(allocations(), before);
}

/// Allocations of a whole contact by generalized-alpha with steps of dt_s; the fall is solved
/// before.
TEST(Allocations, AContactByGeneralizedAlphaMakesAsManyHoweverManyStepsItTakes) {
  const auto solve = [](double dt_s) {
    ModelParameters model = preset("paper");
    model.elements_per_link = 1;
    model.integrator = Integrator::kGeneralizedAlpha;
    model.dt_s = dt_s;
    model.dt_fall_s = 1e-4;
    const Finger finger(model);
    finger.largest_drop_m();
    const std::uint64_t before = allocations();
    const CaseResult result = finger.solve(1.0, 0.4, 1.0);
    return Solved{result.solver.steps, allocations() - before};
  };
  solve(1e-6);
  const Solved coarse = solve(1e-6);
  const Solved fine = solve(0.25e-6);
  EXPECT_GT(fine.steps, 3 * coarse.steps);
  EXPECT_EQ(fine.allocations, coarse.allocations);
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
  ModelParameters model = preset("paper");
  model.integrator = Integrator::kGeneralizedAlpha;
  model.elements_per_link = 1;
  model.dt_fall_s = 0.025;  // some steps on, Newton's method does not converge
  const Finger finger(model);
  const std::uint64_t first = allocations_of_a_failure(finger);
  for (int again = 0; again < 3; ++again) {
    EXPECT_LT(allocations_of_a_failure(finger), first / 4) << "the fall is not begun again";
  }
  EXPECT_THROW(finger.largest_drop_m(), SolveError);
}

}  // namespace
}  // namespace oblique::solver
