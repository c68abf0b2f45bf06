#include "proto/recipe/canonical.h"

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

using testing::EndsWith;
using testing::StartsWith;

const std::vector<Axis> kPoint{listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})};

/// A block of one point but for mu.
Recipe recipe_of_mu(const Axis& mu) {
  return recipe_of({{listed("H", {1.0}), mu, listed("e", {1.0})}});
}

/// The text of that block's axis of mu.
std::string text_of_mu(const Axis& mu) {
  const std::string text = canonical_recipe(recipe_of_mu(mu));
  const auto from = text.find(" mu=") + 4;
  return text.substr(from, text.find(" e=1\n") - from);
}

// These texts stand in databases and names of studies. One that has to change needs another version
// in its first word, and another schema.
TEST(Canonical, TheTextOfAModelIsTheSameForEver) {
  EXPECT_EQ(canonical_model(solver::preset("paper")),
            "oblique-model-1 lengths=0.4,0.4,0.4 E=7e+10 A=0.0005309 I=2.243e-08 rho=2700 g=9.81 "
            "elements_per_link=4 k=2.7e+07 eta2=1.2463 tip_mass=0 integrator=explicit "
            "spectral_radius=0.9 dt=0 dt_fall=0");
  EXPECT_EQ(canonical_model(unusual_model()),
            "oblique-model-1 lengths=0.5,0.25 E=1e+09 A=0.0002 I=3e-08 rho=1000 g=1.62 "
            "elements_per_link=7 k=5e+06 eta2=1.5 tip_mass=0.125 integrator=generalized-alpha "
            "spectral_radius=0.5 dt=1e-06 dt_fall=2e-06 tolerance=1e-06");
}

TEST(Canonical, TheTextAndDigestOfARecipeAreTheSameForEver) {
  Recipe recipe = recipe_of(
      {{listed("H", {0.96, 1.0, 1.05}), range("mu", 0.0, 1.0 / 3.0, 40), listed("e", {1.0, 0.6})},
       {listed("k", {1e7, 2e7}), listed("integrator", {0, 1}), listed("H", {1.0}),
        listed("mu", {0.1 + 0.2}), range("e", 0.5, 1.0, 6)}});
  *recipe.mutable_model() = to_message(solver::preset("printed"));
  EXPECT_EQ(canonical_recipe(recipe),
            "oblique-recipe-1\n"
            "model lengths=0.4,0.4,0.4 E=7e+10 A=0.0005 I=2e-08 rho=2700 g=9.81 "
            "elements_per_link=4 k=2.5e+07 eta2=1.21 tip_mass=0 integrator=explicit "
            "spectral_radius=0.9 dt=0 dt_fall=0\n"
            "block H=0.96,1,1.05 mu=0:0.3333333333333333:40 e=1,0.6\n"
            "block k=1e+07,2e+07 integrator=explicit,generalized-alpha H=1 "
            "mu=0.30000000000000004 e=0.5:1:6\n");
  EXPECT_EQ(hexadecimal(recipe_digest(recipe)),
            "528af31385daa41de546895a4e73f2510b8dcf70ca0008f74e2f4d14818be8b8");
  EXPECT_EQ(hexadecimal(recipe_digest(recipe_of({kPoint}))),
            "078f885505efaf4635dbaa137a21fde2a38c6e7c1189af1683f91fadf4ba61bb");
}

TEST(Canonical, ErrorsAreNamedOnlyWhereTheyAreAskedForAndBeforeTheBlocks) {
  Recipe recipe = recipe_of({kPoint});
  const std::string without = canonical_recipe(recipe);
  recipe.set_errors(true);
  const std::string with = canonical_recipe(recipe);
  const auto blocks = without.find("block ");
  EXPECT_EQ(with, without.substr(0, blocks) + "errors\n" + without.substr(blocks));
  EXPECT_NE(recipe_digest(recipe), recipe_digest(recipe_of({kPoint})));
  *recipe.add_blocks() = recipe.blocks(0);
  EXPECT_THAT(canonical_recipe(recipe), StartsWith(with)) << "a study that grows";
}

