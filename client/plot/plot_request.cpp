#include "client/plot/plot_request.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"
#include "client/plot/figure.h"
#include "proto/recipe/blocks.h"
#include "proto/text.h"
#include "server/query/columns.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

using protocol::Axis;
using protocol::Block;
using solver::InputError;
using solver::readable_number;

std::string column_of_key(const std::string& key) {
  if (const auto link = protocol::link_of_key(protocol::key_number(key))) {
    return fmt::format("json_extract(lengths_m, '$[{}]')", *link);
  }
  return server::column_of_key(key);
}

void sort_unique(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

StudyAxis study_axis(const Axis& axis) {
  StudyAxis made{.key = axis.key(), .column = column_of_key(axis.key())};
  made.is_listed = protocol::has_own_values(axis) && protocol::axis_size(axis) <= kMaxListed;
  made.is_logarithmic = axis.count() > 0 && axis.spacing() == protocol::SPACING_LOGARITHMIC;
  for (std::uint64_t i = 0; made.is_listed && i < protocol::axis_size(axis); ++i) {
    made.values.push_back(protocol::axis_value(axis, i));
  }
  sort_unique(made.values);
  return made;
}

StudyShape shape_of_block(const protocol::Recipe& recipe, std::size_t number,
                          std::uint64_t first_point) {
  const Block& block = recipe.blocks(static_cast<int>(number));
  StudyShape shape;
  for (const Axis& axis : block.axes()) {
    shape.axes.push_back(study_axis(axis));
  }
  shape.is_grid = protocol::block_kind(block) == protocol::BlockKind::kProduct;
  shape.block = number;
  shape.first_point = first_point;
  shape.block_points = protocol::points_of_block(block);
  shape.blocks = static_cast<std::size_t>(recipe.blocks_size());
  shape.is_one_block = shape.blocks > 1;
  return shape;
}

/// Returns the shape for a picture of all blocks: each axis has its values from all blocks.
StudyShape with_all_blocks(StudyShape shape, const protocol::Recipe& recipe) {
  shape.is_one_block = false;
  for (const Block& block : recipe.blocks()) {
    for (const Axis& axis : block.axes()) {
      const auto own =
          std::find_if(shape.axes.begin(), shape.axes.end(),
                       [&axis](const StudyAxis& each) { return each.key == axis.key(); });
      if (own != shape.axes.end()) {
        const auto more = study_axis(axis).values;
        own->values.insert(own->values.end(), more.begin(), more.end());
      }
    }
  }
  for (StudyAxis& axis : shape.axes) {
    sort_unique(axis.values);
  }
  return shape;
}

/// Splits "KEY=VALUE" of --at into key and value; the value is NaN if it is not a number.
std::pair<std::string, double> parsed_at(const std::string& text) {
  const std::size_t equals = std::min(text.find('='), text.size());
  const auto value = solver::number_of(text.substr(std::min(equals + 1, text.size())));
  return {text.substr(0, equals), value && std::isfinite(*value) ? *value : std::nan("")};
}

/// Returns the value of the axis that is nearest to `wanted`.
double nearest_value(const StudyAxis& axis, double wanted) {
  return *std::min_element(axis.values.begin(), axis.values.end(), [wanted](double a, double b) {
    return std::abs(a - wanted) < std::abs(b - wanted);
  });
}

/// Whether a typed value means `value` of an axis. The user may have typed it from a table, which
/// shows six digits.
bool means(double typed, double value) {
  return std::abs(value - typed) <= 1e-5 * std::abs(typed);
}

/// Whether the picture can show this block alone: the requested axes vary in the block, the block
/// has the values of --at, and enough axes for the picture vary and are not fixed by --at.
bool suits(const StudyShape& shape, const PlotRequest& request) {
  for (const std::string& name : {request.x, request.y, request.by}) {
    const StudyAxis* axis = shape.find(name);
    if (axis == nullptr ? protocol::is_axis_key(name) : !axis->varies()) {
      return false;
    }
  }
  for (const std::string& text : request.at) {
    const auto [key, value] = parsed_at(text);
    const StudyAxis* axis = shape.find(key);
    if (axis == nullptr || !axis->is_listed || !means(value, nearest_value(*axis, value))) {
      return false;
    }
  }
  const auto open = std::count_if(
      shape.axes.begin(), shape.axes.end(),
      [&request](const StudyAxis& axis) { return axis.varies() && !at_holds(request, axis); });
  return open >= (!request.map.empty() ? 2 : request.lines.empty() ? 0 : 1);
}

/// Index of the block that --block names, from 0; nothing if --block is empty or "all".
std::optional<std::size_t> block_named(const std::string& text, std::size_t blocks) {
  if (text.empty() || text == "all") {
    return std::nullopt;
  }
  const auto number = solver::number_of(text);
  if (!number || !(*number >= 1.0 && *number <= static_cast<double>(blocks)) ||
      *number != std::floor(*number)) {
    throw InputError(fmt::format(
        "--block {} is not allowed: it must be {} or `all`; `oblique describe` shows them", text,
        blocks == 1 ? "1" : fmt::format("a number from 1 to {}", blocks)));
  }
  return static_cast<std::size_t>(*number) - 1;
}

std::string values_in_words(const StudyAxis& axis) {
  const auto& values = axis.values;
  if (values.size() > 8) {
    return fmt::format("{} values from {} to {}", format_count(values.size()),
                       readable_number(values.front()), readable_number(values.back()));
  }
  std::vector<std::string> texts;
  for (const double value : values) {
    texts.push_back(readable_number(value));
  }
  return fmt::format("the values {}", fmt::join(texts, ", "));
}

std::pair<const StudyAxis*, double> checked_at(const std::string& text, const StudyShape& shape) {
  const auto [key, value] = parsed_at(text);
  const auto refused = [&text](const std::string& why) {
    return InputError(fmt::format("--at {}: {}", protocol::excerpt(text), why));
  };
  if (key.empty() || std::isnan(value)) {
    throw refused("it must be a key and a number, such as e=1");
  }
  const StudyAxis* axis = shape.find(key);
  if (axis == nullptr) {
    throw refused(fmt::format("the study has no axis {}{}; its axes are {}", protocol::excerpt(key),
                              protocol::did_you_mean(key, shape.keys()),
                              protocol::joined(shape.keys())));
  }
  if (!axis->is_listed) {
    throw refused(fmt::format(
        "the values of {} are scattered, and hardly any point has this one; use a range, such as "
        "--where \"{} BETWEEN {} AND {}\"",
        key, axis->column, readable_number(value * 0.95), readable_number(value * 1.05)));
  }
  const double nearest = nearest_value(*axis, value);
  if (!means(value, nearest)) {
    throw refused(fmt::format("no point has this {}; the nearest is {}={}. It has {}", key, key,
                              readable_number(nearest), values_in_words(*axis)));
  }
  return {axis, nearest};
}

void add_term(std::string& sql, const std::string& term) {
  sql += (sql.empty() ? "" : " AND ") + term;
}

/// Fixes the axis at a value, which the subtitle of the picture shows.
void fix(Condition& condition, const StudyAxis& axis, double value) {
  if (axis.varies()) {
    // Rows contain values as a worker computed them, which may differ in the last bits.
    const double margin = 1e-12 * std::abs(value);
    const std::string term =
        fmt::format("{} BETWEEN {} AND {}", axis.column, solver::exact_number(value - margin),
                    solver::exact_number(value + margin));
    add_term(condition.sql, term);
    add_term(condition.sql_without_where, term);
  }
  condition.shown.push_back(
      shown_value(axis_of(axis.label(), server::unit_of_column(axis.column)), value));
}

/// Chooses lines instead of a map if only two axes vary and are not fixed (`open`), and one of them
/// has few values: cells of a map would extend over values that the study does not have. Returns
/// the axis along which the lines run, or nullptr if a map is better.
const StudyAxis* axis_of_few_lines(const std::vector<const StudyAxis*>& open) {
  constexpr std::size_t kFew = 3;
  if (open.size() != 2 || !open[0]->is_listed || !open[1]->is_listed ||
      std::min(open[0]->values.size(), open[1]->values.size()) > kFew) {
    return nullptr;
  }
  return open[0]->values.size() < open[1]->values.size() ? open[1] : open[0];
}

}  // namespace

