#include "proto/recipe/point_table.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/expression.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/sampling.h"
#include "proto/text.h"
#include "worker/solver/model/fall_model.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

using solver::InputError;

/// Rows and messages contain finite values only.
double finite_or_0(double value) {
  return std::isfinite(value) ? value : 0.0;
}

/// The last of the sorted `places` whose `first` is at most `number`; there is one.
template <class Place, class Number>
std::size_t place_of(const std::vector<Place>& places, std::uint64_t number, const Number& first) {
  const auto next = std::upper_bound(
      places.begin(), places.end(), number,
      [&](std::uint64_t wanted, const Place& place) { return wanted < first(place); });
  return static_cast<std::size_t>(next - places.begin()) - 1;
}

/// Calls `work`. An InputError that it throws gets the key and the expression.
template <typename Work>
auto in_expression(std::string_view key, std::string_view text, Work work) {
  try {
    return work();
  } catch (const InputError& error) {
    throw InputError(
        {.text = error.fields().text, .key = std::string(key), .expression = excerpt(text)});
  }
}

}  // namespace

/// The points of one block of any kind, each computed from its number.
class PointTable::BlockPoints {
 public:
  /// `block` has passed `check_block` and outlives this. `base` has the values of keys that the
  /// block does not have.
  BlockPoints(const solver::ModelParameters& base, const Block& block);

  /// Number of models: 1 if no model key varies, in a product the number of combinations of model
  /// axes, and the number of points if a model key depends on a value that varies with the point.
  std::uint64_t models() const { return models_; }
  std::size_t expressions() const { return formulas_.size() + (filter_ ? 1 : 0); }

  /// The values of a point in the order of the axes, and those of `base` that expressions use. The
  /// functions below take them.
  std::vector<double> values_at(std::uint64_t point) const;
  bool is_left_in(std::span<const double> values) const;
  solver::ModelParameters model(solver::ModelParameters base, std::span<const double> values) const;
  /// Why the point cannot be solved, with the values; none if it can be.
  std::optional<InputError> fault(const solver::ModelParameters& base,
                                  std::span<const double> values) const;
  /// H, mu and e.
  std::span<const double> point_values(std::span<const double> values) const {
    return values.subspan(sources_.size() - kPointKeyOrder.size(), kPointKeyOrder.size());
  }

 private:
  /// Where the value of an axis comes from.
  struct Source {
    AxisLayout layout;
    std::uint32_t dimension;  ///< dimension in the sample, if the axis is drawn
    std::variant<std::monostate, RangeValues, sampling::Quantiles> values = {};
  };
  /// An expression, the numbers of its inputs in `values_at`, and the axis of the result.
  struct Formula {
    expressions::Expression expression;
    std::vector<std::size_t> inputs;
    std::size_t axis;
  };

  Formula read_formula(const solver::ModelParameters& base, std::string_view key,
                       const std::string& text, std::size_t axis);
  std::size_t input_called(const solver::ModelParameters& base, const std::string& name);
  std::size_t axis_of(std::size_t key) const;
  void sort(std::vector<Formula> formulas);
  void count_models();
  double value_of(const Source& source, std::uint64_t point) const;
  std::string in_words(std::span<const double> values) const;

  const Block* block_;
  std::vector<Source> sources_;    ///< one per axis
  std::vector<Formula> formulas_;  ///< each after those that compute its inputs
  std::optional<Formula> filter_;
  std::vector<double> constants_;  ///< inputs from the base model
  std::uint64_t models_ = 1;
};

PointTable::BlockPoints::BlockPoints(const solver::ModelParameters& base, const Block& block)
    : block_(&block) {
  std::uint32_t dimensions = 0;
  for (const AxisLayout& layout : layout_of(block)) {
    Source& source = sources_.emplace_back(Source{layout, layout.values == 0 ? dimensions++ : 0});
    if (layout.axis->count() > 0) {
      source.values.emplace<RangeValues>(*layout.axis);
    } else if (layout.axis->has_distribution()) {
      source.values.emplace<sampling::Quantiles>(*layout.axis);
    }
  }
  std::vector<Formula> formulas;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (const Axis& axis = *sources_[i].layout.axis; !axis.expression().empty()) {
      formulas.push_back(read_formula(base, axis.key(), axis.expression(), i));
    }
  }
  sort(std::move(formulas));
  if (!block.where().empty()) {
    filter_ = read_formula(base, "where", block.where(), sources_.size());
  }
  count_models();
}

