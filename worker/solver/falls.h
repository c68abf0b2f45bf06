#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/motion.h"

namespace oblique::solver {

/// Data shared by models with equal fall_model(): a chain, its motion, and its fall, which
/// solve_falls() sets once. Not copied, because the motion refers to the chain.
class FallenChain {
 public:
  /// Throws InputError when `model` is outside its domain or its dt_fall is above the limit.
  explicit FallenChain(const ModelParameters& model);

  /// Returns the fall_model() of the models that share this data.
  const ModelParameters& model() const { return model_; }
  const Chain& chain() const { return chain_; }
  const std::shared_ptr<const Motion>& motion() const { return motion_; }
  double fall_step_s() const { return fall_step_s_; }
  /// May be called only after the fall is solved.
  const Fall& fall() const { return *fall_; }
  void set_fall(std::shared_ptr<const Fall> fall) { fall_ = std::move(fall); }
  FallProgress& fall_progress() const { return fall_progress_; }

 private:
  ModelParameters model_;
  Chain chain_;
  std::shared_ptr<const Motion> motion_;
  double fall_step_s_;
  std::shared_ptr<const Fall> fall_;
  mutable FallProgress fall_progress_ = 0.0;
};

/// Whether solve_falls() solves the two falls side by side, in about the time of one.
bool fall_side_by_side(const ModelParameters& a, const ModelParameters& b);

/// Solves falls, side by side where integrator and shapes allow. Outcomes are in the order of the
/// chains. A fall has the same bits alone and beside others, even if others fail.
std::vector<FallOutcome> solve_falls(std::span<const std::shared_ptr<FallenChain>> chains);

/// Solves the falls of models. The outcome of a model outside its domain is an error.
std::vector<FallOutcome> solve_falls(std::span<const ModelParameters> models);

}  // namespace oblique::solver