const StudyAxis* StudyShape::find(std::string_view name) const {
  const auto found = std::find_if(axes.begin(), axes.end(),
                                  [name](const StudyAxis& axis) { return axis.is_named(name); });
  return found == axes.end() ? nullptr : &*found;
}

std::vector<const StudyAxis*> StudyShape::by_preference() const {
  std::vector<const StudyAxis*> found;
  for (const StudyAxis& axis : axes) {
    if (axis.varies()) {
      found.push_back(&axis);
    }
  }
  const auto rank = [](const StudyAxis* axis) {
    return axis->key == "mu"  ? 3.0 * kMaxListed
           : axis->key == "H" ? 2.0 * kMaxListed
           : !axis->is_listed ? 1.0 * kMaxListed
                              : static_cast<double>(axis->values.size());
  };
  std::stable_sort(found.begin(), found.end(),
                   [&rank](const StudyAxis* a, const StudyAxis* b) { return rank(a) > rank(b); });
  return found;
}

std::vector<std::string_view> StudyShape::keys() const {
  std::vector<std::string_view> keys;
  for (const StudyAxis& axis : axes) {
    keys.push_back(axis.key);
  }
  return keys;
}

StudyShape shape_for(const protocol::Recipe& recipe, const PlotRequest& request) {
  const auto named_block =
      block_named(request.block, static_cast<std::size_t>(recipe.blocks_size()));
  std::optional<StudyShape> largest;
  std::optional<StudyShape> chosen;
  std::uint64_t points = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(recipe.blocks_size()); ++i) {
    StudyShape each = shape_of_block(recipe, i, points);
    points += each.block_points;
    if (named_block
            ? *named_block == i
            : (!chosen || each.block_points > chosen->block_points) && suits(each, request)) {
      chosen = each;
    }
    if (!largest || each.block_points > largest->block_points) {
      largest = std::move(each);
    }
  }
  if (!largest) {
    throw InputError("the study has no points");
  }
  StudyShape shape = chosen.value_or(*largest);
  shape.points = points;
  if (!named_block) {
    const PlotRequest drawn = completed(request, shape);
    const bool goes_by_axes =
        shape.is_grid && drawn.scatter.empty() && drawn.histogram.empty() && request.block.empty();
    shape = chosen && goes_by_axes ? shape : with_all_blocks(shape, recipe);
  }
  return shape;
}

