#include "proto/recipe/point_table.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <random>
#include <span>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/expression.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/sampling.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {
namespace {

using solver::InputError;

double finite_or_0(double value) {
  return std::isfinite(value) ? value : 0.0;
}

/// Returns the index of the last of the sorted `places` whose `first` is at most `number`. There
/// must be such a place.
template <class Place, class Number>
std::size_t place_of(const std::vector<Place>& places, std::uint64_t number, const Number& first) {
  const auto next = std::upper_bound(
      places.begin(), places.end(), number,
      [&](std::uint64_t wanted, const Place& place) { return wanted < first(place); });
  return static_cast<std::size_t>(next - places.begin()) - 1;
}

/// Calls `work`. If that throws an InputError, adds the key and the expression to the error.
template <typename Work>
auto in_expression(std::string_view key, std::string_view text, Work work) {
  try {
    return work();
  } catch (const InputError& error) {
    throw InputError(
        {.text = error.fields().text, .key = std::string(key), .expression = excerpt(text)});
  }
}

/// Calls `act`. Adds the block's number to an InputError if the recipe has several blocks.
template <typename Act>
void in_block(const Recipe& recipe, std::size_t number, Act act) {
  try {
    act();
  } catch (const InputError& error) {
    InputError::Fields fields = error.fields();
    if (recipe.blocks_size() > 1) {
      fields.block = number;
    }
    throw InputError(std::move(fields));
  }
}

/// Calls `act` with every number below `points`, or with `tries` random ones if `points` exceeds
/// `most`. Returns whether `act` was called with every number.
template <typename Act>
bool for_each_or_some(std::uint64_t points, std::uint64_t most, std::uint64_t tries,
                      std::uint64_t seed, Act act) {
  const bool takes_all = points <= most;
  for (std::uint64_t i = 0; i < (takes_all ? points : tries); ++i) {
    act(takes_all ? i : sampling::hashed(seed, i) % points);
  }
  return takes_all;
}

}  // namespace

