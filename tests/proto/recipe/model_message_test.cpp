#include "proto/recipe/model_message.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

const std::vector<Axis> kPoint{listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})};

TEST(ModelMessageTest, AModelOutsideItsDomainIsRefusedUnlessReadUnchecked) {
  EXPECT_THROW(from_message(ModelParameters{}), solver::InputError);
  ModelParameters message = to_message(unusual_model());
  message.set_spectral_radius(1.0);
  EXPECT_THROW(from_message(message), solver::InputError);
  EXPECT_EQ(from_message_unchecked(message).spectral_radius, 1.0);
  message = to_message(unusual_model());
  message.set_elements_per_link(4'000'000'000U);
  EXPECT_THROW(from_message_unchecked(message), solver::InputError)
      << "the number exceeds the range of the field";
}

// Databases store these texts. A changed text needs a new version in its first word and a new
// schema number.
TEST(Canonical, TheTextOfAModelNeverChanges) {
  EXPECT_EQ(canonical_model(solver::preset("paper")),
            "oblique-model-1 lengths=0.4,0.4,0.4 E=7e+10 A=0.0005309 I=2.243e-08 rho=2700 g=9.81 "
            "elements_per_link=4 k=2.7e+07 eta2=1.2463 tip_mass=0 integrator=explicit "
            "spectral_radius=0.9 dt=0 dt_fall=0");
  EXPECT_EQ(canonical_model(unusual_model()),
            "oblique-model-1 lengths=0.5,0.25 E=1e+09 A=0.0002 I=3e-08 rho=1000 g=1.62 "
            "elements_per_link=7 k=5e+06 eta2=1.5 tip_mass=0.125 integrator=generalized-alpha "
            "spectral_radius=0.5 dt=1e-06 dt_fall=2e-06 tolerance=1e-06");
}

TEST(ModelMessageTest, AModelIsTheSameAfterEncodingAndDecoding) {
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
    ModelParameters message;
    ASSERT_TRUE(decode(encode(to_message(model)), message));
    EXPECT_EQ(from_message(message), model);
  }
}

TEST(Canonical, ZeroHasNoSignAndADefaultToleranceIsNotWritten) {
  solver::ModelParameters model = solver::preset("paper");
  const std::string text = canonical_model(model);
  model.dt_s = -0.0;
  EXPECT_EQ(canonical_model(model), text);
  model.tolerance = 1e-6;
  EXPECT_EQ(canonical_model(model), text + " tolerance=1e-06");
}

TEST(Canonical, TheDigestOfARecipeNeverChanges) {
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad")
      << "the value comes from FIPS 180-4";
  EXPECT_EQ(recipe_digest(recipe_of({kPoint})),
            "8344f39bccb110503a4c571f76d91034e47923dc20725c348e2c03a11a402663");
}