PointTable::BlockPoints::Formula PointTable::BlockPoints::read_formula(
    const solver::ModelParameters& base, std::string_view key, const std::string& text,
    std::size_t axis) {
  return in_expression(key, text, [&] {
    Formula formula{expressions::Expression(text), {}, axis};
    for (const std::string& name : formula.expression.names()) {
      formula.inputs.push_back(input_called(base, name));
    }
    formula.expression.place_names(formula.inputs);
    return formula;
  });
}

std::size_t PointTable::BlockPoints::axis_of(std::size_t key) const {
  const auto found = std::find_if(sources_.begin(), sources_.end(),
                                  [&](const Source& source) { return source.layout.key == key; });
  return static_cast<std::size_t>(found - sources_.begin());
}

/// The axis of that name, or a new constant of the base model.
std::size_t PointTable::BlockPoints::input_called(const solver::ModelParameters& base,
                                                  const std::string& name) {
  const std::size_t key = key_number(name);
  const auto link = link_of_key(key);
  std::size_t axis = axis_of(key);
  if (axis == sources_.size() && link) {
    axis = axis_of(key_number("length"));  // sets the length of every link
  }
  if (axis < sources_.size()) {
    return axis;
  }
  double constant = key_numbered(key).get(base);
  if (link && axis_of(key_number("links")) < sources_.size()) {
    constant = base.lengths_m.front();  // `links` makes all of them as long as the first
  } else if (link && *link >= base.lengths_m.size()) {
    throw InputError(fmt::format("`{}` is the length of no link: the model has {}", name,
                                 base.lengths_m.size()));
  }
  constants_.push_back(constant);
  return sources_.size() + constants_.size() - 1;
}

void PointTable::BlockPoints::sort(std::vector<Formula> formulas) {
  while (!formulas.empty()) {
    // The first formula whose inputs are all computed.
    const auto next = std::find_if(formulas.begin(), formulas.end(), [&](const Formula& formula) {
      return std::none_of(formulas.begin(), formulas.end(), [&](const Formula& other) {
        return std::find(formula.inputs.begin(), formula.inputs.end(), other.axis) !=
               formula.inputs.end();
      });
    });
    if (next == formulas.end()) {
      std::vector<std::string_view> circle;
      for (const Formula& formula : formulas) {
        circle.emplace_back(sources_[formula.axis].layout.axis->key());
      }
      throw InputError(
          circle.front(),
          fmt::format(
              "{}: the expressions go round in a circle: one must follow from keys that do not",
              fmt::join(circle, ", ")));
    }
    formulas_.push_back(std::move(*next));
    formulas.erase(next);
  }
}

void PointTable::BlockPoints::count_models() {
  const bool is_product = block_kind(*block_) == BlockKind::kProduct;
  std::vector<bool> varies;  // whether the axis varies within one combination of model axes
  for (const Source& source : sources_) {
    varies.push_back(is_drawn(*source.layout.axis) &&
                     (!is_product || is_point_key(source.layout.key)));
  }
  for (const Formula& formula : formulas_) {
    varies[formula.axis] =
        std::any_of(formula.inputs.begin(), formula.inputs.end(),
                    [&](std::size_t input) { return input < varies.size() && varies[input]; });
  }
  const auto model_axes_end = varies.end() - std::ssize(kPointKeyOrder);
  if (std::find(varies.begin(), model_axes_end, true) != model_axes_end) {
    models_ = points_of_block(*block_);
  } else if (is_product) {
    models_ = combinations(model_axes(*block_));
  }
}

std::vector<double> PointTable::BlockPoints::values_at(std::uint64_t point) const {
  std::vector<double> values(sources_.size());
  values.insert(values.end(), constants_.begin(), constants_.end());
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (sources_[i].layout.axis->expression().empty()) {
      values[i] = value_of(sources_[i], point);
    }
  }
  for (const Formula& formula : formulas_) {
    values[formula.axis] = formula.expression.value_at(values);
  }
  return values;
}

