#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "proto/recipe/point_table.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// Largest drop in m of the tip of a finger that falls from rest, before it turns back. Costs a
/// fall.
using LargestDrop = std::function<double(const solver::ModelParameters& model)>;

/// Looks whether the tip reaches every H of a study of one block, and throws solver::InputError
/// where not.
using ReachCheck = std::function<void(const protocol::PointTable& block)>;

/// Looks whether the tip reaches the drops that a study asks for, before the study is begun. One
/// checker serves all blocks of a study: it remembers the falls, which blocks mostly share.
class ReachChecker {
 public:
  /// Most falls that are looked into, in all blocks together, and most models of a block.
  static constexpr std::size_t kMostFalls = 8;

  explicit ReachChecker(LargestDrop largest_drop_m);

  /// Throws InputError unless every model of the block reaches the block's largest H, as far as all
  /// models have that one: not where an expression or a filter decides, nor for points side by side
  /// or drawn of several models. Only an H near the length of the chain is looked into, by the fall
  /// (on a coarse mesh, which mostly settles it, and then on the model's own). What is beyond
  /// `kMostFalls` is not: there an H out of reach shows as failed points.
  void operator()(const protocol::PointTable& block);

  /// How many falls were asked for so far.
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
  double drop_m(Fall& fall);

  LargestDrop largest_drop_m_;
  std::vector<Fall> falls_;
  std::size_t falls_solved_ = 0;
};

}  // namespace oblique::client
