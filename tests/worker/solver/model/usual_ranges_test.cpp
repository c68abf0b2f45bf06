#include "worker/solver/model/parameters.h"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace oblique::solver {
namespace {

std::string note(const char* key, double value) {
  return note_on_value(*find_model_key(key), value);
}

TEST(UsualRanges, AnUnusualValueIsNamedWithItsValueInTheLikelyUnit) {
  EXPECT_EQ(note("E", 7e4), "E = 70000 Pa is outside the usual 1e8 to 1e12 Pa; 7e10?") << "MPa";
  EXPECT_EQ(note("E", 210), "E = 210 Pa is outside the usual 1e8 to 1e12 Pa; 2.1e11?") << "GPa";
  EXPECT_EQ(note("rho", 2.7), "rho = 2.7 kg/m^3 is outside the usual 100 to 25000 kg/m^3; 2700?");
  EXPECT_EQ(note("rho", 2.7e6),
            "rho = 2.7e6 kg/m^3 is outside the usual 100 to 25000 kg/m^3; 2700?");
  EXPECT_EQ(note("length", 400), "length = 400 m is outside the usual 0.001 to 100 m; 0.4?");
  EXPECT_EQ(note("A", 531), "A = 531 m^2 is outside the usual 1e-8 to 1 m^2; 0.000531?");
  EXPECT_EQ(note("I", 22'430), "I = 22430 m^4 is outside the usual 1e-17 to 0.1 m^4; 2.243e-8?");
  EXPECT_EQ(note("g", 9810), "g = 9810 m/s^2 is outside the usual 0.1 to 100 m/s^2; 9.81?");
  EXPECT_EQ(note("k", 27), "k = 27 N/m is outside the usual 10000 to 1e10 N/m; 2.7e7?");
  EXPECT_EQ(note("tip_mass", 20), "tip_mass = 20 kg is outside the usual 1e-6 to 10 kg; 0.02?");
}

TEST(UsualRanges, PresetsEndsOfRangesAndZeroAreUsual) {
  for (const auto name : preset_names()) {
    const ModelParameters model = preset(name);
    EXPECT_EQ(with_likely_cause("", model), "") << name;
    for (const auto& key : model_keys()) {
      EXPECT_EQ(note_on_value(key, key.get(model)), "") << key.name;
    }
  }
  EXPECT_EQ(note("E", 1e8), "");
  EXPECT_EQ(note("E", 1e12), "");
  EXPECT_EQ(note("tip_mass", 0), "");
  EXPECT_EQ(note("E", std::numeric_limits<double>::infinity()), "") << "the end of a distribution";
  EXPECT_EQ(note("E", -70), "") << "is invalid";
  EXPECT_EQ(note("dt", 1e9), "") << "has no usual range";
}

TEST(UsualRanges, EachUnusualParameterIsALikelyCause) {
  ModelParameters model;
  model.E_Pa = 70;
  model.lengths_m = {0.4, 400, 0.3};
  EXPECT_EQ(with_likely_cause("it diverged", model),
            "it diverged; likely cause: length = 400 m is outside the usual 0.001 to 100 m; likely "
            "cause: E = 70 Pa is outside the usual 1e8 to 1e12 Pa");
}

}  // namespace
}  // namespace oblique::solver
