#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "proto/recipe/point_table.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// Largest drop [m] of the tip of a finger that falls from rest, before it turns back. Solves a
/// fall.
using LargestDrop = std::function<double(const solver::ModelParameters& model)>;

/// Checks that the tip reaches every H of a study. Throws solver::InputError with key and block.
using ReachCheck = std::function<void(const protocol::PointTable& study)>;

/// Checks H against solved falls, which it keeps because most blocks share them.
class ReachChecker {
 public:
  /// Maximum number of solved falls, and of models in a checked block.
  static constexpr std::size_t kMaxFalls = 8;

  explicit ReachChecker(LargestDrop largest_drop_m);

  /// Throws InputError unless every model of a block reaches the block's largest H. Does not check
  /// blocks in which the largest H depends on the point: with expressions, filters, or several
  /// models in a zip or sample. Only an H near the length of the finger costs a fall, first on a
  /// coarse mesh and then, if that is not clear, on the model's own. Beyond `kMaxFalls`, points
  /// with an H that is not reached fail when they are solved.
  void operator()(const protocol::PointTable& study);

  std::size_t falls_solved() const { return falls_solved_; }

 private:
  /// The largest drops of a fall, if known.
  struct Fall {
    solver::ModelParameters model;
    std::optional<double> coarse_drop_m;
    std::optional<double> drop_m;
  };
  double reached_m(const solver::ModelParameters& model, double H_m);
  double solved_drop_m(const solver::ModelParameters& model, std::optional<double>& drop_m);

  LargestDrop largest_drop_m_;
  std::vector<Fall> falls_;
  std::size_t falls_solved_ = 0;
};

}  // namespace oblique::client
