#include "worker/solver/model/parameters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <string_view>

namespace oblique::solver {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string error_for(const ParameterKey& key, double value) {
  try {
    check_value(key, value);
    return {};
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(Parameters, EveryPresetIsValid) {
  for (const std::string_view name : preset_names()) {
    EXPECT_NO_THROW(validate(preset(name))) << name;
  }
  EXPECT_THROW(preset("papers"), InputError);
}

TEST(Parameters, TheDefaultIsThePaperOnAFinerMesh) {
  EXPECT_EQ(preset_names().front(), "standard");
  EXPECT_EQ(preset("standard"), ModelParameters{});
  ModelParameters paper = preset("paper");
  EXPECT_EQ(paper.elements_per_link, 4);
  paper.elements_per_link = 16;
  EXPECT_EQ(paper, preset("standard"));
}

TEST(Parameters, EveryKeyHasAUniqueNameAndReadsTheValueThatItWrote) {
  std::set<std::string_view> names;
  for (const ParameterKey& key : model_keys()) {
    EXPECT_TRUE(names.insert(key.name).second) << key.name;
    EXPECT_EQ(find_model_key(key.name), &key);
    ModelParameters model;
    const double other = key.get(model) == 1.0 ? 0.0 : 1.0;
    key.set(model, other);
    EXPECT_EQ(key.get(model), other) << key.name;
  }
  EXPECT_EQ(find_model_key("lengths"), nullptr);
}

TEST(Parameters, LinksKeepsTheFirstLengthAndLengthSetsAllLengths) {
  ModelParameters model;
  model.lengths_m = {0.3, 0.5};
  find_model_key("links")->set(model, 4.0);
  EXPECT_EQ(model.lengths_m, (std::vector<double>{0.3, 0.3, 0.3, 0.3}));
  find_model_key("length")->set(model, 0.2);
  EXPECT_EQ(model.lengths_m, (std::vector<double>{0.2, 0.2, 0.2, 0.2}));
}

TEST(Parameters, AForbiddenValueIsNamedWithItsUnitAndTheAllowedValues) {
  EXPECT_THAT(error_for(*find_model_key("rho"), -1.0),
              AllOf(HasSubstr("rho = -1 kg/m^3 is not allowed"), HasSubstr("> 0")));
  for (const ParameterKey& key : model_keys()) {
    EXPECT_NE(error_for(key, std::numeric_limits<double>::quiet_NaN()), "") << key.name;
    EXPECT_NE(error_for(key, std::numeric_limits<double>::infinity()), "") << key.name;
    EXPECT_NE(error_for(key, -1.0), "") << key.name;
    EXPECT_EQ(error_for(key, key.get(ModelParameters{})), "") << key.name;
  }
  for (const std::string_view counts : {"links", "elements_per_link"}) {
    EXPECT_NE(error_for(*find_model_key(counts), 1.5), "");
  }
  EXPECT_EQ(error_for(*find_model_key("spectral_radius"), 0.0), "");
  EXPECT_NE(error_for(*find_model_key("spectral_radius"), 1.0), "");
}

TEST(Parameters, ATooSmallOrTooLargeToleranceIsRefusedByName) {
  const ParameterKey& tolerance = *find_model_key("tolerance");
  for (const double allowed : {1e-9, 1e-5, 0.01}) {
    EXPECT_EQ(error_for(tolerance, allowed), "");
  }
  for (const double refused : {0.0, 0.99e-9, 0.0101}) {
    EXPECT_THAT(error_for(tolerance, refused),
                AllOf(HasSubstr("tolerance = "), HasSubstr("from 1e-9"), HasSubstr("to 0.01")));
  }
}

TEST(Parameters, ADropIsAtMostTheLengthOfTheChain) {
  ModelParameters model;
  model.lengths_m = {0.5, 0.25};
  EXPECT_NO_THROW(validate_point(model, 0.75, 0.0, 1.0));
  EXPECT_THROW(validate_point(model, 0.76, 0.0, 1.0), InputError);
  EXPECT_THROW(validate_point(model, 0.5, -0.1, 1.0), InputError);
  EXPECT_THROW(validate_point(model, 0.5, 0.0, 1.1), InputError);
}

TEST(Parameters, IntegratorsAreSelectedByName) {
  for (const Integrator integrator : {Integrator::kExplicit, Integrator::kGeneralizedAlpha}) {
    EXPECT_EQ(integrator_named(integrator_name(integrator)), integrator);
  }
  EXPECT_EQ(integrator_name(ModelParameters{}.integrator), "explicit");
  EXPECT_THROW(integrator_named("implicit"), InputError);
}

TEST(FallModel, ModelsHaveEqualHashesExactlyWhenTheyShareAFall) {
  std::set<std::uint64_t> hashes{fall_hash(ModelParameters())};
  std::size_t falls = 1;
  for (const auto& key : model_keys()) {
    ModelParameters model;
    key.set(model, key.name == "tolerance" ? 1e-7 : key.get(model) + 1.0);
    falls += fall_model(model) == fall_model(ModelParameters()) ? 0U : 1U;
    EXPECT_EQ(hashes.insert(fall_hash(model)).second,
              !(fall_model(model) == fall_model(ModelParameters())))
        << key.name;
  }
  EXPECT_EQ(hashes.size(), falls);
  ModelParameters contact;
  contact.k_N_m = 1e8;
  contact.eta2 = 1.0;
  contact.dt_s = 1e-7;
  EXPECT_EQ(fall_hash(contact), fall_hash(ModelParameters()));
}

TEST(FallModel, AKeyChangesTheFallExactlyIfTwoOfItsValuesHaveDifferentFalls) {
  for (const Integrator integrator : {Integrator::kExplicit, Integrator::kGeneralizedAlpha}) {
    ModelParameters model;
    model.integrator = integrator;
    for (const auto& key : model_keys()) {
      std::set<std::uint64_t> falls;
      for (const double value : {0.0, 1e-8, 1e-6, 1e-4, 0.5, 1.0, 2.0, 1e7}) {
        if (key.is_allowed(value)) {
          ModelParameters other = model;
          key.set(other, value);
          falls.insert(fall_hash(other));
        }
      }
      EXPECT_EQ(changes_fall(key, model), falls.size() > 1)
          << key.name << " with " << integrator_name(integrator);
    }
  }
}

}  // namespace
}  // namespace oblique::solver
