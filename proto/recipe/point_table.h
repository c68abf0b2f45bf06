#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// Maximum number of blocks in a study, and maximum number of expressions including filters.
inline constexpr std::size_t kMaxBlocks = 10'000;
inline constexpr std::size_t kMaxExpressions = 1000;

/// One point of a study.
struct Point {
  std::uint64_t model;  ///< number of its model in the recipe
  double H_m;
  double mu;
  double e_star;
};

/// Consecutive points of a study that share a model.
struct Segment {
  std::uint64_t model;
  std::uint64_t first_point;
  std::uint64_t count;
};

/// The points and models of one block.
struct BlockPlace {
  std::uint64_t first_point = 0;
  std::uint64_t points = 0;  ///< includes points that the filter leaves out
  std::uint64_t first_model = 0;
  std::uint64_t models = 0;
  bool needs_point_validation = false;  ///< see blocks.h
};

/// A checked recipe. Computes point i and model j from their numbers, in time and memory that do
/// not depend on the number of points. Threads may share a const table.
class PointTable {
 public:
  /// Throws solver::InputError for a recipe without a model or blocks; for too many points, blocks
  /// or expressions; for expressions with unknown names or circular references; and for blocks that
  /// `check_block` refuses.
  explicit PointTable(Recipe recipe);
  ~PointTable();
  PointTable(PointTable&&) noexcept;
  PointTable(const PointTable&) = delete;
  PointTable& operator=(PointTable&&) = delete;
  PointTable& operator=(const PointTable&) = delete;

  const Recipe& recipe() const { return *recipe_; }
  /// Returns whether the study requests estimated errors.
  bool wants_errors() const { return recipe_->errors(); }
  std::uint64_t size() const { return points_; }  ///< includes points that filters leave out
  std::uint64_t models() const { return models_; }

  bool has_filter() const { return has_filter_; }
  /// Returns whether the filter includes the point. If the condition is NaN, it does not.
  bool passes_filter(std::uint64_t index) const;
  /// Returns the first point of [begin, end) that passes the filters, or `end`.
  std::uint64_t first_passing(std::uint64_t begin, std::uint64_t end) const;

  /// Returns whether `validate_points` has anything to check.
  bool has_points_to_validate() const { return blocks_to_validate_ > 0; }
  /// Checks blocks whose values or filter can only be checked point by point: all of their points,
  /// or `kMaxValidated` random points in all (about 0.1 s). Throws solver::InputError, with block
  /// and point, for a value that is not allowed, and for a filter that leaves out all points of its
  /// block. If a wrong value was not checked, its point fails later (`fault`).
  void validate_points() const;
  static constexpr std::uint64_t kMaxValidated = 100'000;

  /// Returns a sentence if the point cannot be solved or its filter is NaN; else an empty text.
  std::string fault(std::uint64_t index) const;

  // The functions below throw std::out_of_range if the study has no such point, model or block.

  /// Returns a point. Replaces a value that is not finite by 0, and a model value outside its
  /// domain by the value of the base model.
  Point point(std::uint64_t index) const;
  solver::ModelParameters model(std::uint64_t index) const;
  /// Returns a point's values in the order of its block's axes. Values of expressions may be
  /// outside the domain.
  std::vector<double> values(std::uint64_t index) const;
  /// Returns the longest run of consecutive points around `index` that have the same model.
  /// Adjacent blocks without model axes are one run.
  Segment segment_at(std::uint64_t index) const;

  const BlockPlace& block(std::size_t number) const;
  std::size_t block_of_point(std::uint64_t index) const;

  /// Calls `visit` with the values of each of the first `points` points of a block, in the order of
  /// its axes. The values may be outside the domain. Throws solver::InputError for a wrong
  /// expression.
  static void visit_values(const solver::ModelParameters& base, const Block& block,
                           std::uint64_t points,
                           const std::function<void(std::span<const double>)>& visit);

 private:
  class BlockPoints;
  void add_block(const Block& block);

  std::unique_ptr<Recipe> recipe_;  ///< on the heap: a moved table keeps the recipe's address
  solver::ModelParameters base_model_;
  std::vector<BlockPoints> blocks_;
  std::vector<Segment> base_segments_;     ///< runs of consecutive blocks without model axes
  std::vector<std::size_t> model_blocks_;  ///< indices of the blocks with model axes, in order
  std::uint64_t points_ = 0;
  std::uint64_t models_ = 0;
  std::size_t expressions_ = 0;
  std::uint64_t blocks_to_validate_ = 0;  ///< number of blocks that must be checked point by point
  bool has_filter_ = false;
};

// These functions handle the inputs of a point (H, mu, e and the model). A worker sends its inputs
// with a result. They may differ in the last bits from the inputs that the server computes.

/// Returns whether `value` equals the finite number `own` within a relative difference of 1e-12.
/// Only zero is close to zero.
bool is_close(double value, double own);
/// Returns whether all parameters of two models are close. Whole numbers must be equal.
bool is_close(const solver::ModelParameters& model, const solver::ModelParameters& own);
/// Returns whether two canonical texts of models are close. `model` may be any text.
bool is_close(std::string_view model, std::string_view own);

/// Sets the inputs of the result's point. The model is set only in studies with several models.
void set_inputs(PointResult& result, const PointTable& table);

/// Returns why the inputs of a result differ from the inputs of its point in `table`, or an empty
/// text. The result of a failed point may have no inputs.
std::string fault_of_inputs(const PointResult& result, const PointTable& table);

/// Returns a reply with the inputs of a point and without a trace. Throws std::runtime_error if the
/// study has no such point or a fault excludes it.
TraceReply point_reply(const PointTable& table, std::uint64_t point);

/// Returns the inputs of a result. If it has none, returns the inputs of its point in `table`.
Point inputs_of(const PointResult& result, const PointTable& table);

/// Number of points of a block that pass its filter. Up to 10^5 points are counted; for larger
/// blocks the number is estimated from 10^4 random points.
struct PassingPoints {
  std::uint64_t points;
  bool estimated;
};

/// The size of a study.
struct StudySize {
  std::uint64_t points;   ///< number of points that pass the filters
  bool points_estimated;  ///< true if `points` is estimated from random points
  std::uint64_t models;
  std::uint64_t falls;   ///< number of different falls
  bool falls_estimated;  ///< true if `falls` is estimated from random points of a large study
  std::uint64_t bytes;   ///< size of the results in a database [bytes]
  std::vector<std::uint64_t> examples;     ///< up to 64 random points that pass the filters
  std::vector<PassingPoints> blocks = {};  ///< one element per block
};
StudySize size_of(const PointTable& table);

}  // namespace oblique::protocol
