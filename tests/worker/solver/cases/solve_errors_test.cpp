#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/worker/solver/cases/shared_fingers.h"
#include "worker/solver/reference/contact.h"

namespace oblique::solver {
namespace {

using testing::AllOf;
using testing::HasSubstr;

template <class Error>
std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "no exception of the expected type was thrown";
  return {};
}

std::string input_error(double H_m, double mu, double e_star) {
  return message_of<InputError>([&] { coarse_finger().solve(H_m, mu, e_star); });
}

std::string model_error(const std::function<void(ModelParameters&)>& change) {
  ModelParameters model = coarse_model();
  change(model);
  return message_of<InputError>([&] { Finger{model}; });
}

/// Returns the error of solving a point of the coarse model, modified by `change`.
template <class Error = SolveError>
std::string solve_error(const std::function<void(ModelParameters&)>& change, double e_star = 1.0) {
  ModelParameters model = coarse_model();
  change(model);
  const Finger finger{model};
  return message_of<Error>([&] { finger.solve(0.5, 0.4, e_star); });
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(SolveErrors, AValueOutsideItsRangeIsNamedWithTheAllowedRange) {
  EXPECT_THAT(input_error(1.0, -0.1, 1.0), AllOf(HasSubstr("mu = -0.1"), HasSubstr(">= 0")));
  EXPECT_THAT(input_error(1.0, 0.4, 0.0), AllOf(HasSubstr("e = 0"), HasSubstr("[0.001, 1]")));
  EXPECT_THAT(input_error(1.0, 0.4, -0.5), HasSubstr("e = -0.5"));
  EXPECT_THAT(input_error(1.0, 0.4, 1.01), AllOf(HasSubstr("e = 1.01"), HasSubstr("[0.001, 1]")));
  EXPECT_THAT(input_error(0.0, 0.4, 1.0), AllOf(HasSubstr("H = 0 m"), HasSubstr("> 0")));
  EXPECT_THAT(input_error(-1.0, 0.4, 1.0), HasSubstr("H = -1 m"));
}

TEST(SolveErrors, ATouchWithoutSpeedIsReported) {
  const Finger& finger = coarse_finger();
  const double H_m = finger.largest_drop_m();
  EXPECT_THAT(message_of<SolveError>([&] { finger.solve(H_m, 0.4, 1.0); }),
              HasSubstr("hardly any speed"));
}

TEST(SolveErrors, AStepAboveTheStabilityLimitNamesTheLimit) {
  EXPECT_THAT(model_error([](ModelParameters& m) { m.dt_fall_s = 1e-3; }),
              AllOf(HasSubstr("dt_fall = 0.001 s"), HasSubstr("stable up to 1.84")));
  EXPECT_THAT(solve_error<InputError>([](ModelParameters& m) { m.dt_s = 1e-3; }),
              AllOf(HasSubstr("dt = 0.001 s"), HasSubstr("stable up to 1.8")));
  // With e* = 0.05, the spring of restitution is so stiff that only shorter steps are stable.
  ModelParameters model = coarse_model();
  model.dt_s = 1e-5;
  EXPECT_NO_THROW(Finger{model}.solve(0.5, 0.4, 1.0));
  EXPECT_THAT(solve_error<InputError>([](ModelParameters& m) { m.dt_s = 1e-5; }, 0.05),
              HasSubstr("dt = 1e-05 s"));
}

TEST(SolveErrors, AContactLongerThanTheLimitFails) {
  // Half a period of a link on the soft spring takes 45 ms.
  EXPECT_THAT(solve_error([](ModelParameters& m) { m.k_N_m = 1e3; }),
              HasSubstr("did not end within 0.02 s"));
  EXPECT_THAT(solve_error([](ModelParameters& m) { m.tip_mass_kg = 1e4; }),
              HasSubstr("did not end within 0.02 s"));
}

TEST(SolveErrors, AFallOrContactWithoutEndNamesTheUnusualValueThatIsTheLikelyCause) {
  const char* const soft = "; likely cause: E = 70 Pa is outside the usual 1e8 to 1e12 Pa";
  EXPECT_THAT(solve_error([](ModelParameters& m) { m.E_Pa = 70; }),
              AllOf(HasSubstr("fall"), testing::EndsWith(soft)));
  const char* const loose =
      "did not end within 0.02 s; likely cause: k = 27 N/m is outside the "
      "usual 10000 to 1e10 N/m";
  EXPECT_THAT(solve_error([](ModelParameters& m) { m.k_N_m = 27; }), testing::EndsWith(loose));
  EXPECT_THAT(solve_error([](ModelParameters& m) {
                m.k_N_m = 27;
                m.integrator = Integrator::kGeneralizedAlpha;
              }),
              testing::EndsWith(loose));
}

TEST(SolveErrors, OverflowIsAnErrorInBoundedTime) {
  EXPECT_THAT(model_error([](ModelParameters& m) { m.I_m4 = 1e300; }), HasSubstr("magnitude"));
  EXPECT_THAT(model_error([](ModelParameters& m) { m.rho_kg_m3 = 1e-300; }),
              HasSubstr("magnitude"));
  EXPECT_THAT(solve_error([](ModelParameters& m) { m.dt_fall_s = 1e-300; }),
              HasSubstr("more than 1e+09 steps"));
}

TEST(SolveErrors, StepsTooShortToFinishAContactFailAtOnce) {
  EXPECT_THAT(solve_error([](ModelParameters& m) { m.dt_s = 1e-300; }),
              AllOf(HasSubstr("steps of 1e-300 s"), HasSubstr("a longer dt")));
  EXPECT_THAT(solve_error([](ModelParameters& m) { m.dt_s = 1e-14; }),
              AllOf(HasSubstr("steps of 1e-14 s"), HasSubstr("a longer dt")));
  EXPECT_THAT(solve_error([](ModelParameters& m) { m.k_N_m = 1e30; }), HasSubstr("k = 1e+30 N/m"));
  EXPECT_THAT(solve_error([](ModelParameters& m) {
                m.integrator = Integrator::kGeneralizedAlpha;
                m.dt_s = 1e-300;
              }),
              HasSubstr("steps of 1e-300 s"));
}

TEST(SolveErrors, TheContactFailsForStatesThatAreNotFiniteAndContactsWithoutEnd) {
  const ContactParameters parameters{1e6, 1.2, 0.5, 1.0};
  Contact contact(parameters, {0.0, 0.0, 1.0, -1.0}, {1e-5, 1e-5});
  EXPECT_THROW(contact.judge({kNaN, 0.0, 1.0, -1.0}, {}), SolveError);
  // A contact whose tip sinks forever.
  Contact sinking(parameters, {0.0, 0.0, 1.0, -1.0}, {1e-5, 1e-5});
  TipState tip{0.0, 0.0, 1.0, -1.0};
  const auto sink = [&] {
    for (int i = 0; i < 3000; ++i) {
      tip.y_m -= 1e-5;
      tip.x_m += 1e-5;
      sinking.judge(tip, {});
    }
  };
  EXPECT_THROW(sink(), SolveError);
}

TEST(SolveErrors, AFailingPointDoesNotAffectOthersOfItsBatch) {
  const std::vector<Point> list{{0.5, 0.4, 1.0},  {1.19, 0.4, 1.0}, {0.5, -1.0, 1.0},
                                {kNaN, 0.4, 1.0}, {0.6, 0.4, 0.0},  {1.0, 0.4, 0.5}};
  std::vector<std::string> errors;
  for (const Outcome& outcome : solve_points(coarse_finger(), list)) {
    EXPECT_EQ(outcome.result.has_value(), outcome.error.empty());
    errors.push_back(outcome.error);
  }
  EXPECT_EQ(errors[0], "");
  EXPECT_THAT(errors[1], HasSubstr("1.179156"));
  EXPECT_THAT(errors[2], HasSubstr("mu = -1"));
  EXPECT_THAT(errors[3], HasSubstr("H = nan"));
  EXPECT_THAT(errors[4], HasSubstr("e = 0"));
  EXPECT_EQ(errors[5], "");
}

}  // namespace
}  // namespace oblique::solver
