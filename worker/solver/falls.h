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

/// A chain with its motion and, once solve_falls() has solved it, its fall: what models with the
/// same fall_model() share. Does not change after that. The motion refers to the chain, so objects
/// are not copied.
class FallenChain {
 public:
  /// Throws InputError when `model` is outside its domain or its dt_fall is above the limit.
  explicit FallenChain(const ModelParameters& model);

  /// As returned by fall_model().
  const ModelParameters& model() const { return model_; }
  const Chain& chain() const { return chain_; }
  const std::shared_ptr<const Motion>& motion() const { return motion_; }
  double fall_step_s() const { return fall_step_s_; }
  /// Only after the fall is solved.
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

/// Whether solve_falls() solves the two falls side by side, so that both take hardly longer than
/// one.
bool fall_side_by_side(const ModelParameters& a, const ModelParameters& b);

/// Solves falls, side by side where integrator and shapes allow. Outcomes are in the order of the
/// chains. A fall has the same bits whatever is solved beside it; one that fails does not affect
/// the others.
std::vector<FallOutcome> solve_falls(std::span<const std::shared_ptr<FallenChain>> chains);

/// The same for any models. A model outside its domain has an error as its outcome.
std::vector<FallOutcome> solve_falls(std::span<const ModelParameters> models);

}  // namespace oblique::solver
