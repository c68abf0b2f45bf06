#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// One point of a study.
struct Point {
  std::uint64_t model;  ///< number of its model in the recipe
  double H_m;
  double mu;
  double e_star;
};

/// Points of a study that follow each other and share a model.
struct Segment {
  std::uint64_t model;
  std::uint64_t first_point;
  std::uint64_t count;
};

/// A recipe checked and made fit for computing with: point i and model j as pure functions, in time
/// and memory that do not grow with the number of points.
class PointTable {
 public:
  /// Blocks without model axes share one model number. An absent model is the preset `paper`.
  /// Throws solver::InputError naming key, value and what is allowed: what checks.h says of blocks,
  /// a model outside its domain, no block, too many points.
  explicit PointTable(Recipe recipe);

  const Recipe& recipe() const { return recipe_; }
  /// Whether results are to have estimated errors.
  bool wants_errors() const { return recipe_.errors(); }
  std::uint64_t size() const;    ///< number of points
  std::uint64_t models() const;  ///< number of models

  /// Throws std::out_of_range for a point or model that the study does not have.
  Point point(std::uint64_t index) const;
  solver::ModelParameters model(std::uint64_t index) const;
  /// The whole run of points around `index` that shares its model. Blocks without model axes that
  /// follow each other are one run, so that studies of many small blocks are handed out and solved
  /// as one large block is.
  Segment segment_at(std::uint64_t index) const;

 private:
  struct BlockLayout {
    std::uint64_t first_point;
    std::uint64_t points;
    std::uint64_t first_model;
    std::uint64_t models;
  };
  const BlockLayout& layout_at(std::uint64_t point, std::size_t& block) const;

  void add_block(const Block& block);
  /// Counts the points of a block without model axes that is about to be added.
  void add_to_base_segments(std::uint64_t block_points);

  Recipe recipe_;
  solver::ModelParameters base_model_;
  std::vector<BlockLayout> blocks_;
  std::vector<Segment> base_segments_;     ///< of the blocks without model axes, in order
  std::vector<std::size_t> model_blocks_;  ///< blocks that bring models of their own, in order
  std::optional<std::uint64_t> base_model_number_;  ///< shared by all blocks without model axes
  std::uint64_t points_ = 0;
  std::uint64_t models_ = 0;
};

}  // namespace oblique::protocol