ChosenAxis chosen_axis(const std::string& flag, const std::string& text, const StudyShape& shape) {
  if (const StudyAxis* axis = shape.find(text)) {
    return {axis->column, axis->label(), axis};
  }
  const bool is_word = std::all_of(text.begin(), text.end(), [](unsigned char letter) {
    return std::isalnum(letter) != 0 || letter == '_';
  });
  const auto columns = server::columns_and_functions();
  const bool is_column = std::any_of(columns.begin(), columns.end(),
                                     [&text](const auto& column) { return column.name == text; });
  if (is_word && !is_column) {
    std::vector<std::string_view> names = shape.keys();
    for (const auto& column : columns) {
      names.push_back(column.name);
    }
    throw InputError(
        fmt::format("{} {}: there is no such axis or column{}; the axes of this study are {}", flag,
                    protocol::excerpt(text), protocol::did_you_mean(text, names),
                    protocol::joined(shape.keys())));
  }
  return {text, text, nullptr};
}

bool where_names(const PlotRequest& request, const StudyAxis& axis) {
  const auto tokens = server::sql_tokens(request.where);
  return std::any_of(tokens.begin(), tokens.end(), [&axis](const server::SqlToken& token) {
    return token.is_name() && axis.is_named(token.text);
  });
}

bool at_holds(const PlotRequest& request, const StudyAxis& axis) {
  return std::any_of(request.at.begin(), request.at.end(), [&axis](const std::string& text) {
    return axis.is_named(text.substr(0, text.find('=')));
  });
}

Condition condition_of(const PlotRequest& request, const StudyShape& shape,
                       const std::vector<ChosenAxis>& drawn, bool fixes_others) {
  const auto is_drawn = [&drawn](const StudyAxis& axis) {
    return std::any_of(drawn.begin(), drawn.end(),
                       [&axis](const ChosenAxis& each) { return each.axis == &axis; });
  };
  Condition condition;
  if (shape.is_one_block) {
    condition.sql = fmt::format("point >= {} AND point < {}", shape.first_point,
                                shape.first_point + shape.block_points);
    condition.sql_without_where = condition.sql;
    condition.shown.push_back(fmt::format("block {} of {}", shape.block + 1, shape.blocks));
  }
  if (!request.where.empty()) {
    add_term(condition.sql, fmt::format("({})", request.where));
    condition.shown.push_back(request.where);
  }
  std::vector<const StudyAxis*> held;
  for (const auto& text : request.at) {
    const auto [axis, value] = checked_at(text, shape);
    if (is_drawn(*axis)) {
      throw InputError(fmt::format(
          "--at {}: {} is an axis of the picture; use --where for a part of it", text, axis->key));
    }
    if (std::find(held.begin(), held.end(), axis) != held.end()) {
      throw InputError(fmt::format("--at {}: {} has a value already", text, axis->key));
    }
    held.push_back(axis);
    fix(condition, *axis, value);
  }
  for (const StudyAxis& axis : shape.axes) {
    const bool is_open = axis.is_listed && !is_drawn(axis) && !at_holds(request, axis) &&
                         !where_names(request, axis);
    if (is_open && (fixes_others || !axis.varies())) {
      fix(condition, axis, axis.values.front());
      if (axis.varies()) {
        condition.said.push_back(fmt::format(
            "{} has {}; drawn: {} = {}. --at {}=VALUE draws another.", axis.key,
            values_in_words(axis), axis.key, readable_number(axis.values.front()), axis.key));
      }
    }
  }
  return condition;
}

