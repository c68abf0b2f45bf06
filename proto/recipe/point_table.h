#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
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

/// A run of blocks' points and models, as the table has them.
struct BlockPlace {
  std::uint64_t first_point;
  std::uint64_t points;  ///< also those that the filter leaves out
  std::uint64_t first_model;
  std::uint64_t models;
};

/// A recipe checked and made fit for computing with: point i and model j as pure functions, in time
/// and memory that do not grow with the number of points. Safe to use from several threads once it
/// is const.
class PointTable {
 public:
  /// Blocks without model axes share one model number. Throws solver::InputError naming key, value
  /// and what is allowed: what checks.h says of blocks, no model or one outside its domain, no
  /// block, too many points, too many expressions. What can be
  /// judged only point by point is judged by `survey`.
  explicit PointTable(Recipe recipe);
  ~PointTable();
  PointTable(PointTable&&) noexcept;
  PointTable(const PointTable&) = delete;
  PointTable& operator=(PointTable&&) = delete;
  PointTable& operator=(const PointTable&) = delete;

  const Recipe& recipe() const { return *recipe_; }
  /// Whether results are to have estimated errors.
  bool wants_errors() const { return recipe_->errors(); }
  std::uint64_t size() const;    ///< how many point numbers there are
  std::uint64_t models() const;  ///< number of models

  bool has_filter() const { return has_filter_; }
  bool is_left_in(std::uint64_t index) const;
  /// The first point of [begin, end) that is left in, or `end`. Throws std::out_of_range for an end
  /// beyond the last point.
  std::uint64_t first_left_in(std::uint64_t begin, std::uint64_t end) const;

  /// Whether some values or filters can be judged only by their points.
  bool needs_judging() const;
  /// Judges such blocks by their points: by all of them or, where these are more than `kMostJudged`
  /// in all blocks together, by some at random. Takes up to about 0.1 s. Throws solver::InputError
  /// that names block, point and values for a value that is not allowed, and for a filter that
  /// leaves out all points of its block. What is not found fails (`fault`).
  void judge_points() const;
  static constexpr std::uint64_t kMostJudged = 100'000;

  /// Why a point cannot be solved, as a sentence; empty for all that can. Costs nothing but for
  /// blocks that are judged by their points.
  std::string fault(std::uint64_t index) const;

  /// Throws std::out_of_range for a point or model that the study does not have. A value that is no
  /// number reads as 0, and one of a model that is not allowed as that of the recipe's model.
  Point point(std::uint64_t index) const;
  solver::ModelParameters model(std::uint64_t index) const;
  /// The whole run of points around `index` that shares its model. Blocks without model axes that
  /// follow each other are one run, so that studies of many small blocks are handed out and solved
  /// as one large block is.
  Segment segment_at(std::uint64_t index) const;

  /// Where the points of block `number` of the recipe are; `layout_of` tells its axes. Throws
  /// std::out_of_range for a block that there is not.
  const BlockPlace& block(std::size_t number) const { return blocks_.at(number); }
  /// The block that a point is in. Throws std::out_of_range for a point that there is not.
  std::size_t block_of_point(std::uint64_t index) const;

 private:
  class Compiled;

  void add_block(const Block& block);
  /// Counts the points of a block without model axes that is about to be added.
  void add_to_base_segments(std::uint64_t block_points);
  void judge_block(std::size_t number, std::uint64_t most) const;
  std::size_t block_of_model(std::uint64_t index) const;

  const Block& message(std::size_t block) const { return recipe_->blocks(static_cast<int>(block)); }

  std::unique_ptr<Recipe> recipe_;  ///< stays where it is when the table moves
  solver::ModelParameters base_model_;
  std::vector<BlockPlace> blocks_;
  std::vector<bool> is_simple_;            ///< blocks whose values only have to be looked up
  std::vector<bool> is_judged_by_points_;  ///< blocks of which only the points tell what is wrong
  std::vector<Segment> base_segments_;     ///< of the blocks without model axes, in order
  std::vector<std::size_t> model_blocks_;  ///< blocks that bring models of their own, in order
  std::optional<std::uint64_t> base_model_number_;  ///< shared by all blocks without model axes
  std::uint64_t points_ = 0;
  std::uint64_t models_ = 0;
  std::size_t expressions_ = 0;
  bool has_filter_ = false;
  std::unique_ptr<Compiled> compiled_;  ///< of the other blocks; null when there are none
};

}  // namespace oblique::protocol
