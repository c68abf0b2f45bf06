#pragma once

#include <memory>
#include <span>
#include <vector>

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/motion.h"

namespace oblique::solver {

/// A chain with its motion and, once solve_falls() has solved it, its fall: what points of all
/// models with one fall_model() share. Constant from then on. Motion and others refer to its parts,
/// so it stays at one address.
class FallenChain {
 public:
  /// Throws InputError when `model` is outside its domain or its dt_fall is above its limit.
  explicit FallenChain(const ModelParameters& model);
  FallenChain(const FallenChain&) = delete;
  FallenChain& operator=(const FallenChain&) = delete;
  ~FallenChain() = default;

  /// As fall_model() gives it.
  const ModelParameters& model() const { return model_; }
  const Chain& chain() const { return chain_; }
  const std::shared_ptr<const Motion>& motion() const { return motion_; }
  double fall_step_s() const { return fall_step_s_; }
  /// Needs a fall that is solved.
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

/// Whether solve_falls() solves the two side by side, so that both cost hardly more than one.
bool fall_side_by_side(const ModelParameters& a, const ModelParameters& b);

/// Solves the falls of some chains, side by side where their integrator and shapes allow, and gives
/// the outcomes in the same order. A fall has the same bits whatever was solved beside it, and one
/// that fails leaves the others alone.
std::vector<FallOutcome> solve_falls(std::span<const std::shared_ptr<FallenChain>> chains);

/// The same for the falls of some models, which fall_model() need not have gone through. A model
/// outside its domain fails as a fall does. Throws std::bad_alloc where there is no memory.
std::vector<FallOutcome> solve_falls(std::span<const ModelParameters> models);

}  // namespace oblique::solver
