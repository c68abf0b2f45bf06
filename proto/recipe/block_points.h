#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/expressions/expression.h"
#include "proto/recipe/sampling/distribution.h"
#include "proto/recipe/sampling/sample.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// What an axis with a distribution is drawn from. Of one that was judged, or whose distribution is
/// sound but for its ends' being allowed.
sampling::Distribution distribution_of(const Axis& axis);

/// For the beginning of a sentence: `I = "A^2 / (4 * pi)"`.
std::string expression_in_words(std::string_view key, const std::string& text);

/// The points of one block of any kind, one after another: its values by the number of the point
/// alone. Not thread-safe, and no part of it outlives the block.
class BlockPoints {
 public:
  /// Of a block whose axes were judged each by itself. Throws solver::InputError for an expression
  /// or a filter that is none, asks for unknown names, or goes round in a circle. `base`: the model
  /// where the block says nothing.
  BlockPoints(const solver::ModelParameters& base, const Block& block);

  std::uint64_t points() const { return points_; }
  /// Number of models of the block. Those of a product follow its model axes; where a model depends
  /// on what every point has of its own, there are as many as points.
  std::uint64_t models() const { return models_; }
  /// Goes to a point. Neighbours are cheap: what they share is not computed again; the point that
  /// is there costs nothing.
  void go_to(std::uint64_t point);

  /// Of the point that was gone to: the values of the axes in their order, as they come. Those of
  /// expressions may be outside their keys' ranges, or no numbers at all.
  std::span<const double> values() const { return values_; }
  /// Of that point: whether the filter leaves it in. One that is no number leaves nothing in.
  bool is_left_in();
  /// Of that point: its model, in which a value that is not allowed is that of `base`.
  solver::ModelParameters model() const;
  /// Of that point: why it cannot be solved, or that its filter has no value, as a sentence with
  /// the values; empty: nothing is wrong.
  std::string fault();

 private:
  /// An axis whose value follows from a number: that of the point, or of the value in its axis.
  struct Source {
    std::uint64_t stride = 1;
    std::uint64_t values = 1;                // 0: drawn
    std::uint64_t last = ~std::uint64_t{0};  // number of the value that is there
    std::optional<RangeValues> range{};
    std::optional<sampling::Distribution> distribution{};
    std::uint32_t dimension = 0;  // of the sample
  };
  /// An expression, and where the values come from that it asks for.
  struct Formula {
    expressions::Expression expression;
    std::vector<std::size_t> inputs;  // axes, and after them the constants
    std::size_t axis;                 // whose value it gives; none of a filter
  };

  void add_source(std::size_t axis, std::uint32_t& dimensions);
  Formula formula_of(const std::string& text, std::size_t axis);
  std::size_t input_called(const std::string& name);
  void put_in_order(std::vector<Formula> formulas);
  void count_models();
  std::vector<bool> axes_behind(std::size_t axis) const;
  double value_from(Source& source, const Axis& axis, std::uint64_t point) const;
  double result_of(Formula& formula);
  double filter_value();
  std::string values_in_words() const;

  const solver::ModelParameters& base_;
  const Block& block_;
  std::vector<std::size_t> keys_;  // of the axes
  sampling::Sample sample_;
  std::vector<Source> sources_;    // of the axes; of those that follow unused
  std::vector<Formula> formulas_;  // in an order in which each has what it asks for
  std::optional<Formula> filter_;
  std::vector<double> values_;            // of the axes
  std::uint64_t at_ = ~std::uint64_t{0};  // the point that was gone to
  std::optional<double> filter_value_;    // of that point, once it was asked for
  std::vector<double> constants_;         // of the base model
  std::vector<double> inputs_;            // of the formula being computed
  std::uint64_t points_ = 0;
  std::uint64_t models_ = 1;
};

}  // namespace oblique::protocol
