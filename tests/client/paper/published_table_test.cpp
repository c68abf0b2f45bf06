#include "client/paper/published_table.h"

#include <string>

#include <gtest/gtest.h>

#include "client/study/study_file.h"
#include "proto/recipe/point_table.h"

namespace oblique::client {
namespace {

TEST(PublishedTable, HoldsTheSixtyThreeTrustworthyNumbers) {
  std::size_t fn = 0;
  std::size_t ft = 0;
  std::size_t phases = 0;
  std::size_t sticks = 0;
  for (const auto& published : published_table().cases) {
    fn += published.fn_kN.size();
    ft += published.ft_kN.size();
    phases += published.phases_ms.size();
    sticks += published.stick_ms ? 1U : 0U;
  }
  EXPECT_EQ(fn, 24U);
  EXPECT_EQ(ft, 24U);
  EXPECT_EQ(phases, 12U);
  EXPECT_EQ(sticks, 3U);
}

TEST(PublishedTable, HasAsManyPeaksAsItsModesSay) {
  for (const auto& published : published_table().cases) {
    EXPECT_EQ(published_peaks(published), published.mu < 1.0 ? 3 : 2);
    if (!published.fn_kN.empty()) {
      EXPECT_EQ(published.fn_kN.size(), static_cast<std::size_t>(published_peaks(published)));
    }
    EXPECT_EQ(published.fn_kN.size(), published.ft_kN.size());
    EXPECT_FALSE(published.read.empty());
  }
}

TEST(PublishedTable, NamesItsMisprintsWithReasons) {
  const auto table = published_table();
  EXPECT_GE(table.misprints.size(), 5U);
  for (const auto& misprint : table.misprints) {
    EXPECT_FALSE(misprint.printed.empty());
    EXPECT_FALSE(misprint.why.empty());
  }
}

TEST(PublishedTable, HasTheCasesOfTheExampleStudyInItsOrder) {
  const auto published = published_table().cases;
  const protocol::PointTable study(
      read_study_file(std::string(OBLIQUE_SOURCE_DIR) + "/deploy/studies/paper.toml",
                      [](const protocol::PointTable&) {})
          .recipe);
  ASSERT_EQ(published.size(), study.size());
  for (std::uint64_t i = 0; i < study.size(); ++i) {
    EXPECT_EQ(published[i].H_m, study.point(i).H_m);
    EXPECT_EQ(published[i].mu, study.point(i).mu);
    EXPECT_EQ(published[i].e_star, study.point(i).e_star);
  }
  EXPECT_EQ(study.model(0), solver::preset("paper"));
}

}  // namespace
}  // namespace oblique::client
