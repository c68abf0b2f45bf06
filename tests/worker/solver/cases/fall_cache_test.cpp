#include "worker/solver/fall_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <latch>
#include <limits>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/worker/solver/cases/shared_fingers.h"
#include "worker/solver/falls.h"
#include "worker/solver/fast/kernels.h"

namespace oblique::solver {
namespace {

ModelParameters model_with_E(double E_Pa) {
  ModelParameters model = coarse_model();
  model.E_Pa = E_Pa;
  return model;
}

std::vector<ModelParameters> models_with_E(std::size_t count) {
  std::vector<ModelParameters> models;
  for (std::size_t i = 0; i < count; ++i) {
    models.push_back(model_with_E(5e10 + 1e9 * static_cast<double>(i)));
  }
  return models;
}

/// Returns a model whose fall fails: Newton's method does not converge after some steps.
ModelParameters model_that_fails() {
  ModelParameters model = coarse_model();
  model.integrator = Integrator::kGeneralizedAlpha;
  model.dt_fall_s = 0.025;
  return model;
}

/// A cache that records which falls are solved together.
struct CountedFalls {
  explicit CountedFalls(std::size_t most_bytes = std::size_t{1} << 30)
      : cache(most_bytes, [this](std::span<const ModelParameters> models) {
          const std::lock_guard lock(mutex);
          solved.emplace_back(models.begin(), models.end());
          return solve_falls(models);
        }) {}

