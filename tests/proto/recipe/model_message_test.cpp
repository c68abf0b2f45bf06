#include "proto/recipe/model_message.h"

#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proto/frames.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

const std::vector<Axis> kPoint{listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})};

TEST(ModelMessageTest, AModelOutsideItsDomainIsRefusedAndCanBeReadUnjudged) {
  EXPECT_THROW(from_message(ModelParameters{}), solver::InputError);
  ModelParameters message = to_message(unusual_model());
  message.set_spectral_radius(1.0);
  EXPECT_THROW(from_message(message), solver::InputError);
  EXPECT_EQ(unjudged_from_message(message).spectral_radius, 1.0);
  message = to_message(unusual_model());
  message.set_elements_per_link(4'000'000'000U);
  EXPECT_THROW(unjudged_from_message(message), solver::InputError) << "no model could hold it";
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

TEST(Canonical, AModelComesBackFromItsTextAndFromAFrame) {
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
    ModelParameters message;
    ASSERT_TRUE(decode(encode(to_message(model)), message));
    EXPECT_EQ(from_message(message), model);
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

TEST(Canonical, ZeroHasNoSignAndADefaultToleranceIsNotWritten) {
  solver::ModelParameters model = solver::preset("paper");
  const std::string text = canonical_model(model);
  model.dt_s = -0.0;
  EXPECT_EQ(canonical_model(model), text);
  model.tolerance = 1e-6;
  EXPECT_EQ(canonical_model(model), text + " tolerance=1e-06");
  EXPECT_THROW(model_of_canonical(text + " tolerance=1e-05"), solver::InputError);
}

TEST(Canonical, TheDigestOfARecipeNamesStudies) {
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad")
      << "of FIPS 180-4";
  EXPECT_EQ(recipe_digest(recipe_of({kPoint})),
            "8344f39bccb110503a4c571f76d91034e47923dc20725c348e2c03a11a402663");
}

TEST(Canonical, ModelErrorsBlocksAndTheOrderOfAxesCount) {
  const auto k = listed("k", {1e7, 2e7});
  const auto eta2 = listed("eta2", {1.0, 2.0});
  const auto with = [](std::vector<Axis> axes) {
    axes.insert(axes.end(), kPoint.begin(), kPoint.end());
    return axes;
  };
  Recipe on_another_mesh = recipe_of({kPoint});
  on_another_mesh.mutable_model()->set_elements_per_link(8);
  Recipe with_errors = recipe_of({kPoint});
  with_errors.set_errors(true);
  std::set<std::string> digests;
  for (const Recipe& recipe :
       {recipe_of({kPoint}), recipe_of({kPoint, kPoint}), on_another_mesh, with_errors,
        recipe_of({with({k, eta2})}), recipe_of({with({eta2, k})}), recipe_of({with({k})}),
        recipe_of_blocks({filtered(kPoint, "mu > 0.1")}), recipe_of_blocks({zipped(kPoint)}),
        recipe_of_blocks({sampled(kPoint, SAMPLE_SOBOL, 8)}),
        recipe_of_blocks({sampled(kPoint, SAMPLE_SOBOL, 9)})}) {
    EXPECT_TRUE(digests.insert(recipe_digest(recipe)).second) << recipe.DebugString();
  }
}

TEST(Canonical, OnlyARangeOfOneOrTwoValuesIsTheSameAsItsList) {
  const auto of = [](const Axis& mu) {
    return filtered({listed("H", {1.0}), mu, listed("e", {1.0})}, "");
  };
  EXPECT_TRUE(is_same_block(of(range("mu", 0.4, 0.4, 1)), of(listed("mu", {0.4}))));
  EXPECT_TRUE(is_same_block(of(log_range("mu", 0.1, 0.4, 2)), of(listed("mu", {0.1, 0.4}))));
  EXPECT_FALSE(is_same_block(of(range("mu", 0.1, 0.4, 2)), of(listed("mu", {0.4, 0.1}))));
  EXPECT_FALSE(is_same_block(of(range("mu", 0.1, 0.3, 3)), of(listed("mu", {0.1, 0.2, 0.3}))));
}

TEST(Canonical, WhatIsNoPartOfABlockChangesNothing) {
  const Recipe recipe = recipe_of({kPoint});
  Recipe padded;
  // A field that nobody knows, in the recipe; ends that are no range's, and a count of the
  // server's.
  ASSERT_TRUE(padded.ParseFromString(recipe.SerializeAsString() + std::string("\x98\x06\x01", 3)));
  padded.mutable_blocks(0)->mutable_axes(1)->set_from(3.0);
  EXPECT_EQ(recipe_digest(padded), recipe_digest(recipe));
  EXPECT_TRUE(is_same_block(padded.blocks(0), recipe.blocks(0)));
  padded.mutable_blocks(0)->mutable_axes(1)->set_values(0, 0.5);
  EXPECT_FALSE(is_same_block(padded.blocks(0), recipe.blocks(0)));
}

}  // namespace
}  // namespace oblique::protocol
