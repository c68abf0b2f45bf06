#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/convergence/contact_changes.h"
#include "client/convergence/richardson.h"
#include "worker/solver/model/case_result.h"

namespace oblique::client {

/// A scalar that a contact gives.
struct Output {
  std::string name;  ///< with its unit, as results have it; `major_peak_2_N` is the second one
  double value;
  /// Largest force, duration, speed at touch, ...: what errors are small against. Digits below 1e-9
  /// of it are rounding.
  double scale;
  /// States up to the instant that makes the value, ripples merged. Values of two levels are the
  /// same quantity when this is the same.
  std::string mode;
};

/// fn_peak, ft_peak, every major peak, duration, stick, slide, impulses, exit velocity and the
/// largest reactions (reaction_0_N at the pin, reaction_1_N at the first joint, ...).
std::vector<Output> outputs_of(const solver::CaseResult& result);

/// One output over the levels.
struct OutputConvergence {
  std::string name;
  double scale;  ///< as of the finest level's Output
  /// One a level, coarsest first; nothing where the mode differs from the finest's before.
  std::vector<std::optional<double>> values;
  /// Over the finest levels that have the value, without a gap.
  Extrapolation extrapolation;

  double finest() const { return *values.back(); }
};

/// What one level has and the next finer one has not, or the other way round.
struct LevelChange {
  std::size_t finer;  ///< number of the finer level
  ContactChange change;
};

/// One point over the levels.
struct PointConvergence {
  std::vector<OutputConvergence> outputs;
  std::vector<LevelChange> changes;
  /// Whether the finest three levels have one mode, ripples merged: outputs have a limit to be seen
  /// only then.
  bool has_one_mode = false;
};

/// Judges one point from its results, coarsest level first. `highest_order` is the order that
/// theory promises at most.
PointConvergence convergence_of(std::span<const solver::CaseResult> results, double highest_order);

/// |value - limit| / |limit|, where both are there; of a limit of 0, nothing.
std::optional<double> relative_error(const std::optional<double>& value, double limit);

}  // namespace oblique::client