  std::mutex mutex;
  std::vector<std::vector<ModelParameters>> solved;
  FallCache cache;
};

/// Returns the memory of `falls` falls of coarse_model(), plus half a fall.
std::size_t bytes_of(std::size_t falls) {
  static const std::size_t bytes =
      solve_falls(std::vector{coarse_model()}).front().fallen->fall().bytes();
  return falls * bytes + bytes / 2;
}

std::size_t lanes() {
  return runnable_lane_kernels().front().lanes;
}

TEST(FallCacheTest, ModelsThatDifferInContactOnlyShareOneFall) {
  CountedFalls falls;
  ModelParameters other = coarse_model();
  other.k_N_m = 1e7;
  other.eta2 = 2.0;
  EXPECT_FALSE(falls.cache.kept_fall(other));
  const auto fallen = falls.cache.fall(coarse_model()).fallen;
  EXPECT_EQ(falls.cache.fall(other).fallen, fallen);
  ASSERT_TRUE(falls.cache.kept_fall(other));
  EXPECT_EQ(falls.cache.kept_fall(other)->fallen, fallen);
  EXPECT_EQ(falls.solved.size(), 1U);
}

TEST(FallCacheTest, AFailingFallIsSolvedOnceForAllModelsThatShareIt) {
  CountedFalls falls;
  ModelParameters model = model_that_fails();
  const std::string error = falls.cache.fall(model).error;
  EXPECT_NE(error, "");
  for (const double k_N_m : {1e7, 2e7, 3e7}) {
    model.k_N_m = k_N_m;
    EXPECT_EQ(falls.cache.fall(model).error, error);
  }
  EXPECT_EQ(falls.solved.size(), 1U);
}

TEST(FallCacheTest, ErrorsAreRemovedTooWhenTheirMemoryIsUsedUp) {
  CountedFalls falls(std::size_t{1} << 20);
  ModelParameters model = model_that_fails();
  falls.cache.fall(model);
  model.dt_fall_s *= 0.9;
  falls.cache.fall(model);
  EXPECT_TRUE(falls.cache.kept_fall(model));
  EXPECT_FALSE(falls.cache.kept_fall(model_that_fails()));
}

TEST(FallCacheTest, AnInvalidModelFailsWithoutSolvingAFall) {
  CountedFalls falls;
  const ModelParameters nothing = model_with_E(std::numeric_limits<double>::quiet_NaN());
  for (int again = 0; again < 2; ++again) {
    EXPECT_NE(falls.cache.fall(model_with_E(-1.0)).error.find("E = -1"), std::string::npos);
    EXPECT_NE(falls.cache.fall(nothing).error.find("E = nan"), std::string::npos);
  }
  EXPECT_TRUE(falls.solved.empty());
  const std::vector<ModelParameters> ahead{nothing, model_with_E(-1.0), model_with_E(6e10)};
  falls.cache.fall(coarse_model(), ahead);
  ASSERT_EQ(falls.solved.size(), 1U);
  ASSERT_EQ(falls.solved[0].size(), 2U);
  EXPECT_EQ(falls.solved[0][1], ahead.back());
}

TEST(FallCacheTest, MissingFallsAreSolvedTogetherWithTheRequestedOneUntilLanesAreFull) {
  CountedFalls falls;
  const auto models = models_with_E(lanes() + 3);
  falls.cache.fall(models[2]);
  falls.cache.fall(models[0], models);
  ASSERT_EQ(falls.solved.size(), 2U);
  ASSERT_EQ(falls.solved[1].size(), lanes());
  EXPECT_EQ(falls.solved[1][0], models[0]);
  EXPECT_EQ(falls.solved[1][1], models[1]);
  EXPECT_EQ(falls.solved[1][2], models[3]) << "the model between was cached";
  falls.cache.fall(models[1], models);
  EXPECT_EQ(falls.solved.size(), 2U) << "a cached fall solves no others ahead";
  EXPECT_FALSE(falls.cache.kept_fall(models.back()));
}

TEST(FallCacheTest, FallsOfOtherShapesOrIntegratorsAreNotSolvedTogether) {
  CountedFalls falls;
  std::vector<ModelParameters> ahead(5, coarse_model());
  ahead[0].elements_per_link = 2;
  ahead[1].lengths_m = {0.4, 0.4};
  ahead[2].integrator = Integrator::kGeneralizedAlpha;
  ahead[3].dt_fall_s = 1e-5;
  ahead[4].E_Pa = 6e10;
  falls.cache.fall(coarse_model(), ahead);
  ASSERT_EQ(falls.solved.size(), 1U);
  ASSERT_EQ(falls.solved[0].size(), 3U);
  EXPECT_EQ(falls.solved[0][1], ahead[3]) << "lanes may have different steps";
  EXPECT_EQ(falls.solved[0][2], ahead[4]);
  falls.cache.fall(model_that_fails(), ahead);
  EXPECT_EQ(falls.solved.back().size(), 1U) << "generalized-alpha has no lanes";
}

TEST(FallCacheTest, ThreadsThatNeedOneFallWaitForTheThreadThatSolvesIt) {
  CountedFalls falls;
  std::vector<std::shared_ptr<const FallenChain>> got(4);
  {
    std::vector<std::jthread> threads;
    for (auto& fallen : got) {
      threads.emplace_back([&] { fallen = falls.cache.fall(coarse_model()).fallen; });
    }
  }
  EXPECT_EQ(falls.solved.size(), 1U);
  for (const auto& fallen : got) {
    EXPECT_TRUE(fallen);
    EXPECT_EQ(fallen, got[0]);
  }
}

TEST(FallCacheTest, WhileAnotherThreadSolvesAFallThisThreadSolvesTheNextFalls) {
  const auto models = models_with_E(3);
  std::latch first_is_under_way(1);
  std::latch next_are_solved(1);
  FallCache cache(std::size_t{1} << 30, [&](std::span<const ModelParameters> requested) {
    if (requested.front() == models[0]) {
      first_is_under_way.count_down();
      next_are_solved.wait();
    } else {
      EXPECT_EQ(requested.size(), 2U);
      next_are_solved.count_down();
    }
    return solve_falls(requested);
  });
  const std::jthread first([&] { cache.fall(models[0]); });
  first_is_under_way.wait();
  EXPECT_TRUE(cache.fall(models[0], models).fallen);
  EXPECT_TRUE(cache.kept_fall(models[1]));
  EXPECT_TRUE(cache.kept_fall(models[2]));
}

TEST(FallCacheTest, TheLeastRecentlyUsedFallIsRemoved) {
  CountedFalls falls(bytes_of(2));
  const auto models = models_with_E(3);
  const auto second = falls.cache.fall(models[1]).fallen;
  falls.cache.fall(models[0]);
  falls.cache.fall(models[1]);
  falls.cache.fall(models[2]);
  EXPECT_TRUE(falls.cache.kept_fall(models[1]));
  EXPECT_FALSE(falls.cache.kept_fall(models[0]));
  falls.cache.fall(models[0]);
  EXPECT_EQ(falls.solved.size(), 4U);
  EXPECT_GT(second->fall().largest_drop_m(), 0.0) << "a fall in use stays valid";
}

TEST(FallCacheTest, MemoryIsBoundedExceptForTheFallInUse) {
  const auto models = models_with_E(4);
  CountedFalls falls(bytes_of(2));
  for (const auto& model : models) {
    falls.cache.fall(model);
  }
  EXPECT_FALSE(falls.cache.kept_fall(models[0]));
  EXPECT_FALSE(falls.cache.kept_fall(models[1]));
  EXPECT_TRUE(falls.cache.kept_fall(models[2]));
  CountedFalls none(0);
  EXPECT_TRUE(none.cache.fall(models[0], models).fallen);
  EXPECT_TRUE(none.cache.kept_fall(models[0]));
  EXPECT_EQ(none.solved.front().size(), 1U) << "no falls ahead without memory for them";
}

TEST(FallCacheTest, FallsSolvedAheadStayUntilTheyAreUsed) {
  CountedFalls falls(bytes_of(4));
  const auto models = models_with_E(6);
  falls.cache.fall(models[0], std::span(models).subspan(1, 1));
  for (std::size_t i = 2; i < models.size(); ++i) {
    falls.cache.fall(models[i]);
  }
  EXPECT_TRUE(falls.cache.kept_fall(models[1]));
  EXPECT_FALSE(falls.cache.kept_fall(models[0]));
}

}  // namespace
}  // namespace oblique::solver
