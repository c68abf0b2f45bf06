#include "client/study/point_flags.h"

#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/study/flag_axis.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/point_table.h"
#include "tests/client/study/flags_of.h"
#include "tests/client/study/pretended_fall.h"
#include "tests/support/temporary_folder.h"

namespace oblique::client {
namespace {

std::vector<double> values(const protocol::Axis& axis) {
  std::vector<double> all;
  for (std::uint64_t i = 0; i < protocol::axis_size(axis); ++i) {
    all.push_back(protocol::axis_value(axis, i));
  }
  return all;
}

protocol::Axis axis_of(const std::string& key, const std::string& text,
                       protocol::BlockKind kind = protocol::BlockKind::kProduct) {
  CsvFiles files(".");
  return axis_of_flag(protocol::axis_key(key), text, kind, files);
}

std::string error_of(const PointFlags& flags) {
  try {
    recipe_of_flags(flags, pretended_reach());
  } catch (const solver::InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(PointFlags, TakeOneValueAListOrARange) {
  EXPECT_EQ(values(axis_of("mu", "0.4")), (std::vector{0.4}));
  EXPECT_EQ(values(axis_of("mu", "0.4,0.6,0.8")), (std::vector{0.4, 0.6, 0.8}));
  const auto range = values(axis_of("mu", "0.1:2.0:40"));
  ASSERT_EQ(range.size(), 40U);
  EXPECT_EQ(range.front(), 0.1);
  EXPECT_EQ(range.back(), 2.0);
}

TEST(PointFlags, TakeLogarithmicRangesAndSteps) {
  EXPECT_EQ(values(axis_of("mu", "0.01:1:3:log")), (std::vector{0.01, 0.1, 1.0}));
  EXPECT_EQ(values(axis_of("mu", "0:1:3:linear")), (std::vector{0.0, 0.5, 1.0}));
  EXPECT_EQ(values(axis_of("mu", "0.5:1:step=0.25")), (std::vector{0.5, 0.75, 1.0}));
}

TEST(PointFlags, TakeColumnsOfFiles) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("flags.csv");
  std::ofstream(path) << "mu,drop\n0.4,0.5\n0.6,0.5\n";
  EXPECT_EQ(values(axis_of("mu", "@" + path)), (std::vector{0.4, 0.6}));
  const auto side_by_side = protocol::BlockKind::kZip;
  EXPECT_EQ(values(axis_of("H", "@" + path + ":drop", side_by_side)), (std::vector{0.5, 0.5}));
  const auto message = error_of(flags_of({{"H", "@" + path + ":dorp"}}));
  EXPECT_TRUE(message.starts_with("--H @")) << message;
  EXPECT_NE(message.find("did you mean `drop`"), std::string::npos) << message;
}

TEST(PointFlags, TakeDistributionsInSamplesAndExpressions) {
  auto flags = flags_of({{"H", "0.3:1.1"},
                         {"mu", "normal(0.4,0.05,0,)"},
                         {"k", "log-uniform(1e7,2e7)"},
                         {"I", "A^2/(4*pi)"}});
  flags.sample = "sobol:100000:5";
  flags.where = "mu > 0.5 * e";
  const auto recipe = recipe_of_flags(flags, pretended_reach());
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

TEST(PointFlags, WhosePointsAreSolvedHereAreJudgedByTheirPoints) {
  EXPECT_EQ(points_of_flags(flags_of({{"k", "1e7*mu"}}), pretended_reach()).model(0).k_N_m, 4e6);
  for (const auto& [key, text] :
       {std::pair{"k", "0-mu"}, {"H", "4*mu"}, {"mu", "log(0-H)"}, {"e", "2*mu*H+1"}}) {
    try {
      points_of_flags(flags_of({{key, text}}), pretended_reach());
      ADD_FAILURE() << key;
    } catch (const solver::InputError& error) {
      const std::string start = std::string("--") + key + " " + text + ": point 0: " + key + " = ";
      EXPECT_TRUE(std::string(error.what()).starts_with(start)) << error.what();
    }
  }
}

TEST(PointFlags, TakeAxesSideBySide) {
  auto flags = flags_of({{"H", "0.5,0.6"}, {"mu", "0.4,0.4"}, {"length2", "0.3,0.4"}});
  flags.zip = true;
  const protocol::PointTable table(recipe_of_flags(flags, pretended_reach()));
  EXPECT_EQ(table.size(), 2U);
  EXPECT_EQ(table.model(table.point(0).model).lengths_m[1], 0.3);
}

TEST(PointFlags, SayWhatIsWrongWithASample) {
  for (const auto& [text, says] :
       std::map<std::string, std::string>{{"sobol", "kind:count:seed"},
                                          {"sobol:x", "kind:count:seed"},
                                          {"sobol:1:2:3", "kind:count:seed"},
                                          {"sobl:10", "did you mean `sobol`"},
                                          {"lhs:0", "count = 0"},
                                          {"lhs:10:-1", "seed = -1"}}) {
    auto flags = flags_of({{"H", "0.3:1.1"}});
    flags.sample = text;
    const auto message = error_of(flags);
    EXPECT_NE(message.find(says), std::string::npos) << message;
    EXPECT_TRUE(message.starts_with("--sample " + text + ": ")) << message;
  }
}

TEST(PointFlags, TakeIntegratorsByName) {
  EXPECT_EQ(values(axis_of("integrator", "explicit")), (std::vector{0.0}));
  EXPECT_THROW(axis_of("integrator", "euler"), solver::InputError);
}

TEST(PointFlags, RefuseWhatIsNoValueWithASentence) {
  const struct {
    const char* text;
    const char* says;
  } wrong[] = {
      {"", "a value is missing"},
      {"abc", "\"abc\" is not a number"},
      {"0.4,", "a value is missing"},
      {"0.4x", "\"0.4x\" is not a number"},
      {"0.4 ", "is not a number"},
      {"0.1:2", "from:to:count"},
      {"0.1:2:4:5", "from:to:count:log"},
      {"0:2:4:log", "above 0"},
      {"0:1:step=0.3", "step = 0.3"},
      {"0:1:step=0.5:log", "a step has no spacing"},
      {"1:2:3:4:5", "from:to:count"},
      {"normal(0.4,0.05)", "`sample`"},
      {"normal(0.4)", "normal(MEAN,SD)"},
      {"uniform(1)", "uniform(FROM,TO)"},
      {"@nowhere.csv:a", "nowhere.csv"},
      {"0.1:2:4.5", "count = 4.5"},
      {"0.1:2:x", "count = x"},
      {"0.1:2:0", "count = 0"},
      {"2:1:3", "swap"},
      {":2:3", "a value is missing"},
      {"-0.4", "mu = -0.4"},
      {"nan", "mu = nan"},
      {"inf", "mu = inf"},
      {"0.4,0.4", "twice"},
      {"1:2:99999999999999999999", "count = 99999999999999999999"},
  };
  for (const auto& [text, says] : wrong) {
    const auto message = error_of(flags_of({{"mu", text}}));
    EXPECT_NE(message.find(says), std::string::npos) << '"' << text << "\": " << message;
    EXPECT_TRUE(message.starts_with("--mu " + std::string(text) + ": ")) << message;
  }
}

TEST(PointFlags, ShapeTheModelWithOneValueAndMakeAnAxisOfSeveral) {
  const protocol::PointTable table(
      recipe_of_flags(flags_of({{"tip_mass", "0.01"}, {"k", "1e7,2e7"}}), pretended_reach()));
  EXPECT_EQ(table.size(), 2U);
  EXPECT_EQ(table.models(), 2U);
  EXPECT_EQ(table.model(0).tip_mass_kg, 0.01);
  EXPECT_EQ(table.model(1).k_N_m, 2e7);
}

TEST(PointFlags, OverrideThePreset) {
  auto flags = flags_of({{"k", "1e7"}});
  flags.preset = "printed";
  const protocol::PointTable table(recipe_of_flags(flags, pretended_reach()));
  EXPECT_EQ(table.model(0).k_N_m, 1e7);
  EXPECT_EQ(table.model(0).eta2, solver::preset("printed").eta2);
  flags.preset = "papre";
  EXPECT_NE(error_of(flags).find("papre"), std::string::npos);
}

TEST(PointFlags, TakeLengthsOneALinkButNotBesideLinks) {
  auto flags = flags_of({{"H", "0.5"}});
  flags.lengths = "0.4,0.3";
  EXPECT_EQ(protocol::PointTable(recipe_of_flags(flags, pretended_reach())).model(0).lengths_m,
            (std::vector{0.4, 0.3}));
  flags.lengths = "0.4,-0.3";
  EXPECT_NE(error_of(flags).find("-0.3"), std::string::npos);
  flags.lengths = "0.4,0.3";
  flags.axes["links"] = "2";
  EXPECT_NE(error_of(flags).find("--lengths"), std::string::npos);
}

TEST(PointFlags, SayOnceWhatWasTyped) {
  auto flags = flags_of({});
  flags.where = "mu >";
  EXPECT_TRUE(error_of(flags).starts_with("--where mu >: a value is missing at its end"))
      << error_of(flags);
  flags.where = "f > 1";
  EXPECT_TRUE(error_of(flags).starts_with("--where f > 1: unknown key `f`")) << error_of(flags);
  const auto axis = error_of(flags_of({{"k", "f*2"}}));
  EXPECT_TRUE(axis.starts_with("--k f*2: unknown key `f`")) << axis;
}

TEST(PointFlags, ThatChooseAsInCAreToldHowToChoose) {
  for (const char* text : {"e>0?0.4:0.5", "e?1:2"}) {
    const auto message = error_of(flags_of({{"mu", text}}));
    EXPECT_TRUE(message.starts_with(std::string("--mu ") + text + ": `?` means nothing"))
        << message;
    EXPECT_NE(message.find("if(e > 0.5, 0.4, 0.6)"), std::string::npos) << message;
  }
}

TEST(PointFlags, OfLengthsTakeNumbersAndNameTheFlagsThatTakeMore) {
  auto flags = flags_of({});
  for (const char* text : {"mu,mu,mu", "0.4,x", "0.4,"}) {
    flags.lengths = text;
    const auto message = error_of(flags);
    EXPECT_TRUE(message.starts_with(std::string("--lengths ") + text + ": ")) << message;
    EXPECT_NE(message.find("--length1 mu"), std::string::npos) << message;
    EXPECT_EQ(message.find("expression"), std::string::npos) << message;
  }
}

TEST(PointFlags, NameTheFlagThatIsMissing) {
  auto flags = flags_of({});
  flags.axes.erase("e");
  EXPECT_NE(error_of(flags).find("--e is missing"), std::string::npos);
}

TEST(PointFlags, NameTheLargestDropForAnHThatIsNeverReached) {
  EXPECT_NE(error_of(flags_of({{"H", "1.19"}})).find("1.179"), std::string::npos);
  EXPECT_NE(error_of(flags_of({{"H", "1.3"}})).find("1.2 m"), std::string::npos);
}

}  // namespace
}  // namespace oblique::client
