#include "client/commands/study_time.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/study/study_file.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Eight falls that are solved together take 1.6 s; one contact takes 1 ms.
const StudyCost kCost{.threads = 2, .falls_at_once = 8, .falls_s = 1.6, .contact_s = 1e-3};

protocol::StudySize size_of(std::uint64_t points, std::uint64_t falls) {
  return {.points = points,
          .points_estimated = false,
          .models = 1,
          .falls = falls,
          .falls_estimated = false,
          .bytes = 0,
          .examples = {}};
}

protocol::Recipe sample_of(const std::string& axes) {
  return parse_study(
             "[[block]]\nsample = { kind = 'sobol', count = 20000 }\nmu = 0.4\ne = 1\n" + axes,
             "a.toml", [](const protocol::PointTable&) {})
      .recipe;
}

TEST(StudyTime, CountsEachFallOnceAndEachContactDividedByThreads) {
  EXPECT_DOUBLE_EQ(time_s(kCost, size_of(20'000, 16'000)), 1'000 * 1.6 + 20'000 * 1e-3 / 2);
  EXPECT_DOUBLE_EQ(time_s(kCost, size_of(20'000, 17)), 2 * 1.6 + 10)
      << "while one thread solves the last fall, the other one waits";
}

TEST(StudyTime, IfFallsDominateNamesParametersThatShareAFallAndACheaperStudy) {
  const auto recipe = sample_of(
      "H = { from = 0.8, to = 1 }\nE = { from = 6e10, to = 8e10 }\n"
      "k = { distribution = 'log-uniform', from = 1e7, to = 1e8 }\n");
  EXPECT_EQ(time_in_words(kCost, size_of(20'000, 20'000), recipe),
            "about 33 min 30 s on 2 threads: 100 % of it for 20,000 falls.\n"
            "        Points that differ only in H, mu, e, k and eta2 share one fall; E with count "
            "= 16: about 12 s");
}

TEST(StudyTime, NamesSampledFallParametersAndCountsTheValuesOfOthers) {
  const auto recipe = sample_of(
      "H = 1\nE = { from = 6e10, to = 8e10 }\nrho = [2600, 2700]\n"
      "A = { distribution = 'normal', mean = 5e-4, sd = 1e-6, from = 1e-4 }\n");
  EXPECT_THAT(time_in_words(kCost, size_of(20'000, 20'000), recipe),
              HasSubstr("; A, E with count = 8 each: about 23 s"));  // 128 falls
}

TEST(StudyTime, DoesNotMentionFallsIfContactsDominate) {
  const auto recipe = sample_of("H = 1\nE = { from = 6e10, to = 8e10, count = 21 }\n");
  EXPECT_EQ(time_in_words(kCost, size_of(20'000, 21), recipe), "about 13 s on 2 threads");
  EXPECT_EQ(time_in_words(kCost, size_of(1, 1), recipe), "about 1.6 s on 2 threads")
      << "nothing would be cheaper than one fall";
}

TEST(StudyTime, SuggestsNoCountIfNoKeyOfTheFallIsSampled) {
  const auto words = time_in_words(
      kCost, size_of(2'000, 2'000),
      sample_of(
          "H = 1\nE = { from = 6e10, to = 8e10, count = 2000 }\nk = { from = 1e7, to = 1e8 }\n"));
  EXPECT_THAT(words, HasSubstr("share one fall"));
  EXPECT_THAT(words, Not(HasSubstr("with count")));
}

}  // namespace
}  // namespace oblique::client