double PointTable::BlockPoints::value_of(const Source& source, std::uint64_t point) const {
  const AxisLayout& layout = source.layout;
  std::uint64_t number = 0;
  if (layout.values == 0) {
    const double part = sampling::fraction(block_->sample(), source.dimension, point);
    if (const auto* quantiles = std::get_if<sampling::Quantiles>(&source.values)) {
      return quantiles->value_at(part);
    }
    const std::uint64_t values = axis_size(*layout.axis);
    number = std::min(static_cast<std::uint64_t>(part * static_cast<double>(values)), values - 1);
  } else if (layout.values > 1) {
    number = point / layout.stride % layout.values;
  }
  const auto* range = std::get_if<RangeValues>(&source.values);
  return range != nullptr ? range->at(number) : layout.axis->values(static_cast<int>(number));
}

bool PointTable::BlockPoints::is_left_in(std::span<const double> values) const {
  const double kept = filter_ ? filter_->expression.value_at(values) : 1.0;
  return !std::isnan(kept) && kept != 0.0;
}

solver::ModelParameters PointTable::BlockPoints::model(solver::ModelParameters base,
                                                       std::span<const double> values) const {
  for (const bool are_single : {false, true}) {  // single lengths act on what `links` has made
    for (std::size_t i = sources_.size() - kPointKeyOrder.size(); i-- > 0;) {
      const std::size_t number = sources_[i].layout.key;
      const solver::ParameterKey& key = key_numbered(number);
      if (link_of_key(number).has_value() == are_single && std::isfinite(values[i]) &&
          key.is_allowed(values[i])) {
        key.set(base, values[i]);
      }
    }
  }
  return base;
}

std::optional<InputError> PointTable::BlockPoints::fault(const solver::ModelParameters& base,
                                                         std::span<const double> values) const {
  if (filter_ && std::isnan(filter_->expression.value_at(values))) {
    return InputError("where", "where has no value: " + in_words(values));
  }
  if (!is_left_in(values)) {
    return std::nullopt;
  }
  try {
    for (const Formula& formula : formulas_) {
      solver::check_value(key_numbered(sources_[formula.axis].layout.key), values[formula.axis]);
    }
    const auto point = point_values(values);
    solver::validate_point(model(base, values), point[0], point[1], point[2]);
  } catch (const InputError& error) {
    const auto& fields = error.fields();
    return InputError(fields.key, fields.text + ": " + in_words(values));
  }
  return std::nullopt;
}

/// "k = 1e7, H = 0.3, mu = 0.1, e = 1"
std::string PointTable::BlockPoints::in_words(std::span<const double> values) const {
  std::string words;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    words += fmt::format("{}{} = {}", words.empty() ? "" : ", ", sources_[i].layout.axis->key(),
                         solver::exact_number(values[i]));
  }
  return words;
}

/// Calls `act`. Its error gets the block's number, if there are several blocks.
template <typename Act>
void PointTable::in_block(std::size_t number, Act act) const {
  try {
    act();
  } catch (const InputError& error) {
    InputError::Fields fields = error.fields();
    if (recipe_->blocks_size() > 1) {
      fields.block = number;
    }
    throw InputError(std::move(fields));
  }
}

void visit_values(const solver::ModelParameters& base, const Block& block, std::uint64_t points,
                  const std::function<void(std::span<const double>)>& visit) {
  const PointTable::BlockPoints compiled(base, block);
  for (std::uint64_t i = 0; i < points; ++i) {
    visit(compiled.values_at(i));
  }
}

PointTable::PointTable(Recipe recipe) : recipe_(std::make_unique<Recipe>(std::move(recipe))) {
  if (!recipe_->has_model()) {
    throw InputError(
        "the recipe has no model: send all its parameters, for defaults change between versions");
  }
  base_model_ = from_message(recipe_->model());
  if (recipe_->blocks().empty()) {
    throw InputError("the study has no block: it needs at least one with H, mu and e");
  }
  if (static_cast<std::size_t>(recipe_->blocks_size()) > kMostBlocks) {
    throw InputError(
        fmt::format("the study has {} blocks, more than {}: write points that differ "
                    "in all values as a block with `zip`",
                    recipe_->blocks_size(), kMostBlocks));
  }
  for (const Block& block : recipe_->blocks()) {
    in_block(blocks_.size(), [&] { add_block(block); });
  }
}

