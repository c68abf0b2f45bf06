#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "proto/recipe/point_table.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// Solves the fall of a finger from rest. Returns the largest drop [m] of the tip before the tip
/// turns back.
using LargestDrop = std::function<double(const solver::ModelParameters& model)>;

/// Checks that the tip reaches every H of a study. Throws solver::InputError with key and block.
using ReachCheck = std::function<void(const protocol::PointTable& study)>;

/// Checks every H against solved falls. It keeps the falls, because most blocks share them.
class ReachChecker {
 public:
  /// Maximum number of solved falls, and of models in a block that is checked.
  static constexpr std::size_t kMaxFalls = 8;

  explicit ReachChecker(LargestDrop largest_drop_m);

  /// Throws InputError unless every model of a block reaches the block's largest H. Skips blocks in
  /// which the largest H depends on the point: those with expressions, filters, or several models
  /// in a zip or sample. Only an H near the length of the finger requires a fall: first on a coarse
  /// mesh, then, if the result is not clear, on the model's own mesh. After `kMaxFalls` falls it
  /// checks nothing; points whose H is not reached then fail when they are solved.
  void operator()(const protocol::PointTable& study);

  std::size_t falls_solved() const { return falls_solved_; }

 private:
  /// A fall with its largest drops on both meshes, if known.
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
