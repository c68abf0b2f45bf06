#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "worker/solver/model/case_result.h"
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
  /// Most points a study may have.
  static constexpr std::uint64_t kMaxPoints = 1'000'000'000'000;

  /// Blocks without model axes share one model number. An absent model is the preset `paper`.
  /// Throws solver::InputError naming key, value and what is allowed: unknown or repeated keys, a
  /// missing H, mu or e, axes out of order, empty axes, reversed or non-finite ranges, values out
  /// of their domain, too many points.
  explicit PointTable(Recipe recipe);

  const Recipe& recipe() const { return recipe_; }
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

/// Value i of an axis. A range has its two ends exactly; the values between are equally spaced, and
/// the same bits on every machine. Throws std::out_of_range for a value that the axis does not
/// have.
double axis_value(const Axis& axis, std::uint64_t i);

/// Numbers of the values of a range that tell whether all of them are allowed. Every key allows an
/// interval, for which the two ends are enough, or the whole numbers of one: when the first two
/// values are whole their distance is, and so are all.
std::vector<std::uint64_t> deciding_values(const Axis& axis);

/// Number of values of an axis.
std::uint64_t axis_size(const Axis& axis);

/// Every parameter of a model.
ModelParameters to_message(const solver::ModelParameters& model);
/// Throws solver::InputError when the message is outside the model's domain.
solver::ModelParameters from_message(const ModelParameters& message);

/// What solving a point gave, but for H, mu and e, which follow from the point's number.
PointResult to_message(std::uint64_t point, const solver::CaseResult& result);
/// A failed point. An empty reason becomes "unknown".
PointResult failed_point(std::uint64_t point, const std::string& reason);

}  // namespace oblique::protocol