TEST(Canonical, AModelComesBackFromItsText) {
  std::vector<solver::ModelParameters> models{unusual_model()};
  for (const auto name : solver::preset_names()) {
    models.push_back(solver::preset(name));
  }
  solver::ModelParameters extreme = solver::preset("paper");
  extreme.lengths_m.assign(64, 0.1);
  extreme.E_Pa = std::numeric_limits<double>::max();
  extreme.A_m2 = std::numeric_limits<double>::denorm_min();
  extreme.eta2 = std::nextafter(1.0, 2.0);
  models.push_back(extreme);
  for (const auto& model : models) {
    EXPECT_EQ(model_of_canonical(canonical_model(model)), model);
  }
}

TEST(Canonical, ATextThatIsNotThatOfAModelIsRefused) {
  const std::string good = canonical_model(solver::preset("paper"));
  for (const std::string& text :
       {std::string(), std::string("oblique-model-1"), good + " ", good + " k=1", "x" + good,
        good.substr(0, good.size() - 1), good + "e0", good + " wobble=1", good + " links=1e300",
        std::string(good).replace(good.find("=4 "), 3, "=1e300 "),
        std::string(good).replace(good.find("rho=2700"), 8, "rho=2700.0"),
        std::string(good).replace(good.find("explicit"), 8, "euler"),
        std::string(good).replace(good.find("-1"), 2, "-2")}) {
    EXPECT_THROW(model_of_canonical(text), solver::InputError) << text;
  }
}

TEST(Canonical, TheToleranceIsWrittenOnlyWhereItIsNotAtItsDefault) {
  solver::ModelParameters model = solver::preset("paper");
  model.tolerance = 1e-6;
  EXPECT_EQ(canonical_model(model), canonical_model(solver::preset("paper")) + " tolerance=1e-06");
  EXPECT_THROW(model_of_canonical(canonical_model(solver::preset("paper")) + " tolerance=1e-05"),
               solver::InputError);
}

TEST(Canonical, AKeyThatComesLaterChangesNoTextWhereItIsAtItsDefault) {
  std::vector<solver::ParameterKey> keys(solver::model_keys().begin(), solver::model_keys().end());
  // As a key of the future does: a field that has a default.
  const auto future = [](std::string_view name) {
    return solver::ParameterKey{name,
                                "",
                                "",
                                "",
                                [](double) { return true; },
                                [](const solver::ModelParameters& m) { return m.tip_mass_kg; },
                                nullptr};
  };
  keys.insert(keys.begin(), future("zeal"));
  keys.push_back(future("damping"));
  EXPECT_EQ(canonical_model(solver::preset("paper"), keys),
            canonical_model(solver::preset("paper")));
  solver::ModelParameters damped = solver::preset("paper");
  damped.tip_mass_kg = 0.5;
  EXPECT_EQ(canonical_model(damped, keys), canonical_model(damped) + " damping=0.5 zeal=0.5");
}

TEST(Canonical, AnAxisCountsByItsValuesAndNotByHowTheyWereWritten) {
  EXPECT_EQ(text_of_mu(range("mu", 0.1, 2.0, 20)), "0.1:2:20");
  std::vector<double> values;
  for (std::uint64_t i = 0; i < 20; ++i) {
    values.push_back(axis_value(range("mu", 0.1, 2.0, 20), i));
  }
  EXPECT_EQ(text_of_mu(listed("mu", values)), "0.1:2:20");
  values[7] = std::nextafter(values[7], 2.0);
  EXPECT_THAT(text_of_mu(listed("mu", values)), StartsWith("0.1,0.2,"));
  EXPECT_EQ(text_of_mu(range("mu", 0.1, 0.2, 2)), "0.1,0.2");
  EXPECT_EQ(text_of_mu(listed("mu", {0.1, 0.2})), "0.1,0.2");
  EXPECT_EQ(text_of_mu(range("mu", 0.4, 0.4, 1)), "0.4");
  EXPECT_EQ(text_of_mu(listed("mu", {0.6, 0.4, 0.2})), "0.6,0.4,0.2") << "the order counts";
}