/// Computes the points of one block of any kind from their numbers.
class PointTable::BlockPoints : public BlockPlace {
 public:
  /// `block` must have passed `check_block`, and must outlive this object. `base` has the values of
  /// keys that the block lacks.
  BlockPoints(const solver::ModelParameters& base, const Block& block)
      : BlockPlace{.points = points_of_block(block)}, block_(&block) {
    std::uint32_t dimensions = 0;
    for (const AxisLayout& layout : layout_of(block)) {
      Source& source = sources_.emplace_back(Source{layout, layout.values == 0 ? dimensions++ : 0});
      if (layout.axis->count() > 0) {
        source.range.emplace(*layout.axis);
      } else if (layout.axis->has_distribution()) {
        source.quantiles.emplace(*layout.axis);
      }
    }
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      if (const Axis& axis = *sources_[i].layout.axis; !axis.expression().empty()) {
        formulas_.push_back(read_formula(base, axis.key(), axis.expression(), i));
      }
    }
    sort();
    if (!block.where().empty()) {
      filter_ = read_formula(base, "where", block.where(), sources_.size());
    }
    models = points / counted_points_per_model();
  }

  std::size_t expressions() const { return formulas_.size() + (filter_ ? 1 : 0); }

  const Block& definition() const { return *block_; }
  std::uint64_t points_per_model() const { return points / models; }

  /// Returns the values of a point in the order of the axes. The functions below need these values.
  std::vector<double> values_at(std::uint64_t point) const {
    std::vector<double> values(sources_.size());
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

  bool passes_filter(std::span<const double> values) const {
    const double kept = filter_ ? filter_->expression.value_at(values) : 1.0;
    return !std::isnan(kept) && kept != 0.0;
  }

  solver::ModelParameters model(solver::ModelParameters base,
                                std::span<const double> values) const {
    // Sets `links` and `length` before the lengths of single links.
    for (const bool are_single : {false, true}) {
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

  /// Returns why the point cannot be solved, and names its values; nothing if it can be solved.
  std::optional<InputError> fault(const solver::ModelParameters& base,
                                  std::span<const double> values) const {
    if (filter_ && std::isnan(filter_->expression.value_at(values))) {
      return InputError("where", "where is not a number: " + in_words(values));
    }
    if (!passes_filter(values)) {
      return std::nullopt;
    }
    try {
      for (const Formula& formula : formulas_) {
        solver::check_value(key_numbered(sources_[formula.axis].layout.key), values[formula.axis]);
      }
      const auto point = values.last<kPointKeyOrder.size()>();
      solver::validate_point(model(base, values), point[0], point[1], point[2]);
    } catch (const InputError& error) {
      return InputError(error.fields().key, error.fields().text + ": " + in_words(values));
    }
    return std::nullopt;
  }

 private:
  /// The source of an axis's values. A list has neither `range` nor `quantiles`.
  struct Source {
    AxisLayout layout;
    std::uint32_t dimension;  ///< number of the axis among the drawn axes of the sample
    std::optional<RangeValues> range = {};
    std::optional<sampling::Quantiles> quantiles = {};
  };
  struct Formula {
    expressions::Expression expression;
    std::vector<std::size_t> inputs;
    std::size_t axis;
  };

  Formula read_formula(const solver::ModelParameters& base, std::string_view key,
                       const std::string& text, std::size_t axis) {
    return in_expression(key, text, [&] {
      std::vector<std::size_t> inputs;
      const bool has_lengths =
          std::ranges::count(base.lengths_m, base.lengths_m.front()) < std::ssize(base.lengths_m) ||
          std::ranges::any_of(sources_,
                              [](const auto& s) { return link_of_key(s.layout.key).has_value(); });
      expressions::Expression expression(text, [&](std::string_view name) {
        // The columns of these keys are a text, and NULL if the lengths of links differ.
        if (key == "where" && (name == "integrator" || (name == "length" && has_lengths))) {
          throw InputError(fmt::format("`{}` has no number here", name));
        }
        const auto meaning = meaning_of(base, name);
        if (const auto* axis_of_name = std::get_if<std::size_t>(&meaning)) {
          inputs.push_back(*axis_of_name);
        }
        return meaning;
      });
      return Formula{std::move(expression), std::move(inputs), axis};
    });
  }

  /// Returns the axis of that name, or the constant that the base model has for it.
  std::variant<std::size_t, double> meaning_of(const solver::ModelParameters& base,
                                               std::string_view name) const {
    const auto axis_of = [this](std::size_t key) {
      const auto found = std::find_if(sources_.begin(), sources_.end(), [&](const Source& source) {
        return source.layout.key == key;
      });
      return static_cast<std::size_t>(found - sources_.begin());
    };
    const std::size_t key = key_number(name);
    const auto link = link_of_key(key);
    std::size_t axis = axis_of(key);
    if (axis == sources_.size() && link) {
      axis = axis_of(key_number("length"));  // `length` sets the length of every link
    }
    if (axis < sources_.size()) {
      return axis;
    }
    if (link && axis_of(key_number("links")) < sources_.size()) {
      return base.lengths_m.front();  // `links` copies the length of the first link to all links
    }
    if (link && *link >= base.lengths_m.size()) {
      throw InputError(
          fmt::format("`{}` is not a key: the model has {} links", name, base.lengths_m.size()));
    }
    return key_numbered(key).get(base);
  }

  /// Returns the number of consecutive points with the same model. It is 1 if a model key may
  /// change from point to point. Otherwise, in a product with model axes, it is the number of
  /// combinations of H, mu and e. In other blocks it is the number of all points.
  std::uint64_t counted_points_per_model() const {
    const bool is_product = block_kind(*block_) == BlockKind::kProduct;
    std::vector<bool> varies;  // by axis: whether it varies (in a product: at fixed model axes)
    for (const Source& source : sources_) {
      varies.push_back(is_drawn(*source.layout.axis) &&
                       (!is_product || is_point_key(source.layout.key)));
    }
    for (const Formula& formula : formulas_) {
      varies[formula.axis] = std::any_of(formula.inputs.begin(), formula.inputs.end(),
                                         [&](std::size_t input) -> bool { return varies[input]; });
    }
    const auto model_axes_end = varies.end() - std::ssize(kPointKeyOrder);
    if (std::find(varies.begin(), model_axes_end, true) != model_axes_end) {
      return 1;
    }
    const auto model_axes_count = sources_.size() - kPointKeyOrder.size();
    return is_product && model_axes_count > 0 ? sources_[model_axes_count - 1].layout.stride
                                              : points;
  }

  void sort() {
    for (auto begin = formulas_.begin(); begin != formulas_.end(); ++begin) {
      const auto next = std::find_if(begin, formulas_.end(), [&](const Formula& formula) {
        return std::none_of(begin, formulas_.end(), [&](const Formula& other) {
          return std::find(formula.inputs.begin(), formula.inputs.end(), other.axis) !=
                 formula.inputs.end();
        });
      });
      if (next == formulas_.end()) {
        std::vector<std::string_view> circle;
        std::transform(begin, formulas_.end(), std::back_inserter(circle),
                       [&](const Formula& each) {
                         return std::string_view(sources_[each.axis].layout.axis->key());
                       });
        throw InputError(
            circle.front(),
            fmt::format(
                "{}: the expressions depend on each other in a circle: compute one from other keys",
                fmt::join(circle, ", ")));
      }
      std::rotate(begin, next, next + 1);
    }
  }

  double value_of(const Source& source, std::uint64_t point) const {
    const AxisLayout& layout = source.layout;
    std::uint64_t number = 0;
    if (layout.values == 0) {
      const double part = sampling::fraction(block_->sample(), source.dimension, point);
      if (source.quantiles) {
        return source.quantiles->value_at(part);
      }
      const std::uint64_t values = axis_size(*layout.axis);
      number = std::min(static_cast<std::uint64_t>(part * static_cast<double>(values)), values - 1);
    } else if (layout.values > 1) {
      number = point / layout.stride % layout.values;
    }
    return source.range ? source.range->at(number) : layout.axis->values(static_cast<int>(number));
  }

  /// Returns a text such as "k = 1e7, H = 0.3, mu = 0.1, e = 1".
  std::string in_words(std::span<const double> values) const {
    std::string words;
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      words += fmt::format("{}{} = {}", words.empty() ? "" : ", ", sources_[i].layout.axis->key(),
                           solver::exact_number(values[i]));
    }
    return words;
  }

  const Block* block_;
  std::vector<Source> sources_;    ///< one per axis
  std::vector<Formula> formulas_;  ///< each formula follows the formulas of its inputs
  std::optional<Formula> filter_;
};

void PointTable::visit_values(const solver::ModelParameters& base, const Block& block,
                              std::uint64_t points,
                              const std::function<void(std::span<const double>)>& visit) {
  const BlockPoints compiled(base, block);
  for (std::uint64_t i = 0; i < points; ++i) {
    visit(compiled.values_at(i));
  }
}

PointTable::PointTable(Recipe recipe) : recipe_(std::make_unique<Recipe>(std::move(recipe))) {
  if (!recipe_->has_model()) {
    throw InputError(
        "the recipe has no model: send all parameters, because defaults change between versions");
  }
  base_model_ = from_message(recipe_->model());
  if (recipe_->blocks().empty()) {
    throw InputError("the study has no block: give at least one with H, mu and e");
  }
  if (static_cast<std::size_t>(recipe_->blocks_size()) > kMaxBlocks) {
    throw InputError(
        fmt::format("the study has {} blocks, more than {}: write points that differ "
                    "in all values as a block with `zip`",
                    recipe_->blocks_size(), kMaxBlocks));
  }
  for (const Block& block : recipe_->blocks()) {
    in_block(*recipe_, blocks_.size(), [&] { add_block(block); });
  }
}

PointTable::~PointTable() = default;
PointTable::PointTable(PointTable&&) noexcept = default;

void PointTable::add_block(const Block& block) {
  check_block(base_model_, block);
  BlockPoints& added = blocks_.emplace_back(base_model_, block);
  expressions_ += added.expressions();
  if (expressions_ > kMaxExpressions) {
    throw InputError(
        fmt::format("the study has more than {} expressions and filters", kMaxExpressions));
  }
  check_point_count(points_ + added.points);
  added.needs_point_validation = needs_point_validation(base_model_, block);
  added.first_point = points_;
  const bool has_base_model = model_axes(block).empty();
  const bool is_known = has_base_model && !base_segments_.empty();
  added.first_model = is_known ? base_segments_.front().model : models_;
  if (!is_known) {
    model_blocks_.push_back(blocks_.size() - 1);
    models_ += added.models;
  }
  if (has_base_model) {
    Segment* last = base_segments_.empty() ? nullptr : &base_segments_.back();
    if (last != nullptr && last->first_point + last->count == points_) {
      last->count += added.points;
    } else {
      base_segments_.push_back({added.first_model, points_, added.points});
    }
  }
  has_filter_ = has_filter_ || !block.where().empty();
  blocks_to_validate_ += added.needs_point_validation ? 1 : 0;
  points_ += added.points;
}

const BlockPlace& PointTable::block(std::size_t number) const {
  return blocks_.at(number);
}

std::size_t PointTable::block_of_point(std::uint64_t index) const {
  if (index >= points_) {
    throw std::out_of_range(fmt::format("the study has no point {}", index));
  }
  return place_of(blocks_, index, [](const BlockPlace& place) { return place.first_point; });
}

std::vector<double> PointTable::values(std::uint64_t index) const {
  const BlockPoints& block = blocks_[block_of_point(index)];
  return block.values_at(index - block.first_point);
}

Point PointTable::point(std::uint64_t index) const {
  const BlockPoints& block = blocks_[block_of_point(index)];
  const std::uint64_t number = index - block.first_point;
  const auto values = block.values_at(number);
  const auto point = std::span(values).last<kPointKeyOrder.size()>();
  return {block.first_model + number / block.points_per_model(), finite_or_0(point[0]),
          finite_or_0(point[1]), finite_or_0(point[2])};
}

solver::ModelParameters PointTable::model(std::uint64_t index) const {
  if (index >= models_) {
    throw std::out_of_range(fmt::format("the study has no model {}", index));
  }
  const BlockPoints& block = blocks_[model_blocks_[place_of(
      model_blocks_, index, [this](std::size_t number) { return blocks_[number].first_model; })]];
  return block.model(base_model_,
                     block.values_at((index - block.first_model) * block.points_per_model()));
}

Segment PointTable::segment_at(std::uint64_t index) const {
  const BlockPoints& block = blocks_[block_of_point(index)];
  if (model_axes(block.definition()).empty()) {
    return base_segments_[place_of(base_segments_, index,
                                   [](const Segment& segment) { return segment.first_point; })];
  }
  const std::uint64_t count = block.points_per_model();
  const std::uint64_t model = (index - block.first_point) / count;
  return {block.first_model + model, block.first_point + model * count, count};
}

bool PointTable::passes_filter(std::uint64_t index) const {
  if (!has_filter_) {
    return true;
  }
  const BlockPoints& block = blocks_[block_of_point(index)];
  return block.passes_filter(block.values_at(index - block.first_point));
}

std::uint64_t PointTable::first_passing(std::uint64_t begin, std::uint64_t end) const {
  while (begin < end && !passes_filter(begin)) {
    ++begin;
  }
  return std::min(begin, end);
}

std::string PointTable::fault(std::uint64_t index) const {
  const BlockPoints& block = blocks_[block_of_point(index)];
  const auto fault = block.needs_point_validation
                         ? block.fault(base_model_, block.values_at(index - block.first_point))
                         : std::nullopt;
  return fault ? fault->what() : "";
}

void PointTable::validate_points() const {
  const std::uint64_t most = kMaxValidated / std::max<std::uint64_t>(blocks_to_validate_, 1);
  for (std::size_t number = 0; number < blocks_.size(); ++number) {
    const BlockPoints& block = blocks_[number];
    bool leaves_any_in = false;
    const auto validate = [&](std::uint64_t i) {
      const auto values = block.values_at(i);
      if (const auto fault = block.fault(base_model_, values)) {
        throw InputError({.text = fault->fields().text,
                          .key = fault->fields().key,
                          .point = block.first_point + i});
      }
      leaves_any_in = leaves_any_in || block.passes_filter(values);
    };
    in_block(*recipe_, number, [&] {
      if (block.needs_point_validation &&
          for_each_or_some(block.points, most, most, number, validate) && !leaves_any_in) {
        in_expression("where", block.definition().where(),
                      [] { throw InputError("it leaves out all points"); });
      }
    });
  }
}

bool is_close(double value, double own) {
  // Relative tolerance, about a thousand times the rounding error of a double.
  constexpr double kTolerance = 1e-12;
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

bool is_close(std::string_view model, std::string_view own) {
  constexpr const char* kSeparators = " =,";
  while (!model.empty() || !own.empty()) {
    const auto part = model.substr(0, model.find_first_of(kSeparators));
    const auto own_part = own.substr(0, own.find_first_of(kSeparators));
    const auto number = solver::number_of(part);
    const auto own_number = solver::number_of(own_part);
    if (part != own_part && !(number && own_number && is_close(*number, *own_number))) {
      return false;
    }
    model.remove_prefix(std::min(part.size() + 1, model.size()));
    own.remove_prefix(std::min(own_part.size() + 1, own.size()));
  }
  return true;
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
      return fmt::format("the worker solved it with {} = {:.17g}, but the study has {:.17g}", key,
                         value, expected);
    }
  }
  // A result without a model was solved before the study grew and got several models.
  bool has_model = !result.has_model() && own.model == 0;
  try {
    has_model = has_model || (result.has_model() && is_close(from_message_unchecked(result.model()),
                                                             table.model(own.model)));
  } catch (const InputError&) {  // elements_per_link or integrator is outside its domain
  }
  return has_model ? "" : "the worker solved it with another model than that of the study";
}

