#include "client/study/study_file.h"

#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "tests/client/study/study_text.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

TEST(StudyFile, MultipliesAxesInsideABlockWithHSlowestAndEFastest) {
  const auto study = parsed("name = 'x'\n[[block]]\ne = [0.5, 1]\nmu = [0.1, 0.2]\nH = [0.9, 1]\n");
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

TEST(StudyFile, TheKeyErrorsRequestsEstimatedErrors) {
  const auto asks = [](const std::string& head) {
    return protocol::PointTable(parsed(head + block_with("mu = 0.4")).recipe).wants_errors();
  };
  EXPECT_TRUE(asks("errors = true\n"));
  EXPECT_FALSE(asks("errors = false\n"));
  EXPECT_FALSE(asks(""));
}

TEST(StudyFile, PutsModelAxesBeforeThePointAxes) {
  const auto study =
      parsed("[[block]]\nH = 1\nmu = [0.1, 0.2]\ne = 1\nk = [1e7, 2e7]\nintegrator = 'explicit'\n");
  const protocol::PointTable table(study.recipe);
  EXPECT_EQ(table.models(), 2U);
  EXPECT_EQ(table.model(table.point(1).model).k_N_m, 1e7);
  EXPECT_EQ(table.model(table.point(2).model).k_N_m, 2e7);
}

TEST(StudyFile, TakesRangesByStepAndByRatio) {
  const protocol::PointTable table(
      parsed("[[block]]\nH = 1\nmu = { from = 0.01, to = 1, count = 3, spacing = 'log' }\n"
             "e = { from = 0.5, to = 1.0, step = 0.05 }\n")
          .recipe);
  ASSERT_EQ(table.size(), 33U);
  EXPECT_EQ(table.point(10).e_star, 1.0);
  EXPECT_EQ(table.point(11).mu, 0.1);
}

TEST(StudyFile, SingleKeysOverrideThePreset) {
  const auto study = parsed("[model]\nk = 1e7\npreset = 'printed'\n" + kPoint);
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
  const auto study = parsed(text + kPoint);
  EXPECT_EQ(protocol::from_message(study.recipe.model()), defaults);
}

TEST(StudyFile, WithoutANameIsNamedAfterTheFile) {
  EXPECT_EQ(parsed(kPoint, "some/where/sweep.toml").name, "sweep");
}

/// Returns the error message of reading a study file, or "accepted".
std::string error_of_file(const std::string& path) {
  try {
    read_study_file(path, fake_reach());
    return "accepted";
  } catch (const solver::InputError& error) {
    return error.what();
  }
}

TEST(StudyFile, AnUnreadableFileIsNamed) {
  const test::TemporaryFolder folder;
  const std::string empty = folder.file("empty.toml");
  { const std::ofstream file(empty); }
  { std::ofstream(folder.file("-x.toml")) << kPoint; }
  EXPECT_EQ(error_of_file("/nowhere/study.toml"), "there is no study file /nowhere/study.toml");
  EXPECT_THAT(error_of_file(folder.file("empty")),
              testing::HasSubstr("did you mean `" + empty + "`?"));
  EXPECT_THAT(error_of_file(empty), testing::StartsWith(empty + ": no [[block]]"));
  EXPECT_THAT(error_of_file(folder.file("-x.toml")), testing::HasSubstr("name = \"-x\""));
}

/// A folder with the CSV file to which study files refer.
class StudyWithCsvFile : public testing::Test {
 protected:
  StudyWithCsvFile() {
    std::ofstream(folder_.file("measured.csv")) << "drop,friction,H\n0.5,0.4,0.7\n0.5,0.6,0.8\n";
  }
  protocol::PointTable table(const std::string& text) const {
    return protocol::PointTable(parsed(text, folder_.file("study.toml")).recipe);
  }
  std::string error(const std::string& text) const {
    try {
      table(text);
    } catch (const solver::InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  const test::TemporaryFolder folder_;
};

TEST_F(StudyWithCsvFile, ACsvColumnBecomesAnAxis) {
  const auto points = table(block_with("mu = { csv = 'measured.csv', column = 'friction' }"));
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points.point(1).mu, 0.6);
  EXPECT_EQ(table("[[block]]\nH = { csv = 'measured.csv' }\nmu = 1\ne = 1\n").point(0).H_m, 0.7)
      << "the default is the column with the name of the key";
}

TEST_F(StudyWithCsvFile, CsvLinesBecomePoints) {
  const auto points = table(
      "[[block]]\ncsv = 'measured.csv'\ncolumns = { H = 'drop', mu = 'friction' }\ne = 0.9\n");
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points.point(0).H_m, 0.5);
  EXPECT_EQ(points.point(1).H_m, 0.5) << "a value may be repeated";
  EXPECT_EQ(points.point(1).mu, 0.6);
  EXPECT_EQ(points.point(1).e_star, 0.9);
}

TEST_F(StudyWithCsvFile, AnErrorNamesThePlaceInStudyAndCsvFile) {
  const auto expect = [&](const std::string& text, const std::vector<std::string>& expected) {
    for (const auto& part : expected) {
      EXPECT_THAT(error(text), testing::HasSubstr(part));
    }
  };
  expect(block_with("mu = { csv = 'measured.csv', column = 'fricton' }"),
         {"study.toml:3:6: ", "no column `fricton` (did you mean `friction`?)"});
  expect("[[block]]\ncsv = 'measured.csv'\nmu = 1\ne = 1\n",
         {"study.toml:2:7: ", "the column `drop` of", "columns = {"});
  expect("[[block]]\ncsv = 'measured.csv'\ncolumns = { H = 'drop' }\nH = 1\nmu = 1\ne = 1\n",
         {"study.toml:3:11: ", "H is given twice"});
  expect("[[block]]\ncsv = 'nowhere.csv'\nmu = 1\ne = 1\n",
         {"study.toml:2:7: the CSV file", "nowhere.csv cannot be read"});
  std::ofstream(folder_.file("measured.csv")) << "mu\n0.5\n-1\n";
  expect(block_with("mu = { csv = 'measured.csv' }"),
         {"study.toml:3:6: ", "measured.csv:3: column `mu`: mu = -1 is not allowed"});
}

TEST(StudyFile, TakesSamplesOfDistributions) {
  const protocol::PointTable table(
      parsed("[[block]]\nsample = { kind = 'sobol', count = 1000000000, seed = 7 }\n"
             "H = { from = 0.3, to = 1 }\n"
             "mu = { distribution = 'normal', mean = 0.4, sd = 0.05, from = 0.39 }\n"
             "k = { distribution = 'log-uniform', from = 1e7, to = 2e7 }\ne = [0.5, 1]\n")
          .recipe);
  ASSERT_EQ(table.size(), 1'000'000'000U);
  for (const std::uint64_t i : {0U, 1U, 999'999'999U}) {
    const auto point = table.point(i);
    EXPECT_THAT(point.H_m, testing::AllOf(testing::Gt(0.3), testing::Lt(1.0)));
    EXPECT_GE(point.mu, 0.39);
    EXPECT_THAT(point.e_star, testing::AnyOf(0.5, 1.0));
    EXPECT_THAT(table.model(point.model).k_N_m, testing::AllOf(testing::Gt(1e7), testing::Lt(2e7)));
  }
}

TEST(StudyFile, TakesExpressionsFiltersAndSingleLengths) {
  protocol::PointTable table(
      parsed("[[block]]\nA = [4e-4, 5e-4]\nI = 'A^2 / (4 * pi)'\nlength2 = [0.3, 0.4]\nH = 0.5\n"
             "mu = [0.4, 0.6]\ne = 1\nwhere = 'mu > 0.5 * e'\n")
          .recipe);
  ASSERT_EQ(table.size(), 8U);
  const auto model = table.model(table.point(7).model);
  EXPECT_DOUBLE_EQ(model.I_m4, 25e-8 / 4.0 / 3.14159265358979312);
  EXPECT_EQ(model.lengths_m, (std::vector{0.4, 0.4, 0.4}));
  EXPECT_EQ(table.model(0).lengths_m, (std::vector{0.4, 0.3, 0.4}));
  EXPECT_FALSE(table.passes_filter(0));
  EXPECT_TRUE(table.passes_filter(1));
  EXPECT_EQ(protocol::size_of(table).points, 4U);
}

TEST(StudyFile, AZeroHasNoSign) {
  const auto minus = parsed(block_with("mu = -0.0"));
  EXPECT_EQ(protocol::recipe_digest(minus.recipe),
            protocol::recipe_digest(parsed(block_with("mu = 0.0")).recipe));
}

TEST(StudyFile, ACountMayBeWrittenWithAPoint) {
  const auto study = parsed(block_with("mu = { from = 0.1, to = 0.5, count = 3.0 }"));
  EXPECT_EQ(protocol::PointTable(study.recipe).size(), 3U);
}

TEST(StudyFile, ADescriptionOfTheLargestRecipeCanBeRead) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("large.toml");
  // A number of up to 27 characters takes 8 bytes in a recipe.
  std::ofstream(file) << block_with("mu = 0.4")
                      << std::string(protocol::kMaxRecipeBytes / 8 * 27, '#') << '\n';
  EXPECT_EQ(protocol::PointTable(read_study_file(file, fake_reach()).recipe).size(), 1U);
}

TEST(ExampleStudies, HaveTheNumberOfPointsInTheirComments) {
  const std::string folder = std::string(OBLIQUE_SOURCE_DIR) + "/deploy/studies/";
  const auto points = [&](const std::string& name) {
    const auto study = read_study_file(folder + name + ".toml", fake_reach());
    EXPECT_EQ(study.name, name);
    const protocol::PointTable table(study.recipe);
    EXPECT_NO_THROW(table.validate_points());
    return protocol::size_of(table).points;
  };
  EXPECT_EQ(points("paper"), 10U);
  EXPECT_EQ(points("uncertainty"), 1024U);
  EXPECT_EQ(points("measured"), 12U);
  EXPECT_EQ(points("sticking"), 615U);
  EXPECT_EQ(points("round-sections"), 30U);
  EXPECT_EQ(points("friction-and-restitution"), 440U);
  EXPECT_EQ(points("mesh"), 6U);
}

TEST(StudyFile, NamesThePlaceOfWrongValuesThatDependOnThePoint) {
  const struct {
    std::string text;
    const char* key;
    const char* expected;
  } wrong[] = {
      {block_with("mu = 'log(-1)'"), "mu", "study.toml:3:6: point 0: mu = nan is not allowed"},
      {block_with("mu = '-1'"), "mu", "study.toml:3:6: point 0: mu = -1 is not allowed"},
      {kPoint + "where = 'mu > 1'\n", "where",
       "study.toml:5:9: where = \"mu > 1\": it leaves out all points"},
      {kPoint + "[[block]]\nH = 1\nmu = [0.4, 0.5]\ne = 1\nI = 'log(-mu)'\n", "I",
       "study.toml:9:5: block 2: point 1: I = nan"},
  };
  for (const auto& [text, key, expected] : wrong) {
    try {
      check_points(parsed(text, "study.toml"));
      ADD_FAILURE() << text;
    } catch (const solver::InputError& error) {
      EXPECT_EQ(error.fields().key, key);
      EXPECT_THAT(error.what(), testing::StartsWith(expected));
    }
  }
  EXPECT_NO_THROW(check_points(parsed(kPoint)));
}

}  // namespace
}  // namespace oblique::client
