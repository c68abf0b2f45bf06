#include "client/study/point_flags.h"

#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "tests/client/study/fake_reach.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using protocol::BlockKind;
using testing::HasSubstr;
using testing::StartsWith;

/// Returns the flags of one point; `axes` replaces or adds axes.
PointFlags flags_of(const std::map<std::string, std::string>& axes) {
  PointFlags flags;
  flags.axes = {{"H", "1"}, {"mu", "0.4"}, {"e", "1"}};
  for (const auto& [key, text] : axes) {
    flags.axes[key] = text;
  }
  return flags;
}

protocol::PointTable table_of(const PointFlags& flags) {
  return protocol::PointTable(recipe_of_flags(flags, fake_reach()));
}

std::string error_of(const PointFlags& flags) {
  try {
    points_of_flags(flags, fake_reach());
  } catch (const solver::InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::vector<double> values(const std::string& key, const std::string& text,
                           BlockKind kind = BlockKind::kProduct) {
  CsvFiles files(".");
  const auto axis = axis_of_flag(protocol::axis_key(key), text, kind, files);
  std::vector<double> all;
  for (std::uint64_t i = 0; i < protocol::axis_size(axis); ++i) {
    all.push_back(protocol::axis_value(axis, i));
  }
  return all;
}

TEST(PointFlags, TakeValuesListsAndRanges) {
  EXPECT_EQ(values("mu", "0.4"), (std::vector{0.4}));
  EXPECT_EQ(values("mu", "0.4,0.6,0.8"), (std::vector{0.4, 0.6, 0.8}));
  EXPECT_EQ(values("mu", "0.1:2.0:40").size(), 40U);
  EXPECT_EQ(values("mu", "0.01:1:3:log"), (std::vector{0.01, 0.1, 1.0}));
  EXPECT_EQ(values("mu", "0:1:3:linear"), (std::vector{0.0, 0.5, 1.0}));
  EXPECT_EQ(values("mu", "0.5:1:step=0.25"), (std::vector{0.5, 0.75, 1.0}));
  EXPECT_EQ(values("integrator", "explicit"), (std::vector{0.0}));
}

TEST(PointFlags, MayHaveSpacesAfterSeparators) {
  EXPECT_EQ(values("mu", "0.1, 0.2,  1e-3"), (std::vector{0.1, 0.2, 1e-3}));
  EXPECT_EQ(values("mu", "0: 1: 3"), (std::vector{0.0, 0.5, 1.0}));
  EXPECT_EQ(values("integrator", "explicit, generalized-alpha"), (std::vector{0.0, 1.0}));
}

TEST(PointFlags, AZeroHasNoSign) {
  const auto digest = [](const std::string& mu) {
    return protocol::recipe_digest(
        recipe_of_flags(flags_of({{"H", "1"}, {"mu", mu}, {"e", "1"}}), fake_reach()));
  };
  EXPECT_EQ(digest("-0.0"), digest("0"));
  EXPECT_EQ(digest("-0:1:3"), digest("0:1:3"));
  EXPECT_EQ(digest("0.5,-0.0"), digest("0.5,0"));
}

TEST(PointFlags, TakeColumnsOfFiles) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("flags.csv");
  std::ofstream(path) << "mu,drop\n0.4,0.5\n0.6,0.5\n";
  EXPECT_EQ(values("mu", "@" + path), (std::vector{0.4, 0.6}));
  EXPECT_EQ(values("H", "@" + path + ":drop", BlockKind::kZip), (std::vector{0.5, 0.5}));
  const auto message = error_of(flags_of({{"H", "@" + path + ":dorp"}}));
  EXPECT_THAT(message, StartsWith("--H @"));
  EXPECT_THAT(message, HasSubstr("did you mean `drop`"));
}

TEST(PointFlags, TakeDistributionsInSamplesAndExpressions) {
  auto flags = flags_of({{"H", "0.3:1.1"},
                         {"mu", "normal(0.4,0.05,0,)"},
                         {"k", "log-uniform(1e7,2e7)"},
                         {"I", "A^2/(4*pi)"}});
  flags.sample = "sobol:100000:5";
  flags.where = "mu > 0.5 * e";
  const auto recipe = recipe_of_flags(flags, fake_reach());
  const auto& block = recipe.blocks(0);
  EXPECT_EQ(block.sample().kind(), protocol::SAMPLE_SOBOL);
  EXPECT_EQ(block.sample().count(), 100'000U);
  EXPECT_EQ(block.sample().seed(), 5U);
  EXPECT_EQ(block.where(), "mu > 0.5 * e");
  EXPECT_EQ(block.axes(0).expression(), "A^2/(4*pi)");
  EXPECT_EQ(block.axes(1).distribution().kind(), protocol::DISTRIBUTION_LOG_UNIFORM);
  EXPECT_EQ(block.axes(3).distribution().mean(), 0.4);
  EXPECT_TRUE(block.axes(3).distribution().has_from());
  EXPECT_FALSE(block.axes(3).distribution().has_to());
}

TEST(PointFlags, ZipPairsTheValuesOfAxes) {
  auto flags = flags_of({{"H", "0.5,0.6"}, {"mu", "0.4,0.4"}, {"length2", "0.3,0.4"}});
  flags.zip = true;
  const auto table = table_of(flags);
  EXPECT_EQ(table.size(), 2U);
  EXPECT_EQ(table.model(table.point(0).model).lengths_m[1], 0.3);
}

TEST(PointFlags, SetAModelParameterByOneValueAndAnAxisBySeveral) {
  auto flags = flags_of({{"tip_mass", "0.01"}, {"k", "1e7,2e7"}, {"H", "0.5"}});
  flags.preset = "printed";
  flags.lengths = "0.4,0.3";
  const auto table = table_of(flags);
  EXPECT_EQ(table.size(), 2U);
  EXPECT_EQ(table.models(), 2U);
  EXPECT_EQ(table.model(0).tip_mass_kg, 0.01);
  EXPECT_EQ(table.model(1).k_N_m, 2e7);
  EXPECT_EQ(table.model(0).eta2, solver::preset("printed").eta2);
  EXPECT_EQ(table.model(0).lengths_m, (std::vector{0.4, 0.3}));
}

TEST(PointFlags, RefuseWrongValuesWithTheFlagAsItWasTyped) {
  const struct {
    const char* key;
    const char* text;
    const char* expected;
  } wrong[] = {
      {"mu", "", "a value is missing"},
      {"mu", "abc", "\"abc\" is not a number"},
      {"mu", "0.4,", "a value is missing"},
      {"mu", "0.4 ", "is not a number"},
      {"mu", "1e-400", "it is too small or too large"},
      {"mu", "0.2,1e-400", "it is too small or too large"},
      {"mu", "0.1:1e400:3", "is not a number: it is too small or too large"},
      {"mu", "0.4\u00a0", "\"0.4\\xa0\" is not a number"},
      {"mu", "0.1:0.5:3.0", "count must be a whole number without a point"},
      {"mu", "0.1 0.2", "\"0.1 0.2\" is not a number"},
      {"mu", "0.1:2", "from:to:count"},
      {"mu", "0.1:2:4:5", "from:to:count:log"},
      {"mu", "0:2:4:log", "must be > 0"},
      {"mu", "0:1:step=0.3", "step = 0.3"},
      {"mu", "0:1:step=0.5:log", "count = step=0.5"},
      {"mu", "1:2:3:4:5", "from:to:count"},
      {"mu", "normal(0.4,0.05)", "`sample`"},
      {"mu", "normal(0.4)", "normal(MEAN,SD)"},
      {"mu", "uniform(1)", "uniform(FROM,TO)"},
      {"mu", "@nowhere.csv:a", "nowhere.csv"},
      {"mu", "0.1:2:4.5", "count = 4.5"},
      {"mu", "0.1:2:0", "count = 0"},
      {"mu", "2:1:3", "swap"},
      {"mu", ":2:3", "a value is missing"},
      {"mu", "-0.4", "mu = -0.4"},
      {"mu", "nan", "mu = nan"},
      {"mu", "0.4,0.4", "twice"},
      {"mu", "e>0?0.4:0.5", "write if(e > 0.5, 0.4, 0.6)"},
      {"integrator", "euler", "integrator must be explicit"},
      {"k", "f*2", "unknown key `f`"},
      {"k", "0-mu", "point 0: k = -0.4 N/m is not allowed"},
      {"mu", "log(0-H)", "point 0: mu = nan is not allowed"},
      {"H", "1.3", "the length of the chain, 1.2 m"},
      {"H", "1.19", "1.179156 m"},
  };
  for (const auto& [key, text, expected] : wrong) {
    const auto message = error_of(flags_of({{key, text}}));
    EXPECT_THAT(message, StartsWith(flag_of_key(key) + " " + text + ": "));
    EXPECT_THAT(message, HasSubstr(expected));
  }
}

TEST(PointFlags, AWrongSampleOrFilterIsRefusedAndItsFlagIsNamed) {
  const struct {
    std::string PointFlags::*flag;
    const char* text;
    const char* expected;
  } wrong[] = {
      {&PointFlags::sample, "sobol", "--sample sobol: this is not a sample: write kind:count:seed"},
      {&PointFlags::sample, "sobol:x", "--sample sobol:x: this is not a sample"},
      {&PointFlags::sample, "sobol:1:2:3", "--sample sobol:1:2:3: this is not a sample"},
      {&PointFlags::sample, "lhs:10:-1", "--sample lhs:10:-1: sample: seed = -1"},
      {&PointFlags::sample, "sobl:10", "--sample sobl:10: unknown sample \"sobl\" (did"},
      {&PointFlags::where, "mu >", "--where mu >: a value is missing at its end"},
      {&PointFlags::where, "f > 1", "--where f > 1: unknown key `f`"},
      {&PointFlags::where, "mu > 1", "--where mu > 1: it leaves out all points"},
      {&PointFlags::preset, "papre", "--preset papre: preset = \"papre\" is not allowed"},
      {&PointFlags::lengths, "0.4,-0.3", "--lengths 0.4,-0.3: lengths = -0.3 m is not allowed"},
      {&PointFlags::lengths, "mu,mu", "--lengths mu,mu: \"mu\" is not a number; write the length"},
  };
  for (const auto& [flag, text, expected] : wrong) {
    auto flags = flags_of({{"H", "0.5:0.6:2"}});
    flags.*flag = text;
    EXPECT_THAT(error_of(flags), StartsWith(expected));
  }
  auto flags = flags_of({{"links", "2"}});
  flags.lengths = "0.4,0.3";
  EXPECT_THAT(error_of(flags), StartsWith("--lengths 0.4,0.3: "));
  flags = flags_of({});
  flags.axes.erase("e");
  EXPECT_THAT(error_of(flags), StartsWith("--e is missing: give --H, --mu and --e (e: "));
  flags = flags_of({{"mu", "nromal(0.4,0.05)"}});
  flags.sample = "lhs:9";
  EXPECT_THAT(error_of(flags), HasSubstr("did you mean `normal`?"));
}

TEST(StudyFlags, GiveEqualPointsTheSameStudyNameAndOtherPointsAnother) {
  const auto name = [](const PointFlags& flags) {
    return name_of_recipe(recipe_of_flags(flags, fake_reach()));
  };
  EXPECT_EQ(name(flags_of({})), name(flags_of({})));
  EXPECT_NE(name(flags_of({})), name(flags_of({{"mu", "0.5"}})));
  auto on_paper = flags_of({});
  on_paper.preset = "paper";
  EXPECT_EQ(name(on_paper), "sweep-8344f39b") << "the name of a study must never change";
}

TEST(StudyFlags, TakeAFileOrPointsAndNotBoth) {
  const std::string paper = std::string(OBLIQUE_SOURCE_DIR) + "/deploy/studies/paper.toml";
  const auto study = [](const StudyFlags& flags) { return study_of_flags(flags, fake_reach()); };
  EXPECT_THROW(study({}), solver::InputError);
  StudyFlags flags;
  flags.points = flags_of({});
  EXPECT_THAT(study(flags).name, StartsWith("sweep-"));
  flags.name = "mine";
  EXPECT_EQ(study(flags).name, "mine");
  flags.file = paper;
  EXPECT_THROW(study(flags), solver::InputError);
  flags.points = {};
  EXPECT_EQ(study(flags).name, "mine");
  flags.name.clear();
  EXPECT_EQ(study(flags).name, "paper");
  flags.name = "two\nlines";
  EXPECT_THROW(study(flags), solver::InputError);
}

TEST(StudyFlags, RequestEstimatedErrorsForFlagsAndForFiles) {
  StudyFlags flags;
  flags.points = flags_of({});
  const auto without = study_of_flags(flags, fake_reach());
  flags.errors = true;
  const auto with = study_of_flags(flags, fake_reach());
  EXPECT_FALSE(without.recipe.errors());
  EXPECT_TRUE(with.recipe.errors());
  EXPECT_NE(with.name, without.name) << "a study with errors is a different study";
  flags.points = {};
  flags.file = std::string(OBLIQUE_SOURCE_DIR) + "/deploy/studies/paper.toml";
  EXPECT_TRUE(study_of_flags(flags, fake_reach()).recipe.errors());
}

}  // namespace
}  // namespace oblique::client