TraceReply point_reply(const PointTable& table, std::uint64_t point) {
  const std::string fault = point >= table.size()
                                ? fmt::format("the study has no point {}: its points are 0 to {}",
                                              point, table.size() - 1)
                            : !table.passes_filter(point)
                                ? fmt::format("point {} is left out by the study's filter", point)
                                : table.fault(point);
  if (!fault.empty()) {
    throw std::runtime_error(fault);
  }
  const Point values = table.point(point);
  TraceReply reply;
  *reply.mutable_model() = to_message(table.model(values.model));
  reply.set_h_m(values.H_m);
  reply.set_mu(values.mu);
  reply.set_e_star(values.e_star);
  reply.set_errors(table.wants_errors());
  return reply;
}

Point inputs_of(const PointResult& result, const PointTable& table) {
  return result.has_h_m() ? Point{table.segment_at(result.point()).model, result.h_m(), result.mu(),
                                  result.e_star()}
                          : table.point(result.point());
}

namespace {

/// Average size of a result, and of a model, in a database [bytes] (server/store/README.md).
constexpr std::uint64_t kBytesAResult = 970;
constexpr std::uint64_t kBytesAModel = 600;

/// Up to kMaxCounted points are counted. For larger studies numbers are estimated from
/// kSampledPoints random points.
constexpr std::uint64_t kMaxCounted = 100'000;
constexpr std::uint64_t kSampledPoints = 10'000;

PassingPoints passing_points(const PointTable& table, int block) {
  const BlockPlace& place = table.block(static_cast<std::size_t>(block));
  if (table.recipe().blocks(block).where().empty()) {
    return {place.points, false};
  }
  std::uint64_t found = 0;
  const bool is_counted = for_each_or_some(
      place.points, kMaxCounted, kSampledPoints, 2,
      [&](std::uint64_t i) { found += table.passes_filter(place.first_point + i) ? 1U : 0U; });
  const double share = static_cast<double>(found) / static_cast<double>(kSampledPoints);
  return {
      is_counted ? found : static_cast<std::uint64_t>(share * static_cast<double>(place.points)),
      !is_counted};
}

/// Returns the points that pass the filters; for large studies at most `kSampledPoints` random
/// ones.
std::vector<std::uint64_t> some_points(const PointTable& table) {
  constexpr std::uint64_t kTries = 100 * kSampledPoints;
  const std::uint64_t most = table.size() <= kMaxCounted ? kMaxCounted : kSampledPoints;
  std::vector<std::uint64_t> points;
  for_each_or_some(table.size(), kMaxCounted, kTries, 0, [&](std::uint64_t point) {
    if (points.size() < most && table.passes_filter(point)) {
      points.push_back(point);
    }
  });
  if (points.empty()) {
    points.push_back(0);  // no point passes the filters, or none of the random points does
  }
  return points;
}

/// Counts the different falls of the study. `some` contains all of its points, or random points.
/// From random points the number is estimated (Good 1953): the number of different falls in `some`,
/// divided by the fraction of points in `some` that share their fall with another one.
void count_falls(const PointTable& table, const std::vector<std::uint64_t>& some, StudySize& size) {
  std::unordered_map<std::uint64_t, std::uint64_t> met;  // number of points by hash of their fall
  std::optional<std::uint64_t> model;  // model of the previous point; its fall has the hash `fall`
  std::uint64_t fall = 0;
  for (const std::uint64_t point : some) {
    if (const auto next = table.point(point).model; next != model) {
      model = next;
      fall = solver::fall_hash(table.model(next));
    }
    ++met[fall];
  }
  size.falls = met.size();
  if (table.size() > kMaxCounted) {
    const auto once =
        std::count_if(met.begin(), met.end(), [](const auto& each) { return each.second == 1; });
    const double share_met = 1.0 - static_cast<double>(once) / static_cast<double>(some.size());
    const auto points = static_cast<double>(size.points);
    size.falls = static_cast<std::uint64_t>(
        share_met > 0.0 ? std::min(static_cast<double>(met.size()) / share_met, points) : points);
  }
  size.falls_estimated = size.falls != met.size();
}

}  // namespace

StudySize size_of(const PointTable& table) {
  constexpr std::uint64_t kExamples = 64;
  StudySize size{};
  size.models = table.models();
  for (int i = 0; i < table.recipe().blocks_size(); ++i) {
    const PassingPoints& left_in = size.blocks.emplace_back(passing_points(table, i));
    size.points += left_in.points;
    size.points_estimated = size.points_estimated || left_in.estimated;
  }
  size.bytes = kBytesAResult * size.points + kBytesAModel * std::min(size.models, size.points);
  const std::vector<std::uint64_t> points = some_points(table);
  count_falls(table, points, size);
  std::sample(points.begin(), points.end(), std::back_inserter(size.examples), kExamples,
              std::mt19937_64(1));
  return size;
}

}  // namespace oblique::protocol