void check(const PlotRequest& request) {
  for (const auto& [flag, text] : {std::pair{"--map", &request.map},
                                   {"--lines", &request.lines},
                                   {"--scatter", &request.scatter},
                                   {"--histogram", &request.histogram},
                                   {"--x", &request.x},
                                   {"--y", &request.y},
                                   {"--by", &request.by},
                                   {"--colour", &request.colour},
                                   {"--where", &request.where}}) {
    if (!text->empty()) {
      server::check_sql_part(flag, *text);
    }
  }
  if (!request.scatter.empty()) {
    static_cast<void>(scatter_columns(request));
  }
  static_cast<void>(range_given(request));
  const bool is_block = request.block == "all" || solver::number_of(request.block).value_or(0) >= 1;
  if (!request.block.empty() && !is_block) {
    throw solver::InputError(
        fmt::format("--block {} is not allowed: it must be the number of a block, from 1, or `all`",
                    request.block));
  }
}

std::optional<Range> range_given(const PlotRequest& request) {
  const std::string& text = request.range;
  if (text.empty()) {
    return std::nullopt;
  }
  const auto colon = text.find(':');
  const auto from = solver::number_of(text.substr(0, colon));
  const auto to = solver::number_of(text.substr(std::min(colon, text.size() - 1) + 1));
  if (!from || !to || !is_drawable(*from) || !is_drawable(*to) || counts_as_one({*from, *to})) {
    throw InputError(fmt::format(
        "--range {} is not allowed: it must be FROM:TO in SI units with FROM < TO, at most 1e301 "
        "and not closer than 1e-12 of their size",
        text));
  }
  return Range{*from, *to};
}

std::pair<std::string, std::string> scatter_columns(const PlotRequest& request) {
  const auto tokens = server::sql_tokens(request.scatter);
  const auto items = server::sql_items(tokens);
  if (items.size() != 2) {
    throw InputError(
        fmt::format("--scatter {} is not allowed: it must be two columns, such as mu,fn_peak_N",
                    request.scatter));
  }
  return {std::string(server::text_over(items[0])), std::string(server::text_over(items[1]))};
}

PlotRequest completed(PlotRequest request, const StudyShape& shape) {
  if (!request.map.empty() || !request.lines.empty() || !request.scatter.empty() ||
      !request.histogram.empty()) {
    return request;
  }
  const std::string usual = "fn_peak_N";
  const auto axes = shape.by_preference();
  std::vector<const StudyAxis*> open = axes;
  std::erase_if(open, [&request](const StudyAxis* axis) { return at_holds(request, *axis); });
  const StudyAxis* over = axis_of_few_lines(open);
  const bool goes_by_axes = request.colour.empty() && shape.is_grid;
  if (goes_by_axes && over != nullptr && request.y.empty() && request.by.empty()) {
    request.lines = usual;
    request.x = request.x.empty() ? over->key : request.x;
  } else if (request.by.empty() && (!request.y.empty() || (goes_by_axes && open.size() >= 2))) {
    request.map = usual;
  } else if (!request.by.empty() || (goes_by_axes && !axes.empty())) {
    request.lines = usual;
  } else if (axes.size() >= 2) {
    request.scatter = fmt::format("{},{}", axes[0]->key, axes[1]->key);
    request.colour = request.colour.empty() ? usual : request.colour;
  } else if (!axes.empty()) {
    request.scatter = fmt::format("{},{}", axes[0]->key, usual);
  } else {
    request.histogram = usual;
  }
  return request;
}

}  // namespace oblique::client::plot
