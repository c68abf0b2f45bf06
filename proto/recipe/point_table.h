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

/// Most blocks, and most expressions, filters among them, that a study may have.
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
  std::uint64_t points = 0;  ///< including those that the filter leaves out
  std::uint64_t first_model = 0;
  std::uint64_t models = 0;
  bool needs_point_validation = false;  ///< see blocks.h
};

/// A checked recipe: point i and model j as functions of their numbers, in time and memory that do
/// not grow with the number of points. Threads may share it once it is const.
class PointTable {
 public:
  /// Throws solver::InputError for a recipe without a model or blocks, too many points, blocks or
  /// expressions, expressions with unknown names or circles, and for what `check_block` refuses.
  explicit PointTable(Recipe recipe);
  ~PointTable();
  PointTable(PointTable&&) noexcept;
  PointTable(const PointTable&) = delete;
  PointTable& operator=(PointTable&&) = delete;
  PointTable& operator=(const PointTable&) = delete;

  const Recipe& recipe() const { return *recipe_; }
  /// Whether the study requests estimated errors.
  bool wants_errors() const { return recipe_->errors(); }
  std::uint64_t size() const { return points_; }  ///< number of points, including left-out ones
  std::uint64_t models() const { return models_; }

  bool has_filter() const { return has_filter_; }
  /// Whether the filter keeps the point. A filter that is NaN does not.
  bool passes_filter(std::uint64_t index) const;
  /// The first point of [begin, end) that filters keep, or `end`.
  std::uint64_t first_passing(std::uint64_t begin, std::uint64_t end) const;

  /// Whether some values or filters can be checked only at points.
  bool needs_point_validation() const { return blocks_to_validate_ > 0; }
  /// Checks such blocks at all of their points, or at `kMaxValidated` random points of all blocks
  /// together (about 0.1 s). Throws solver::InputError with block and point for a value that is not
  /// allowed, and for a filter that leaves out all points of its block. A wrong value that was not
  /// found fails later (`fault`).
  void validate_points() const;
  static constexpr std::uint64_t kMaxValidated = 100'000;

  /// Why a point cannot be solved, or that its filter is NaN, as a sentence with the values; empty
  /// if nothing is wrong.
  std::string fault(std::uint64_t index) const;

  // The functions below throw std::out_of_range for a point, model or block outside the study.

  /// A value that is not finite becomes 0, a model value that is not allowed that of the recipe.
  Point point(std::uint64_t index) const;
  solver::ModelParameters model(std::uint64_t index) const;
  /// In the order of the axes of the point's block. Those of expressions may not be allowed.
  std::vector<double> values(std::uint64_t index) const;
  /// The longest run of points around `index` that share its model. Adjacent blocks without model
  /// axes are one run.
  Segment segment_at(std::uint64_t index) const;

  const BlockPlace& block(std::size_t number) const;
  std::size_t block_of_point(std::uint64_t index) const;

  /// Calls `visit` with the values of each of the first `points` points of a block, in the order of
  /// its axes. They need not be allowed. Throws solver::InputError for a wrong expression.
  static void visit_values(const solver::ModelParameters& base, const Block& block,
                           std::uint64_t points,
                           const std::function<void(std::span<const double>)>& visit);

 private:
  class BlockPoints;
  void add_block(const Block& block);

  std::unique_ptr<Recipe> recipe_;  ///< stays where it is when the table moves
  solver::ModelParameters base_model_;
  std::vector<BlockPoints> blocks_;
  std::vector<Segment> base_segments_;     ///< of the blocks without model axes, in order
  std::vector<std::size_t> model_blocks_;  ///< blocks with models of their own, in order
  std::uint64_t points_ = 0;
  std::uint64_t models_ = 0;
  std::size_t expressions_ = 0;
  std::uint64_t blocks_to_validate_ = 0;  ///< those that are judged by points
  bool has_filter_ = false;
};

// H, mu, e and the model of a point, as a worker sends them with a result. Two machines may compute
// them with different last bits.

/// Whether `value` equals the finite number `own` to within a relative difference of 1e-12. Only
/// zero is close to zero.
bool is_close(double value, double own);
/// Whether every parameter is close. Whole numbers must be equal.
bool is_close(const solver::ModelParameters& model, const solver::ModelParameters& own);
/// The same for the texts of two models (`canonical_model`), of which only `own` must be one.
bool is_close(std::string_view model, std::string_view own);

/// Sets the inputs of the result's point; the model only if the study has several.
void set_inputs(PointResult& result, const PointTable& table);

/// Why the inputs of a result are not those of its point in `table`, or an empty text. A failed
/// point may have none.
std::string fault_of_inputs(const PointResult& result, const PointTable& table);

/// The inputs of a result, or of its point in `table` when it has none.
Point inputs_of(const PointResult& result, const PointTable& table);

/// Number of points that a filter keeps: counted in blocks of up to 10^5 points, else estimated
/// from 10^4 random points.
struct PassingPoints {
  std::uint64_t points;
  bool estimated;
};

/// The size of a study.
struct StudySize {
  std::uint64_t points;   ///< points that filters keep
  bool points_estimated;  ///< `points` is estimated from random points
  std::uint64_t models;
  std::uint64_t falls;   ///< different falls
  bool falls_estimated;  ///< from 10^4 random points, because the study has more than 10^5
  std::uint64_t bytes;   ///< size in a database
  std::vector<std::uint64_t> examples;     ///< numbers of up to 64 random points
  std::vector<PassingPoints> blocks = {};  ///< of each block
};
StudySize size_of(const PointTable& table);

}  // namespace oblique::protocol