TEST(Canonical, ZeroHasNoSign) {
  EXPECT_EQ(text_of_mu(listed("mu", {-0.0, 1.0})), "0,1");
  EXPECT_EQ(text_of_mu(range("mu", -0.0, 1.0, 5)), "0:1:5");
  EXPECT_EQ(text_of_mu(listed("mu", {-0.0, 0.25, 0.5})), "0:0.5:3");
  solver::ModelParameters model = solver::preset("paper");
  model.dt_s = -0.0;
  EXPECT_EQ(canonical_model(model), canonical_model(solver::preset("paper")));
}

TEST(Canonical, FieldsThatAnotherProgramSetsToTheirDefaultsOrAddsChangeNothing) {
  Recipe recipe = recipe_of({kPoint});
  const std::string text = canonical_recipe(recipe);
  auto& axis = *recipe.mutable_blocks(0)->mutable_axes(1);
  axis.set_from(3.0);  // nobody looks at it: the axis is listed
  EXPECT_EQ(canonical_recipe(recipe), text);
  Recipe padded;
  // A field that nobody knows.
  ASSERT_TRUE(padded.ParseFromString(recipe_of({kPoint}).SerializeAsString() +
                                     std::string("\x98\x06\x01", 3)));
  EXPECT_EQ(canonical_recipe(padded), text);
}

TEST(Canonical, TheTextOfAStudyThatGrewBeginsWithThatOfTheShorterOne) {
  const Recipe shorter = recipe_of({kPoint});
  const Recipe longer =
      recipe_of({kPoint, {range("H", 0.5, 1.0, 9), listed("mu", {0.1}), listed("e", {1.0})}});
  EXPECT_THAT(canonical_recipe(longer), StartsWith(canonical_recipe(shorter)));
  EXPECT_THAT(canonical_recipe(shorter), EndsWith("\n"));
}

TEST(Canonical, HowBlocksAreCutAndAxesOrderedCounts) {
  const std::string whole = canonical_recipe(recipe_of_mu(listed("mu", {0.1, 0.2})));
  EXPECT_NE(
      canonical_recipe(recipe_of({{listed("H", {1.0}), listed("mu", {0.1}), listed("e", {1.0})},
                                  {listed("H", {1.0}), listed("mu", {0.2}), listed("e", {1.0})}})),
      whole);
  const auto of_axes = [](const Axis& first, const Axis& second) {
    std::vector<Axis> axes{first, second};
    axes.insert(axes.end(), kPoint.begin(), kPoint.end());
    return canonical_recipe(recipe_of({axes}));
  };
  EXPECT_NE(of_axes(listed("k", {1e7, 2e7}), listed("eta2", {1.0, 2.0})),
            of_axes(listed("eta2", {1.0, 2.0}), listed("k", {1e7, 2e7})));
}

/// All points of a study with their models, as one text.
std::string all_points(const Recipe& recipe) {
  const PointTable table(recipe);
  std::string text;
  for (std::uint64_t i = 0; i < table.size(); ++i) {
    const Point point = table.point(i);
    const double values[]{point.H_m, point.mu, point.e_star};
    text += canonical_model(table.model(point.model));
    text.append(reinterpret_cast<const char*>(values), sizeof values);
  }
  return text;
}

