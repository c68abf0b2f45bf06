#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "worker/solver/chain/chain.h"
#include "worker/solver/model/fall_model.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/motion/fall.h"
#include "worker/solver/motion/fall_progress.h"
#include "worker/solver/motion/motion.h"

namespace oblique::solver {

/// A chain set up to fall: all that models with one fall_model share before it is solved.
/// Immutable but for how far its fall is; Motion and whatever else keeps a reference into it need
/// it at one address.
class PreparedChain {
 public:
  /// Throws InputError when `model` is outside its domain or its dt_fall is above its limit.
  explicit PreparedChain(const ModelParameters& model);
  PreparedChain(const PreparedChain&) = delete;
  PreparedChain& operator=(const PreparedChain&) = delete;
  ~PreparedChain() = default;

  /// As fall_model() gives it.
  const ModelParameters& model() const { return model_; }
  const Chain& chain() const { return chain_; }
  const Motion& motion() const { return *motion_; }
  std::shared_ptr<const Motion> shared_motion() const { return motion_; }
  double fall_step_s() const { return fall_step_s_; }
  /// How far its fall is, told while solve_falls() is at it.
  FallProgress& fall_progress() const { return fall_progress_; }

 private:
  ModelParameters model_;
  Chain chain_;
  std::shared_ptr<const Motion> motion_;
  double fall_step_s_;
  mutable FallProgress fall_progress_;
};

/// The chain with its fall: what points of all models with one fall_model share. Immutable.
class FallenChain {
 public:
  FallenChain(std::shared_ptr<const PreparedChain> prepared, Fall fall)
      : prepared_(std::move(prepared)), fall_(std::move(fall)) {}

  const ModelParameters& model() const { return prepared_->model(); }
  const std::shared_ptr<const PreparedChain>& prepared() const { return prepared_; }
  const Chain& chain() const { return prepared_->chain(); }
  const Motion& motion() const { return prepared_->motion(); }
  const Fall& fall() const { return fall_; }

 private:
  std::shared_ptr<const PreparedChain> prepared_;
  Fall fall_;
};

/// What became of a fall: the chain with it, or the reason why there is none.
struct FallOutcome {
  std::shared_ptr<const FallenChain> fallen;
  std::string error;
};

/// Whether solve_falls() solves the two side by side, so that both cost hardly more than one.
bool fall_side_by_side(const ModelParameters& a, const ModelParameters& b);

/// Solves the falls of some chains, side by side where their integrator and shapes allow, and gives
/// the outcomes in the same order. A fall has the same bits whatever was solved beside it, and one
/// that fails leaves the others alone.
std::vector<FallOutcome> solve_falls(std::span<const std::shared_ptr<const PreparedChain>> chains);

/// The same for the falls of some models, which fall_model() need not have gone through. A model
/// outside its domain fails as a fall does. Throws std::bad_alloc where there is no memory.
std::vector<FallOutcome> solve_falls(std::span<const ModelParameters> models);

}  // namespace oblique::solver
