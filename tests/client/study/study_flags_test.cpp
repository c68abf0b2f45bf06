#include "client/study/study_flags.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/client/study/flags_of.h"
#include "tests/client/study/pretended_fall.h"

namespace oblique::client {
namespace {

TEST(StudyFlags, NameTheSameStudyForTheSamePointsAndAnotherForOthers) {
  const auto a = name_of_recipe(recipe_of_flags(flags_of({}), pretended_reach()));
  EXPECT_EQ(a, name_of_recipe(recipe_of_flags(flags_of({}), pretended_reach())));
  PointFlags on_paper = flags_of({});
  on_paper.preset = "paper";
  EXPECT_EQ(name_of_recipe(recipe_of_flags(on_paper, pretended_reach())), "sweep-8344f39b")
      << "the name stays for ever";
  EXPECT_NE(a, name_of_recipe(recipe_of_flags(flags_of({{"mu", "0.5"}}), pretended_reach())));
}

TEST(StudyFlags, WantAFileOrPointsAndNotBoth) {
  StudyFlags flags;
  EXPECT_THROW(study_of_flags(flags, pretended_reach()), solver::InputError);
  flags.points = flags_of({});
  EXPECT_TRUE(study_of_flags(flags, pretended_reach()).name.starts_with("sweep-"));
  flags.name = "mine";
  EXPECT_EQ(study_of_flags(flags, pretended_reach()).name, "mine");
  flags.file = std::string(OBLIQUE_SOURCE_DIR) + "/deploy/studies/paper.toml";
  EXPECT_THROW(study_of_flags(flags, pretended_reach()), solver::InputError);
  flags.points = {};
  EXPECT_EQ(study_of_flags(flags, pretended_reach()).name, "mine");
  flags.name.clear();
  EXPECT_EQ(study_of_flags(flags, pretended_reach()).name, "paper");
  flags.name = "two\nlines";
  EXPECT_THROW(study_of_flags(flags, pretended_reach()), solver::InputError);
}

TEST(StudyFlags, AskForErrorsOfPointsAndOfFiles) {
  StudyFlags flags;
  flags.points = flags_of({});
  const auto without = study_of_flags(flags, pretended_reach());
  flags.errors = true;
  const auto with = study_of_flags(flags, pretended_reach());
  EXPECT_FALSE(without.recipe.errors());
  EXPECT_TRUE(with.recipe.errors());
  EXPECT_NE(with.name, without.name) << "another study";
  flags.points = {};
  flags.file = std::string(OBLIQUE_SOURCE_DIR) + "/deploy/studies/paper.toml";
  EXPECT_TRUE(study_of_flags(flags, pretended_reach()).recipe.errors());
}

TEST(StudyFlags, LeaveWhatOnlyPointsTellToWhoeverHasThemSolved) {
  StudyFlags flags;
  flags.points = flags_of({{"k", "0-mu"}});
  const auto study = study_of_flags(flags, pretended_reach());
  try {
    judge_points(study);
    FAIL();
  } catch (const solver::InputError& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with("--k 0-mu: point 0: k = -0.4 N/m is not"))
        << error.what();
  }
}

}  // namespace
}  // namespace oblique::client
