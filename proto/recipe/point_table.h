#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
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

/// The points and models of one block.
struct BlockPlace {
  std::uint64_t first_point;
  std::uint64_t points;  ///< point numbers, with those that the filter leaves out
  std::uint64_t first_model;
  std::uint64_t models;
  bool is_judged_by_points;  ///< see checks.h
};

/// A checked recipe: point i and model j as functions of their numbers, in time and memory that do
/// not grow with the number of points. Threads may share it once it is const.
class PointTable {
 public:
  /// Throws solver::InputError naming key, value and what is allowed for a recipe without a model
  /// or blocks, for too many points or expressions, and for what `check_block` refuses. `survey`
  /// judges the rest.
  explicit PointTable(Recipe recipe);
  ~PointTable();
  PointTable(PointTable&&) noexcept;
  PointTable(const PointTable&) = delete;
  PointTable& operator=(PointTable&&) = delete;
  PointTable& operator=(const PointTable&) = delete;

  const Recipe& recipe() const { return *recipe_; }
  /// Whether results are to have estimated errors.
  bool wants_errors() const { return recipe_->errors(); }
  std::uint64_t size() const { return points_; }  ///< number of point numbers
  std::uint64_t models() const { return models_; }

  /// Number of points that filters leave in. Of a filter that was not counted all points count.
  std::uint64_t points() const;
  bool has_filter() const { return has_filter_; }
  bool is_left_in(std::uint64_t index) const;
  /// The first point of [begin, end) that is left in, or `end`. Throws std::out_of_range for an end
  /// beyond the last point.
  std::uint64_t first_left_in(std::uint64_t begin, std::uint64_t end) const;

  /// Whether there are filters to count or values that only points tell.
  bool needs_survey() const;
  /// Evaluates every point of such blocks: writes into the recipe how many points filters leave in,
  /// and checks values. Takes about a second for 10^7 points. Returns false when `goes_on` returns
  /// false; the next call continues. Throws solver::InputError naming block, point and values for a
  /// value that is not allowed, a filter over more than `kMostCounted` points, and a filter that
  /// leaves nothing in. Larger blocks without a filter are skipped: their points may fail
  /// (`fault`).
  bool survey(const std::function<bool()>& goes_on);
  static constexpr std::uint64_t kMostCounted = 100'000'000;

  /// Why a point cannot be solved, as a sentence, or an empty text.
  std::string fault(std::uint64_t index) const;

  /// Throw std::out_of_range for a point or model outside the study. A value that is not finite
  /// reads as 0; a model value that is not allowed as that of the recipe's model.
  Point point(std::uint64_t index) const;
  solver::ModelParameters model(std::uint64_t index) const;
  /// The longest run of points around `index` that share its model. Adjacent blocks without model
  /// axes are one run, so that a study of many small blocks is leased and solved like a large
  /// block.
  Segment segment_at(std::uint64_t index) const;

  /// Throw std::out_of_range for a block or point outside the study.
  const BlockPlace& block(std::size_t number) const { return blocks_.at(number); }
  std::size_t block_of_point(std::uint64_t index) const;

 private:
  class Pool;

  void add_block(const Block& block);
  template <typename Act>
  auto in_block(std::size_t number, Act act) const;
  bool survey_block(std::size_t number, const std::function<bool()>& goes_on);
  const Block& message(std::size_t block) const { return recipe_->blocks(static_cast<int>(block)); }

  std::unique_ptr<Recipe> recipe_;  ///< stays where it is when the table moves
  solver::ModelParameters base_model_;
  std::vector<BlockPlace> blocks_;
  std::vector<Segment> base_segments_;     ///< of the blocks without model axes, in order
  std::vector<std::size_t> model_blocks_;  ///< blocks that bring models of their own, in order
  std::optional<std::uint64_t> base_model_number_;  ///< shared by all blocks without model axes
  std::uint64_t points_ = 0;
  std::uint64_t models_ = 0;
  std::size_t expressions_ = 0;
  bool has_filter_ = false;
  struct Surveyed {
    std::size_t block = 0;
    std::uint64_t points = 0;  ///< of that block
    std::uint64_t left_in = 0;
  } surveyed_;  ///< where a survey goes on
  std::unique_ptr<Pool> pool_;
};

}  // namespace oblique::protocol