PointTable::~PointTable() = default;
PointTable::PointTable(PointTable&&) noexcept = default;

void PointTable::add_block(const Block& block) {
  check_block(base_model_, block);
  const BlockPoints& compiled = block_points_.emplace_back(base_model_, block);
  expressions_ += compiled.expressions();
  if (expressions_ > kMostExpressions) {
    throw InputError(
        fmt::format("the study has more than {} expressions and filters", kMostExpressions));
  }
  const std::uint64_t points = points_of_block(block);
  if (points > kMaxPoints - points_) {
    throw_too_many_points();
  }
  BlockPlace place{points_, points, models_, compiled.models(),
                   is_judged_by_points(base_model_, block)};
  const bool has_base_model = model_axes(block).empty();
  if (!has_base_model || !base_model_number_) {
    model_blocks_.push_back(blocks_.size());
    models_ += place.models;
  }
  if (has_base_model) {
    base_model_number_ = place.first_model = base_model_number_.value_or(place.first_model);
    Segment* last = base_segments_.empty() ? nullptr : &base_segments_.back();
    if (last != nullptr && last->first_point + last->count == points_) {
      last->count += points;
    } else {
      base_segments_.push_back({place.first_model, points_, points});
    }
  }
  blocks_.push_back(place);
  has_filter_ = has_filter_ || !block.where().empty();
  points_ += points;
}

std::size_t PointTable::block_of_point(std::uint64_t index) const {
  if (index >= points_) {
    throw std::out_of_range(fmt::format("the study has no point {}", index));
  }
  return place_of(blocks_, index, [](const BlockPlace& place) { return place.first_point; });
}

std::vector<double> PointTable::values(std::uint64_t index) const {
  const std::size_t block = block_of_point(index);
  auto values = block_points_[block].values_at(index - blocks_[block].first_point);
  values.resize(static_cast<std::size_t>(recipe_->blocks(static_cast<int>(block)).axes_size()));
  return values;
}

Point PointTable::point(std::uint64_t index) const {
  const std::size_t block = block_of_point(index);
  const BlockPlace& place = blocks_[block];
  const std::uint64_t number = index - place.first_point;
  const auto all = block_points_[block].values_at(number);
  const auto values = block_points_[block].point_values(all);
  return {place.first_model + number / (place.points / place.models), finite_or_0(values[0]),
          finite_or_0(values[1]), finite_or_0(values[2])};
}

solver::ModelParameters PointTable::model(std::uint64_t index) const {
  if (index >= models_) {
    throw std::out_of_range(fmt::format("the study has no model {}", index));
  }
  const std::size_t block = model_blocks_[place_of(
      model_blocks_, index, [this](std::size_t number) { return blocks_[number].first_model; })];
  const BlockPlace& place = blocks_[block];
  const BlockPoints& points = block_points_[block];
  const std::uint64_t number = (index - place.first_model) * (place.points / place.models);
  return points.model(base_model_, points.values_at(number));
}

Segment PointTable::segment_at(std::uint64_t index) const {
  const BlockPlace& place = blocks_[block_of_point(index)];
  if (!base_segments_.empty() && base_segments_.front().first_point <= index) {
    const Segment& base = base_segments_[place_of(
        base_segments_, index, [](const Segment& segment) { return segment.first_point; })];
    if (index - base.first_point < base.count) {
      return base;
    }
  }
  const std::uint64_t points_per_model = place.points / place.models;
  const std::uint64_t model = (index - place.first_point) / points_per_model;
  return {place.first_model + model, place.first_point + model * points_per_model,
          points_per_model};
}

bool PointTable::is_left_in(std::uint64_t index) const {
  return !has_filter_ || first_left_in(index, index + 1) == index;
}

std::uint64_t PointTable::first_left_in(std::uint64_t begin, std::uint64_t end) const {
  while (has_filter_ && begin < end) {
    const std::size_t block = block_of_point(begin);
    const BlockPlace& place = blocks_[block];
    const BlockPoints& points = block_points_[block];
    for (const auto block_end = std::min(end, place.first_point + place.points); begin < block_end;
         ++begin) {
      if (points.is_left_in(points.values_at(begin - place.first_point))) {
        return begin;
      }
    }
  }
  return std::min(begin, end);
}

