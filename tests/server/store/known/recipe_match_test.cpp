#include "server/store/known/recipe_match.h"

#include <map>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/canonical.h"
#include "proto/recipe/model_message.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::range;
using protocol::recipe_of;
using testing::ElementsAre;
using testing::IsEmpty;

const std::atomic<bool> kStillWanted = false;
constexpr std::uint64_t kPlenty = 100'000'000;

std::vector<SharedRun> runs_of(const protocol::Recipe& target, const protocol::Recipe& source,
                               std::uint64_t most_work = kPlenty) {
  const protocol::PointTable wanted(target);
  const protocol::PointTable from(source);
  Work work(most_work, kStillWanted);
  std::vector<SharedRun> runs;
  match_recipes(wanted, IntervalSet(0, wanted.size()), from, IntervalSet(0, from.size()), work,
                [&](const SharedRun& run) { runs.push_back(run); });
  return runs;
}

std::map<std::uint64_t, std::uint64_t> pairs_of(const std::vector<SharedRun>& runs) {
  std::map<std::uint64_t, std::uint64_t> pairs;
  for (const SharedRun& run : runs) {
    for (std::uint64_t i = 0; i < run.count; ++i) {
      pairs.emplace(run.point + i, run.source_point + i);
    }
  }
  return pairs;
}

/// By comparing every point with every other. Of several the lowest.
std::map<std::uint64_t, std::uint64_t> all_pairs(const protocol::Recipe& target,
                                                 const protocol::Recipe& source) {
  const protocol::PointTable wanted(target);
  const protocol::PointTable from(source);
  std::map<std::tuple<std::string, double, double, double>, std::uint64_t> known;
  const auto key = [](const protocol::PointTable& table, std::uint64_t i) {
    const auto at = table.point(i);
    return std::tuple(protocol::canonical_model(table.model(at.model)), at.H_m, at.mu, at.e_star);
  };
  for (std::uint64_t i = 0; i < from.size(); ++i) {
    known.emplace(key(from, i), i);
  }
  std::map<std::uint64_t, std::uint64_t> pairs;
  for (std::uint64_t i = 0; i < wanted.size(); ++i) {
    if (const auto found = known.find(key(wanted, i)); found != known.end()) {
      pairs.emplace(i, found->second);
    }
  }
  return pairs;
}

void expect_all_found(const protocol::Recipe& target, const protocol::Recipe& source) {
  const auto expected = all_pairs(target, source);
  EXPECT_FALSE(expected.empty()) << "the test is of something";
  EXPECT_EQ(pairs_of(runs_of(target, source)), expected);
}

