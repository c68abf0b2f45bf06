#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "proto/recipe/recipe.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// Looks whether the tip reaches the drops that a study asks for, before the study is begun. One
/// checker serves all blocks of a study: it remembers the falls, which blocks mostly share.
class ReachChecker {
 public:
  /// Most falls that are looked into, in all blocks together, and most models of a block.
  static constexpr std::size_t kMostFalls = 8;

  /// Throws InputError unless every model of block `block` reaches the block's largest H. Only an H
  /// near the length of the chain is looked into, by solving the fall (on a coarse mesh, which
  /// mostly settles it, and then on the model's own). What is beyond `kMostFalls` is not: there an
  /// H out of reach shows as failed points.
  void operator()(const protocol::PointTable& table, int block);

  /// How many falls were solved so far.
  std::size_t falls_solved() const { return falls_solved_; }

 private:
  /// The largest drops of one fall, as far as they are known.
  struct Fall {
    solver::ModelParameters model;
    std::optional<double> coarse_drop_m;
    std::optional<double> drop_m;
  };
  Fall* fall_of(const solver::ModelParameters& model);
  bool is_reached_by_far(Fall& fall, double H_m);
  double largest_drop_m(Fall& fall);

  std::vector<Fall> falls_;
  std::size_t falls_solved_ = 0;
};

}  // namespace oblique::client