std::string PointTable::fault(std::uint64_t index) const {
  const std::size_t block = block_of_point(index);
  const BlockPoints& points = block_points_[block];
  if (!blocks_[block].is_judged_by_points) {
    return {};
  }
  const auto fault =
      points.fault(base_model_, points.values_at(index - blocks_[block].first_point));
  return fault ? fault->what() : "";
}

bool PointTable::needs_judging() const {
  return std::any_of(blocks_.begin(), blocks_.end(),
                     [](const BlockPlace& place) { return place.is_judged_by_points; });
}

void PointTable::judge_points() const {
  const auto judged = static_cast<std::uint64_t>(
      std::count_if(blocks_.begin(), blocks_.end(),
                    [](const BlockPlace& place) { return place.is_judged_by_points; }));
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (blocks_[i].is_judged_by_points) {
      in_block(i, [&] { judge_block(i, kMostJudged / judged); });
    }
  }
}

void PointTable::judge_block(std::size_t number, std::uint64_t most) const {
  const BlockPlace& place = blocks_[number];
  const BlockPoints& points = block_points_[number];
  const bool judges_all = place.points <= most;
  bool leaves_any_in = false;
  for (std::uint64_t look = 0; look < std::min(place.points, most); ++look) {
    const std::uint64_t i = judges_all ? look : sampling::hashed(number, look) % place.points;
    const auto values = points.values_at(i);
    if (const auto fault = points.fault(base_model_, values)) {
      throw InputError({.text = fault->fields().text,
                        .key = fault->fields().key,
                        .point = place.first_point + i});
    }
    leaves_any_in = leaves_any_in || points.is_left_in(values);
  }
  if (judges_all && !leaves_any_in) {
    in_expression("where", recipe_->blocks(static_cast<int>(number)).where(),
                  [] { throw InputError("it leaves no point in"); });
  }
}

bool is_close(double value, double own) {
  constexpr double kTolerance = 1e-12;  // relative; some thousand times the rounding of a double
  return std::abs(value - own) <= kTolerance * std::abs(own);
}

bool is_close(const solver::ModelParameters& model, const solver::ModelParameters& own) {
  const auto keys = solver::model_keys();
  return std::equal(model.lengths_m.begin(), model.lengths_m.end(), own.lengths_m.begin(),
                    own.lengths_m.end(), [](double a, double b) { return is_close(a, b); }) &&
         std::all_of(keys.begin(), keys.end(), [&](const solver::ParameterKey& key) {
           return is_close(key.get(model), key.get(own));
         });
}

void set_inputs(PointResult& result, const PointTable& table) {
  const Point point = table.point(result.point());
  result.set_h_m(point.H_m);
  result.set_mu(point.mu);
  result.set_e_star(point.e_star);
  if (table.models() > 1) {
    *result.mutable_model() = to_message(table.model(point.model));
  }
}

std::string fault_of_inputs(const PointResult& result, const PointTable& table) {
  if (!result.error().empty() && !result.has_h_m()) {
    return {};
  }
  const Point own = table.point(result.point());
  for (const auto& [key, is_sent, value, expected] :
       {std::tuple{"H", result.has_h_m(), result.h_m(), own.H_m},
        {"mu", result.has_mu(), result.mu(), own.mu},
        {"e", result.has_e_star(), result.e_star(), own.e_star}}) {
    if (!is_sent || !is_close(value, expected)) {
      return fmt::format("the worker solved it with {} = {:.17g}, and the study has {:.17g}", key,
                         value, expected);
    }
  }
  // A result without a model is of a study that had one model when it was solved, but may have
  // grown since.
  bool has_model = !result.has_model() && own.model == 0;
  try {
    has_model = has_model || (result.has_model() && is_close(unjudged_from_message(result.model()),
                                                             table.model(own.model)));
  } catch (const InputError&) {  // a whole number outside the domain
  }
  return has_model ? "" : "the worker solved it with another model than the study has";
}