TEST(RecipeMatch, TheSameGridIsOneRunOfAnySize) {
  const auto grid = recipe_of(
      {{range("H", 0.1, 1.1, 10'000), range("mu", 0.0, 1.0, 10'000), range("e", 0.1, 1.0, 1000)}});
  EXPECT_THAT(runs_of(grid, grid), ElementsAre(SharedRun{0, 0, 100'000'000'000}));
}

TEST(RecipeMatch, GridsThatOverlapInPartShareTheValuesThatTheirAxesShare) {
  expect_all_found(
      recipe_of({{range("H", 0.5, 1.0, 6), range("mu", 0.0, 1.0, 11), range("e", 0.5, 1.0, 6)}}),
      recipe_of({{listed("H", {0.7, 0.75, 1.0}), range("mu", 0.5, 1.5, 11),
                  listed("e", {1.0, 0.6, 0.5})}}));
  expect_all_found(
      recipe_of({{listed("H", {1.0}), range("mu", 0.0, 1.0, 11), listed("e", {0.5})}}),
      recipe_of({{listed("H", {0.9, 1.0}), range("mu", 0.0, 2.0, 21), listed("e", {0.25, 0.5})}}));
}

TEST(RecipeMatch, AFewPointsAreFoundInsideAMillion) {
  const auto million = recipe_of(
      {{range("H", 0.01, 1.0, 100), range("mu", 0.0, 0.99, 100), range("e", 0.01, 1.0, 100)}});
  const auto few =
      recipe_of({{listed("H", {0.5}), listed("mu", {0.25, 0.5}), listed("e", {0.75, 0.8})},
                 {listed("H", {0.503}), listed("mu", {0.25}), listed("e", {0.75})}});
  EXPECT_EQ(pairs_of(runs_of(few, million)).size(), 4U);
  EXPECT_EQ(pairs_of(runs_of(million, few)).size(), 4U);
}

TEST(RecipeMatch, BlocksAreComparedEachWithEach) {
  expect_all_found(
      recipe_of({{listed("H", {1.0}), range("mu", 0.0, 1.0, 5), listed("e", {0.5})},
                 {listed("H", {0.5}), range("mu", 0.0, 1.0, 5), listed("e", {0.5, 1.0})}}),
      recipe_of({{listed("H", {0.5}), listed("mu", {0.25}), listed("e", {0.5, 1.0})},
                 {listed("H", {0.5, 1.0}), listed("mu", {0.75}), listed("e", {0.5})}}));
}

TEST(RecipeMatch, ModelsAreComparedByWhatTheyAreWhereverTheyStand) {
  const std::vector<protocol::Axis> point{listed("H", {0.9, 1.0}), listed("mu", {0.4}),
                                          listed("e", {1.0, 0.5})};
  const auto with = [&](std::vector<protocol::Axis> axes) {
    axes.insert(axes.end(), point.begin(), point.end());
    return recipe_of({axes});
  };
  auto of_base = with({});
  solver::ModelParameters model = solver::preset("paper");
  model.k_N_m = 2e7;
  *of_base.mutable_model() = protocol::to_message(model);
  const auto of_axis = with({range("k", 1e7, 3e7, 3)});
  const auto of_two = with({listed("k", {3e7, 2e7}), listed("eta2", {1.2463, 1.5})});
  const auto of_lengths = with({listed("length", {0.4, 0.5}), listed("k", {2e7})});
  for (const auto& target : {of_base, of_axis, of_two, of_lengths}) {
    for (const auto& source : {of_base, of_axis, of_two, of_lengths}) {
      expect_all_found(target, source);
    }
  }
  EXPECT_THAT(runs_of(with({}), of_axis), IsEmpty());
}

TEST(RecipeMatch, SamplesAndPointsSideBySideAreLookedUpInGridsAndInEachOther) {
  auto zip = recipe_of({{listed("H", {0.5, 0.7, 0.9}), listed("mu", {0.2, 0.4, 0.6}),
                         listed("e", {0.5, 0.5, 1.0})}});
  zip.mutable_blocks(0)->set_zip(true);
  auto other_zip =
      recipe_of({{listed("H", {0.9, 0.5}), listed("mu", {0.6, 0.2}), listed("e", {1.0, 0.5})}});
  other_zip.mutable_blocks(0)->set_zip(true);
  const auto grid =
      recipe_of({{range("H", 0.5, 1.0, 6), range("mu", 0.0, 1.0, 11), listed("e", {0.5, 1.0})}});
  expect_all_found(zip, grid);
  expect_all_found(grid, zip);
  expect_all_found(zip, other_zip);
  expect_all_found(other_zip, zip);
  auto sample = recipe_of({{listed("H", {1.0}), range("mu", 0.0, 1.0, 2), listed("e", {0.5})}});
  auto& block = *sample.mutable_blocks(0);
  block.mutable_sample()->set_kind(protocol::SAMPLE_SOBOL);
  block.mutable_sample()->set_count(64);
  auto& mu = *block.mutable_axes(1);
  mu.Clear();
  mu.set_key("mu");
  mu.mutable_distribution()->set_from(0.0);
  mu.mutable_distribution()->set_to(1.0);
  auto longer = sample;
  longer.mutable_blocks(0)->mutable_sample()->set_count(1'000'000'000);
  EXPECT_THAT(runs_of(sample, longer), ElementsAre(SharedRun{0, 0, 64}));
  EXPECT_THAT(runs_of(longer, sample), ElementsAre(SharedRun{0, 0, 64}));
}

TEST(RecipeMatch, EachOfEqualPointsIsFoundWhicheverSideHasMore) {
  const auto zip = [](std::vector<double> H) {
    return protocol::recipe_of_blocks(
        {protocol::zipped({listed("H", H), listed("mu", {0.5}), listed("e", {0.9})})});
  };
  const auto few = zip({0.5, 0.9, 0.5});
  const auto many = zip({0.5, 0.5, 0.9, 0.7, 0.7, 0.9, 0.5, 0.6});
  const auto others = zip({0.5, 0.9, 0.7, 0.8, 0.65, 0.55, 0.45, 0.35, 0.9, 0.25});
  expect_all_found(few, many);
  expect_all_found(many, few);
  expect_all_found(many, others);
  expect_all_found(others, many);
}

TEST(RecipeMatch, EqualPointsOfSamplesOfListedValuesAreFoundInEachOther) {
  const auto sample = [](std::uint64_t count, std::uint64_t seed) {
    return protocol::recipe_of_blocks({protocol::sampled(
        {listed("H", {0.9, 0.5}), listed("mu", {0.5, 0.7, 0.9}), listed("e", {0.9})},
        protocol::SAMPLE_RANDOM, count, seed)});
  };
  const auto points = [](const protocol::Recipe& target, const protocol::Recipe& source) {
    EXPECT_EQ(pairs_of(runs_of(target, source)).size(), all_pairs(target, source).size());
  };
  points(sample(16, 2), sample(40, 1));
  points(sample(40, 1), sample(16, 2));
  points(sample(40, 1), sample(16, 1));
  points(sample(16, 1), sample(40, 1));
}

TEST(RecipeMatch, OnlyOpenPointsAreWantedAndOnlyKnownOnesGiven) {
  const auto recipe =
      recipe_of({{listed("H", {1.0}), range("mu", 0.0, 1.0, 100), listed("e", {1.0})}});
  const protocol::PointTable table(recipe);
  Work work(kPlenty, kStillWanted);
  IntervalSet open(10, 50);
  open.erase(20, 25);
  IntervalSet known(0, 30);
  known.insert(45);
  std::vector<SharedRun> runs;
  match_recipes(table, open, table, known, work,
                [&](const SharedRun& run) { runs.push_back(run); });
  EXPECT_THAT(runs, ElementsAre(SharedRun{10, 10, 10}, SharedRun{25, 25, 5}, SharedRun{45, 45, 1}));
}

TEST(RecipeMatch, EstimatedErrorsAreWantedByBothOrByNeither) {
  const auto plain = recipe_of({{listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})}});
  auto with_errors = plain;
  with_errors.set_errors(true);
  EXPECT_THAT(runs_of(plain, with_errors), IsEmpty());
  EXPECT_THAT(runs_of(with_errors, plain), IsEmpty());
  EXPECT_EQ(runs_of(with_errors, with_errors).size(), 1U);
}

TEST(RecipeMatch, WhatWouldTakeTooLongIsLeft) {
  std::vector<double> every_other;
  for (int i = 0; i < 2000; ++i) {
    every_other.push_back(i * 0.002);
  }
  const auto target = recipe_of(
      {{range("H", 0.1, 1.0, 10), range("mu", 0.0, 3.999, 4000), range("e", 0.1, 1.0, 10)}});
  const auto source =
      recipe_of({{range("H", 0.1, 1.0, 10), listed("mu", every_other), range("e", 0.1, 1.0, 10)}});
  const auto all = pairs_of(runs_of(target, source)).size();
  const auto some = pairs_of(runs_of(target, source, 20'000)).size();
  EXPECT_LT(some, all);
}

}  // namespace
}  // namespace oblique::server
