// Tests how large the errors of a contact's outputs are with the chosen steps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "worker/solver/falls.h"
#include "worker/solver/solve.h"

namespace oblique::solver {
namespace {

struct Errors {
  double relative = 0.0;  ///< largest relative error of peaks, duration and slide
  double stick_s = 0.0;
  double exit_m_s = 0.0;
};

/// Solves contacts after one fall. Compares them with contacts whose steps are six times shorter.
class Steps {
 public:
  explicit Steps(const ModelParameters& model)
      : model_(model), fallen_(solve_falls({&model_, 1}).front().fallen) {
    ModelParameters shorter = model_;
    shorter.step_factor = 1.0 / 6.0;
    reference_ = solved(shorter);
  }

  /// Returns the largest errors with steps `factor` times as long as the chosen steps.
  Errors left_by(double factor) const {
    ModelParameters stepped = model_;
    stepped.step_factor = factor;
    Errors errors;
    const auto results = solved(stepped);
    for (std::size_t i = 0; i < results.size(); ++i) {
      EXPECT_EQ(results[i].mode, reference_[i].mode);
      add(results[i], reference_[i], errors);
    }
    return errors;
  }

 private:
  static void add(const CaseResult& result, const CaseResult& reference, Errors& errors) {
    const auto raise = [](double& largest, double value, double right, double scale) {
      largest = std::max(largest, std::abs(value - right) / scale);
    };
    for (std::size_t i = 0; i < std::min(result.peaks.size(), reference.peaks.size()); ++i) {
      raise(errors.relative, result.peaks[i].fn_N, reference.peaks[i].fn_N, reference.fn_peak_N);
    }
    raise(errors.relative, result.duration_s, reference.duration_s, reference.duration_s);
    raise(errors.relative, result.slide_m, reference.slide_m, reference.slide_m);
    raise(errors.stick_s, result.stick_total_s, reference.stick_total_s, 1.0);
    raise(errors.exit_m_s, result.vt_out_m_s, reference.vt_out_m_s, 1.0);
    raise(errors.exit_m_s, result.vn_out_m_s, reference.vn_out_m_s, 1.0);
  }

  std::vector<CaseResult> solved(const ModelParameters& model) const {
    const Finger finger(model, fallen_);
    std::vector<CaseResult> results;
    for (const double part : {0.4, 0.8}) {
      const double H_m = part * fallen_->fall().largest_drop_m();
      for (const double mu : {0.3, 1.3}) {
        for (const double e_star : {0.1, 0.5, 1.0}) {
          results.push_back(finger.solve(H_m, mu, e_star));
        }
      }
    }
    return results;
  }

  ModelParameters model_;
  std::shared_ptr<const FallenChain> fallen_;
  std::vector<CaseResult> reference_;
};

void expect_within(const Errors& errors, double tolerance) {
  EXPECT_LE(errors.relative, tolerance);
  EXPECT_LE(errors.exit_m_s, 1e-2);
}

TEST(Tolerance, IsKeptByChosenStepsOnThePublishedMesh) {
  const Errors errors = Steps(preset("paper")).left_by(1.0);
  expect_within(errors, 1e-5);
  EXPECT_LE(errors.stick_s, 5e-9);
}

TEST(Tolerance, IsKeptByChosenStepsOnAFineMesh) {
  ModelParameters model = preset("paper");
  model.lengths_m = {0.4};
  model.elements_per_link = 16;
  expect_within(Steps(model).left_by(1.0), 1e-5);
}

TEST(Tolerance, IsKeptByChosenStepsOnAHardSpringAndWithAHeavyTip) {
  ModelParameters model = preset("paper");
  model.lengths_m = {0.4};
  model.k_N_m = 1e9;
  expect_within(Steps(model).left_by(1.0), 1e-5);
  model.k_N_m = 1e7;
  model.tip_mass_kg = 0.05;
  expect_within(Steps(model).left_by(1.0), 1e-5);
}

}  // namespace
}  // namespace oblique::solver