Point inputs_of(const PointResult& result, const PointTable& table) {
  return result.has_h_m() ? Point{table.segment_at(result.point()).model, result.h_m(), result.mu(),
                                  result.e_star()}
                          : table.point(result.point());
}

namespace {

/// Average size of a result and of a model in a database (server/store/README.md).
constexpr std::uint64_t kBytesAResult = 970;
constexpr std::uint64_t kBytesAModel = 600;

/// More points than the first are not counted, but estimated from as many random points as the
/// second.
constexpr std::uint64_t kMostCounted = 100'000;
constexpr std::uint64_t kLooks = 10'000;

/// Number of examined points by the hash of their fall.
using MetFalls = std::unordered_map<std::uint64_t, std::uint64_t>;

/// Estimates the number of falls of `points` points after `looks` of them were examined (Good
/// 1953): the share of points whose fall was met is about that of examined points whose fall was
/// met twice.
std::uint64_t estimated_falls(const MetFalls& met, double looks, double points) {
  const auto once =
      std::count_if(met.begin(), met.end(), [](const auto& fall) { return fall.second == 1; });
  const double share_met = 1.0 - static_cast<double>(once) / looks;
  return static_cast<std::uint64_t>(
      share_met > 0.0 ? std::min(static_cast<double>(met.size()) / share_met, points) : points);
}

}  // namespace

StudySize size_of(const PointTable& table) {
  constexpr std::uint64_t kTries = 100 * kLooks;
  constexpr std::uint64_t kExamples = 64;
  const std::uint64_t numbers = table.size();
  StudySize size{0, false, table.models(), 0, false, 0, {}};
  for (int i = 0; i < table.recipe().blocks_size(); ++i) {
    const PointsLeftIn left_in = points_left_in(table, static_cast<std::size_t>(i));
    size.points += left_in.points;
    size.points_estimated = size.points_estimated || left_in.estimated;
  }
  size.bytes = kBytesAResult * size.points + kBytesAModel * std::min(size.models, size.points);
  MetFalls met;
  std::uint64_t looks = 0;
  std::optional<std::uint64_t> model;  // of the last point; `fall` is its fall
  std::uint64_t fall = 0;
  const auto look_at = [&](std::uint64_t point) {
    if (const auto next = table.point(point).model; next != model) {
      model = next;
      fall = solver::fall_hash(table.model(next));
    }
    ++met[fall];
    ++looks;
    if (size.examples.size() < kExamples) {
      size.examples.push_back(point);
    } else if (const auto place = sampling::hashed(1, looks) % looks; place < kExamples) {
      size.examples[place] = point;
    }
  };
  if (numbers <= kMostCounted) {
    for (std::uint64_t i = 0; (i = table.first_left_in(i, numbers)) < numbers; ++i) {
      look_at(i);
    }
    size.falls = met.size();
    return size;
  }
  for (std::uint64_t i = 0; i < kTries && looks < kLooks; ++i) {
    if (const auto point = sampling::hashed(0, i) % numbers; table.is_left_in(point)) {
      look_at(point);
    }
  }
  if (looks == 0) {
    look_at(0);  // the filter keeps few points or none
  }
  size.falls = estimated_falls(met, static_cast<double>(looks), static_cast<double>(size.points));
  size.falls_estimated = size.falls != met.size();
  return size;
}

PointsLeftIn points_left_in(const PointTable& table, std::size_t block) {
  const BlockPlace& place = table.block(block);
  if (table.recipe().blocks(static_cast<int>(block)).where().empty()) {
    return {place.points, false};
  }
  const bool counts_all = place.points <= kMostCounted;
  const std::uint64_t looks = counts_all ? place.points : kLooks;
  std::uint64_t found = 0;
  for (std::uint64_t look = 0; look < looks; ++look) {
    const std::uint64_t i = counts_all ? look : sampling::hashed(2, look) % place.points;
    found += table.is_left_in(place.first_point + i) ? 1U : 0U;
  }
  const double share = static_cast<double>(found) / static_cast<double>(looks);
  return {
      counts_all ? found : static_cast<std::uint64_t>(share * static_cast<double>(place.points)),
      !counts_all};
}

}  // namespace oblique::protocol