TEST(Canonical, TheDigestDependsOnModelErrorsBlocksAndTheOrderOfAxes) {
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

TEST(Canonical, BlocksAreComparedAsTheyAreWritten) {
  const Recipe recipe = recipe_of({kPoint});
  Recipe padded;  // an unknown field
  ASSERT_TRUE(padded.ParseFromString(recipe.SerializeAsString() + std::string("\x98\x06\x01", 3)));
  EXPECT_EQ(recipe_digest(padded), recipe_digest(recipe));
  const auto of = [](const Axis& mu) {
    return filtered({listed("H", {1.0}), mu, listed("e", {1.0})}, "");
  };
  EXPECT_TRUE(is_same_block(of(range("mu", 0.1, 0.3, 3)), of(range("mu", 0.1, 0.3, 3))));
  EXPECT_FALSE(is_same_block(of(range("mu", 0.1, 0.3, 3)), of(listed("mu", {0.1, 0.2, 0.3}))));
  EXPECT_FALSE(is_same_block(of(listed("mu", {0.1, 0.4})), of(listed("mu", {0.4, 0.1}))));
}

using namespace std::string_literals;
using testing::AllOf;
using testing::HasSubstr;

TEST(ModelInput, IsItsPresetAndTheKeysThatOverrideIt) {
  const auto model =
      ModelInput{.preset = "printed", .values = {{"length", 0.2}, {"k", 1e7}, {"links", 2}}}
          .model();
  EXPECT_EQ(model.lengths_m, (std::vector{0.2, 0.2}));
  EXPECT_EQ(model.k_N_m, 1e7);
  EXPECT_EQ(model.eta2, solver::preset("printed").eta2);
  EXPECT_EQ(ModelInput().model(), solver::preset("standard"));
}

TEST(ModelInput, ErrorsHaveTheKeyAndTheInvalidValue) {
  const struct {
    ModelInput model;
    const char* key;
    const char* expected;
  } wrong[] = {
      {{.values = {{"tip_mas", 1}}}, "tip_mas", "did you mean `tip_mass`"},
      {{.values = {{"rho", -1}}}, "rho", "rho = -1"},
      {{.preset = "papre"}, "preset", "papre"},
      {{.lengths_m = {{0.4, -0.3}}}, "lengths", "lengths = -0.3"},
      {{.lengths_m = std::vector<double>()}, "lengths", "lengths = []"},
      {{.lengths_m = std::vector(65, 0.1)}, "lengths", "from 1 to 64"},
      {{.lengths_m = {{0.4}}, .values = {{"links", 1}}}, "lengths", "lengths cannot be combined"},
      {{.lengths_m = {{0.4}}, .values = {{"length", 1}}}, "lengths", "lengths cannot be combined"},
  };
  for (const auto& [model, key, expected] : wrong) {
    try {
      (void)model.model();
      ADD_FAILURE() << expected;
    } catch (const solver::InputError& error) {
      EXPECT_EQ(error.fields().key, key);
      EXPECT_THAT(error.what(), HasSubstr(expected));
    }
  }
}

TEST(StudyName, MayBeAnyVisibleText) {
  for (const auto& name : {"paper"s, "μ and e, 2nd"s, "a-b"s, "参数"s, std::string(100, 'x')}) {
    EXPECT_EQ(study_name_error(name), "") << name;
  }
  for (const auto& name : {""s, std::string(101, 'x'), "-x"s}) {
    EXPECT_NE(study_name_error(name), "") << name;
  }
}

TEST(StudyName, IsRefusedAndShownEscapedIfItHasInvisibleCharacters) {
  for (const auto& name : {"a\x1b[2J"s, "a\0b"s, "two\nlines"s, "\x7f"s, "\u009b2J"s, "a\u202eb"s,
                           "\u200e"s, "a\xff"s, "a\u200bb"s, "\ufeff"s, "a\u00adb"s}) {
    const auto name_error = study_name_error(name);
    EXPECT_THAT(name_error, AllOf(HasSubstr("control characters"), HasSubstr("\\"),
                                  testing::Not(HasSubstr(name))));
  }
}

TEST(StudyName, IsRefusedIfAnotherNameLooksTheSame) {
  EXPECT_EQ(study_name_error("\u00e9t\u00e9"), "");
  for (const auto& name : {"e\u0301"s, "a\u0327"s, "o\u0345"s, "a\u00a0b"s}) {
    EXPECT_THAT(study_name_error(name), HasSubstr("combining marks, no-break spaces")) << name;
  }
}

TEST(StudyPriority, IsWithinLimitsThatTheErrorNames) {
  for (const std::int64_t priority : {-1000, 0, 1000}) {
    EXPECT_EQ(priority_error(priority), "");
  }
  EXPECT_EQ(priority_error(1001), "priority = 1001 is not allowed: it must be -1000 to 1000");
  EXPECT_NE(priority_error(-1001), "");
}

}  // namespace
}  // namespace oblique::protocol