TEST(Canonical, RecipesOfOneTextHaveTheSamePointsAndOthersAreToldApart) {
  std::mt19937 random(7);
  const auto pick = [&](std::size_t n) { return random() % n; };
  const std::vector<Axis> axes_of_mu{
      listed("mu", {0.25}),           listed("mu", {0.25, 0.5}),  listed("mu", {0.5, 0.25}),
      range("mu", 0.25, 0.5, 2),      range("mu", 0.25, 0.75, 3), listed("mu", {0.25, 0.5, 0.75}),
      listed("mu", {0.25, 0.75, 0.5})};
  const std::vector<Axis> axes_of_k{listed("k", {1e7}), listed("k", {1e7, 2e7}),
                                    range("k", 1e7, 2e7, 2)};
  std::map<std::string, std::string> points_by_text;
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<std::vector<Axis>> blocks(1 + pick(2));
    for (auto& block : blocks) {
      if (pick(2) == 0) {
        block.push_back(axes_of_k[pick(axes_of_k.size())]);
      }
      block.insert(block.end(),
                   {listed("H", {1.0}), axes_of_mu[pick(axes_of_mu.size())],
                    listed("e", pick(2) == 0 ? std::vector{1.0} : std::vector{0.5, 1.0})});
    }
    const Recipe recipe = recipe_of(blocks);
    const std::string points = all_points(recipe);
    const auto [entry, is_new] = points_by_text.emplace(canonical_recipe(recipe), points);
    EXPECT_EQ(entry->second, points) << entry->first;
  }
  EXPECT_GT(points_by_text.size(), 100U);
  EXPECT_LT(points_by_text.size(), 500U) << "some were written in two ways";
}

TEST(Canonical, ALongTextHasTheDigestOfTheWhole) {
  Axis mu = listed("mu", {});
  for (int i = 0; i < 5000; ++i) {
    mu.add_values(0.1 + 1e-7 * i * i);
  }
  const std::string text = canonical_recipe(recipe_of_mu(mu));
  ASSERT_GT(text.size(), 10'000U);
  Sha256 sum;
  sum.add(text);
  EXPECT_EQ(recipe_digest(recipe_of_mu(mu)), sum.digest());
}

// ---- Kinds of blocks --------------------------------------------------------------------------

std::string blocks_text(const Recipe& recipe) {
  const std::string text = canonical_recipe(recipe);
  return text.substr(text.find("block"));
}

TEST(Canonical, TheTextHoldsEveryKindOfBlock) {
  Axis normal = uniform("mu", 0.0, 1.0);
  normal.mutable_distribution()->set_kind(DISTRIBUTION_NORMAL);
  normal.mutable_distribution()->clear_to();
  normal.mutable_distribution()->set_mean(0.4);
  normal.mutable_distribution()->set_sd(0.05);
  Axis logarithmic = uniform("e", 0.5, 1.0);
  logarithmic.mutable_distribution()->set_kind(DISTRIBUTION_LOG_UNIFORM);
  Block sample = sampled({uniform("H", 0.3, 1.1), normal, logarithmic}, SAMPLE_SOBOL, 100'000, 7);
  sample.set_where(" mu > 0.5 * e");
  const Recipe recipe = recipe_of_blocks(
      {zipped({following("I", "A^2 / (4 * pi)"), listed("length1", {0.3, 0.3}),
               listed("H", {0.3, 0.2}), log_range("mu", 0.01, 2.0, 2), listed("e", {0.9})}),
       sample,
       filtered({listed("H", {0.5}), log_range("mu", 0.01, 2.0, 50), listed("e", {1.0})}, "")});
  EXPECT_EQ(
      blocks_text(recipe),
      "block zip I=(A^2/(4*pi)) length1=0.3,0.3 H=0.3,0.2 mu=0.01,2 e=0.9\n"
      "block sample=sobol:100000:7 H=uniform(0.3,1.1) mu=normal(0.4,0.05,0,) e=log-uniform(0.5,1) "
      "where=(mu>0.5*e)\n"
      "block H=0.5 mu=0.01:2:50:log e=1\n");
}

TEST(Canonical, ListedValuesOfALogarithmicRangeAreThatRange) {
  const Axis written = log_range("mu", 0.01, 2.0, 50);
  std::vector<double> values;
  for (std::uint64_t i = 0; i < 50; ++i) {
    values.push_back(axis_value(written, i));
  }
  const auto with = [](const Axis& mu) {
    return recipe_of({{listed("H", {0.5}), mu, listed("e", {1.0})}});
  };
  EXPECT_EQ(canonical_recipe(with(listed("mu", values))), canonical_recipe(with(written)));
}

}  // namespace
}  // namespace oblique::protocol
