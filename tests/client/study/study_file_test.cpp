#include "client/study/study_file.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "tests/client/study/study_text.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

TEST(StudyFile, MultipliesAxesInsideABlockWithHSlowestAndEFastest) {
  const auto study =
      parsed("name = 'x'\n[[block]]\ne = [0.5, 1]\nmu = [0.1, 0.2]\nH = [0.9, 1]\n", "x.toml");
  const protocol::PointTable table(study.recipe);
  ASSERT_EQ(table.size(), 8U);
  const auto second = table.point(1);
  EXPECT_EQ(second.H_m, 0.9);
  EXPECT_EQ(second.mu, 0.1);
  EXPECT_EQ(second.e_star, 1.0);
  const auto third = table.point(2);
  EXPECT_EQ(third.mu, 0.2);
  EXPECT_EQ(third.e_star, 0.5);
  EXPECT_EQ(table.point(4).H_m, 1.0);
}

TEST(StudyFile, AsksForErrorsWhenItSaysSo) {
  const auto asks = [](const std::string& head) {
    return protocol::PointTable(parsed(head + block_with("mu = 0.4"), "x").recipe).wants_errors();
  };
  EXPECT_TRUE(asks("errors = true\n"));
  EXPECT_FALSE(asks("errors = false\n"));
  EXPECT_FALSE(asks(""));
}

TEST(StudyFile, PutsModelAxesBeforeThePointAxes) {
  const auto study = parsed(
      "[[block]]\nH = 1\nmu = [0.1, 0.2]\ne = 1\nk = [1e7, 2e7]\nintegrator = 'explicit'\n", "x");
  const protocol::PointTable table(study.recipe);
  EXPECT_EQ(table.models(), 2U);
  EXPECT_EQ(table.model(table.point(1).model).k_N_m, 1e7);
  EXPECT_EQ(table.model(table.point(2).model).k_N_m, 2e7);
}

TEST(StudyFile, StepsLeadToTheEndOfTheRangeExactly) {
  const auto study = parsed(block_with("e = { from = 0.5, to = 1.0, step = 0.05 }"), "x");
  const protocol::PointTable table(study.recipe);
  ASSERT_EQ(table.size(), 11U);
  EXPECT_EQ(table.point(0).e_star, 0.5);
  EXPECT_EQ(table.point(10).e_star, 1.0);
  EXPECT_NEAR(table.point(3).e_star, 0.65, 1e-15);
}

TEST(StudyFile, TakesTheSmallestRestitutionThatCanBeSolved) {
  EXPECT_EQ(protocol::PointTable(parsed(block_with("e = 0.001"), "x").recipe).size(), 1U);
}

TEST(StudyFile, ARangeOfOneValueIsThatValue) {
  const auto study = parsed(block_with("mu = { from = 0.3, to = 0.3, step = 0.1 }"), "x");
  const protocol::PointTable table(study.recipe);
  ASSERT_EQ(table.size(), 1U);
  EXPECT_EQ(table.point(0).mu, 0.3);
}

TEST(StudyFile, SingleKeysOverrideThePreset) {
  const auto study = parsed("[model]\nk = 1e7\npreset = 'printed'\n" + std::string(kPoint), "x");
  const auto model = protocol::from_message(study.recipe.model());
  EXPECT_EQ(model.k_N_m, 1e7);
  EXPECT_EQ(model.A_m2, solver::preset("printed").A_m2);
}

TEST(StudyFile, TakesEveryModelKeyWithItsOwnDefault) {
  std::string text = "[model]\n";
  const solver::ModelParameters defaults;
  for (const auto& key : solver::model_keys()) {
    text += std::string(key.name) + " = ";
    text += key.name == "integrator"
                ? '"' + std::string(solver::integrator_name(defaults.integrator)) + '"'
                : solver::exact_number(key.get(defaults));
    text += "\n";
  }
  const auto study = parsed(text + kPoint, "x");
  EXPECT_EQ(protocol::from_message(study.recipe.model()), defaults);
}

TEST(StudyFile, TakesLengthsOneALink) {
  const auto study = parsed("[model]\nlengths = [0.5, 0.3]\n" + block_with("H = 0.5"), "x");
  EXPECT_EQ(protocol::from_message(study.recipe.model()).lengths_m,
            (std::vector<double>{0.5, 0.3}));
}

TEST(StudyFile, WithoutANameIsCalledAsTheFile) {
  EXPECT_EQ(parsed(kPoint, "some/where/sweep.toml").name, "sweep");
}

TEST(StudyFile, WhoseOwnNameIsNoneForAStudySaysSo) {
  try {
    parsed(kPoint, "-x.toml");
    FAIL();
  } catch (const solver::InputError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(testing::StartsWith("-x.toml: "),
                                             testing::HasSubstr("name = \"-x\"")));
  }
}

TEST(StudyFile, ThatIsNotThereIsAnErrorWithItsName) {
  try {
    read_study_file("/nowhere/study.toml", pretended_reach());
    FAIL();
  } catch (const solver::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/study.toml"), std::string::npos);
  }
}

TEST(StudyFile, ThatIsEmptyHasNoBlock) {
  const auto file = std::filesystem::path(testing::TempDir()) / "empty-study.toml";
  { const std::ofstream empty(file); }
  EXPECT_THROW(
      {
        try {
          read_study_file(file, pretended_reach());
        } catch (const solver::InputError& error) {
          EXPECT_NE(std::string(error.what()).find("no [[block]]"), std::string::npos);
          throw;
        }
      },
      solver::InputError);
  std::filesystem::remove(file);
}

TEST(ExampleStudies, HaveThePointsThatTheirCommentsPromise) {
  const std::string folder = std::string(OBLIQUE_SOURCE_DIR) + "/deploy/studies/";
  const auto points = [&](const std::string& name) {
    const auto study = read_study_file(folder + name + ".toml", pretended_reach());
    EXPECT_EQ(study.name, name);
    return protocol::PointTable(study.recipe).size();
  };
  EXPECT_EQ(points("paper"), 10U);
  EXPECT_EQ(points("friction-and-restitution"), 440U);
  EXPECT_EQ(points("mesh"), 6U);
}

}  // namespace
}  // namespace oblique::client
