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
#include "proto/recipe/distribution.h"
#include "proto/recipe/expression.h"
#include "proto/recipe/sample.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// The beginning of a message about an expression: `I = "A^2 / (4 * pi)"`.
std::string expression_in_words(std::string_view key, const std::string& text);

/// The points of one block of any kind, each computed from its number. Not thread-safe. `base` and
/// `block` must outlive it.
class BlockPoints {
 public:
  /// The axes must have passed `check_axis`. `base` has the values of keys that the block does not
  /// have. Throws solver::InputError for an expression or filter that cannot be read, that has
  /// unknown names, or that depends on itself.
  BlockPoints(const solver::ModelParameters& base, const Block& block);

  std::uint64_t points() const { return points_; }
  /// Number of models: 1 if no model key varies, in a product the number of combinations of model
  /// axes, and the number of points if a model key depends on a value that varies with the point.
  std::uint64_t models() const { return models_; }

  /// Computes the values of a point. The functions below refer to it.
  void go_to(std::uint64_t point);

  /// The values in the order of the axes. Those of expressions may be out of range or NaN.
  std::span<const double> values() const { return values_; }
  /// Whether the filter keeps the point. A filter that is NaN does not.
  bool is_left_in();
  /// The model of the point. A value that is not allowed is replaced by that of `base`.
  solver::ModelParameters model() const;
  /// Why the point cannot be solved, or that its filter is NaN, as a sentence with the values;
  /// empty if nothing is wrong.
  std::string fault();

 private:
  /// Where the value of an axis without expression comes from.
  struct Source {
    AxisLayout layout;
    std::uint32_t dimension;  ///< dimension in the sample, if the axis is drawn
    std::optional<RangeValues> range{};
    std::optional<sampling::Quantiles> quantiles{};
    std::uint64_t last = ~std::uint64_t{0};  ///< index of the value that was computed last
  };
  /// An expression, the indices of its inputs in `values_` followed by `constants_`, and the axis
  /// of the result.
  struct Formula {
    expressions::Expression expression;
    std::vector<std::size_t> inputs;
    std::size_t axis;
  };

  Formula read_formula(std::string_view key, const std::string& text, std::size_t axis);
  std::size_t input_called(const std::string& name);
  void sort(std::vector<Formula> formulas);
  void count_models();
  double value_of(std::size_t axis, std::uint64_t point);
  double result_of(Formula& formula);
  double filter_value();
  std::string values_in_words() const;

  const solver::ModelParameters& base_;
  const Block& block_;
  std::vector<Source> sources_;    ///< one per axis
  std::vector<Formula> formulas_;  ///< each after those that compute its inputs
  std::optional<Formula> filter_;
  std::uint64_t at_ = ~std::uint64_t{0};
  std::vector<double> values_;
  std::optional<double> filter_value_;  ///< of the current point, once computed
  std::vector<double> constants_;       ///< inputs from the base model
  std::vector<double> inputs_;          ///< of the current formula
  std::uint64_t points_ = 0;
  std::uint64_t models_ = 1;
};

}  // namespace oblique::protocol
