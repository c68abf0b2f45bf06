// Pictures for the page: slices (values on a grid) and bins (counts and averages).
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/text.h"
#include "server/web/answers/fields.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/http_message.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;
using protocol::AxisLayout;

template <typename Number>
std::string bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

double real_of(const protocol::Cell& cell) {
  return cell.kind == protocol::CellKind::kInteger ? static_cast<double>(cell.integer) : cell.real;
}

/// Returns the column that a field names. Throws std::invalid_argument unless it is numeric or, if
/// `may_be_category`, a category.
PictureColumn picture_column(const FieldReader& fields, const std::string& name,
                             bool may_be_category) {
  const std::string text = fields.text(name).value_or("");
  auto column = find_picture_column(text);
  if (!column || (column->is_category && !may_be_category)) {
    throw std::invalid_argument(fmt::format("{} must be a column of numbers{}, and \"{}\" is not",
                                            name, may_be_category ? " or categories" : "",
                                            protocol::excerpt(text)));
  }
  return *std::move(column);
}

// ---- Slices -------------------------------------------------------------------------------------

constexpr std::uint64_t kUsualCells = 256;

/// Returns the axis of that key; null if the block has no such axis with listed or ranged values.
const AxisLayout* find(const std::vector<AxisLayout>& axes, std::string_view key) {
  const auto axis = std::ranges::find_if(axes, [key](const AxisLayout& layout) {
    return layout.axis->key() == key && protocol::has_own_values(*layout.axis);
  });
  return axis == axes.end() ? nullptr : &*axis;
}

/// One axis of a slice, and the shown values of the axis.
struct Side {
  const AxisLayout* axis = nullptr;  ///< null for the second axis of a slice that is a line
  std::uint64_t first = 0;           ///< index of the first value in the requested part of the axis
  std::uint64_t last = 0;
  std::vector<std::uint64_t> numbers = {0};  ///< ascending indices of the shown values
  std::vector<double> values = {};           ///< the shown values

  std::uint64_t stride() const { return axis == nullptr ? 0 : axis->stride; }
  ordered_json json() const {
    if (axis == nullptr) {
      return nullptr;
    }
    return {{"key", axis->axis->key()}, {"of", axis->values},
            {"first", first},           {"last", last},
            {"stride", stride()},       {"all_lines", numbers.size() == last - first + 1}};
  }
};

/// Selects the values to show along the side `name`: all, or evenly spaced ones with both ends.
Side side_of(const AxisLayout& axis, const FieldReader& fields, const std::string& name) {
  Side side{&axis};
  side.first = fields.whole(name + "0").value_or(0);
  side.last = std::min(fields.whole(name + "1").value_or(axis.values - 1), axis.values - 1);
  if (side.first > side.last) {
    throw std::invalid_argument(
        fmt::format("{0}0 must be below {1}, the number of values of {2}, and at most {0}1", name,
                    axis.values, axis.axis->key()));
  }
  const std::uint64_t steps_there = side.last - side.first;
  const std::uint64_t shown = std::min(steps_there + 1, fields.cells("n" + name, kUsualCells));
  const std::uint64_t steps = std::max<std::uint64_t>(shown - 1, 1);
  side.numbers.clear();
  for (std::uint64_t i = 0; i < shown; ++i) {
    side.numbers.push_back(side.first +
                           (shown > 1 ? (2 * i * steps_there + steps) / (2 * steps) : 0));
    side.values.push_back(protocol::axis_value(*axis.axis, side.numbers.back()));
  }
  return side;
}

/// Parses the field `at`: the index of the fixed value of each axis that the slice does not show.
std::map<std::string, std::uint64_t> held_values(const std::vector<AxisLayout>& axes,
                                                 const std::string& at) {
  std::map<std::string, std::uint64_t> held;
  for (const std::string_view entry : protocol::split(at, ',')) {
    const std::size_t mark = std::min(entry.find('@'), entry.size());
    const std::string key(entry.substr(0, mark));
    const Fields number{{"at", std::string(entry.substr(std::min(mark + 1, entry.size())))}};
    const AxisLayout* const axis = find(axes, key);
    if (axis == nullptr || !FieldReader(number).text("at")) {
      throw std::invalid_argument(fmt::format(
          "at must list KEY@NUMBER for axes of the block, separated by commas; {} is not one",
          protocol::excerpt(entry)));
    }
    held[key] = *FieldReader(number).whole("at");
    if (held[key] >= axis->values) {
      throw std::invalid_argument(
          fmt::format("at: {} has the values 0 to {}", key, axis->values - 1));
    }
  }
  return held;
}

/// A plane or a line through the points of a product block.
struct Grid {
  Grid(const protocol::PointTable& table, const FieldReader& fields);

  std::uint64_t block;
  std::vector<AxisLayout> axes;
  Side x;
  Side y;
  ordered_json at = ordered_json::array();  ///< the fixed axes, as JSON
  std::uint64_t first_point;                ///< number of the point at the first value of both axes
};

Grid::Grid(const protocol::PointTable& table, const FieldReader& fields)
    : block(fields.whole("block").value_or(0)) {
  const std::string x_key = fields.text("x").value_or("");
  const std::string y_key = fields.text("y").value_or("");
  const auto& blocks = table.recipe().blocks();
  const auto number = static_cast<int>(std::min<std::uint64_t>(block, 1U << 30U));
  if (number >= blocks.size() ||
      protocol::block_kind(blocks[number]) != protocol::BlockKind::kProduct) {
    throw std::invalid_argument(
        fmt::format("block must be the number of a grid block, below {}", blocks.size()));
  }
  axes = protocol::layout_of(blocks[number]);
  const AxisLayout* const x_axis = find(axes, x_key);
  const AxisLayout* const y_axis = find(axes, y_key);
  if (x_axis == nullptr || x_key == y_key || (!y_key.empty() && y_axis == nullptr)) {
    throw std::invalid_argument(
        fmt::format("x must be an axis of block {}, and y another one or empty", block));
  }
  x = side_of(*x_axis, fields, "x");
  if (y_axis != nullptr) {
    y = side_of(*y_axis, fields, "y");
  }
  const std::string at_text = fields.text("at").value_or("");
  auto held = at_text.empty() ? std::map<std::string, std::uint64_t>() : held_values(axes, at_text);
  first_point = table.block(block).first_point;
  for (const AxisLayout& axis : axes) {
    if (&axis != x_axis && &axis != y_axis && protocol::has_own_values(*axis.axis)) {
      const std::uint64_t value = held[axis.axis->key()];
      at.push_back({{"key", axis.axis->key()},
                    {"of", axis.values},
                    {"number", value},
                    {"value", protocol::axis_value(*axis.axis, value)}});
      first_point += value * axis.stride;
    }
  }
}

/// Why a cell has no value. A numeric cell then is the NaN with the bits kNan + mark; a cell of a
/// category has the code 0xffff - mark.
enum class Mark : std::uint8_t { kNotSolved, kFailed, kLeftOut, kNoValue, kFiltered, kHasValue };
constexpr std::uint32_t kNan = 0x7fc00000;
constexpr std::uint16_t kLastCode = 0xffff;

/// Returns a JSON array with one number per cell along a side: `first` plus the difference between
/// the point numbers of the cell and of the axis's first value.
std::string offsets_json(const Side& side, std::uint64_t first) {
  std::vector<std::uint64_t> offsets;
  for (const std::uint64_t number : side.numbers) {
    offsets.push_back(first + number * side.stride());
  }
  return fmt::format("[{}]", fmt::join(offsets, ","));
}

class SliceAnswer : public StudyAnswer {
 public:
  explicit SliceAnswer(Fields fields)
      : StudyAnswer(FieldReader(fields).condition()),
        fields_(std::move(fields)),
        column_(picture_column(FieldReader(fields_), "z", true)) {}

  Next next(const ServedStudy& study) override;
  void take_row(const protocol::ChunkRows& row) override;

 private:
  void list_points();
  protocol::StudyQuery query() const;
  void mark_left_out(const ServedStudy& study);
  HttpAnswer answer(std::uint64_t study) const;
  std::vector<std::uint32_t> number_bits() const;
  std::vector<std::uint16_t> codes(ordered_json& head) const;

  const Fields fields_;
  const PictureColumn column_;
  std::optional<Grid> grid_;
  // numbers of the points with their cells, in ascending order
  std::vector<std::pair<std::uint64_t, std::size_t>> points_;
  std::size_t next_point_ = 0;  // index in `points_` at which the search for the next row begins
  std::vector<Mark> marks_;     // marks of the cells, row by row
  std::vector<float> numbers_;  // values of the cells in a numeric column
  // indices of the cells of a category column, by text of the cell
  std::map<std::string, std::vector<std::size_t>> places_;
};

StudyAnswer::Next SliceAnswer::next(const ServedStudy& study) {
  if (!grid_) {
    grid_.emplace(*study.table, FieldReader(fields_));
    list_points();
    return query();
  }
  if (study.table->has_filter()) {
    mark_left_out(study);
  }
  return answer(study.id);
}

void SliceAnswer::list_points() {
  for (const std::uint64_t y : grid_->y.numbers) {
    for (const std::uint64_t x : grid_->x.numbers) {
      points_.emplace_back(grid_->first_point + x * grid_->x.stride() + y * grid_->y.stride(),
                           points_.size());
    }
  }
  std::sort(points_.begin(), points_.end());
  marks_.resize(points_.size());
  numbers_.resize(points_.size());
}

/// Selects point, value and mark of all cells that have a row. SQLite looks up each point by key.
protocol::StudyQuery SliceAnswer::query() const {
  protocol::StudyQuery query;
  query.add_select("point");
  query.add_select(column_.name);
  query.add_select(
      fmt::format("CASE {}WHEN error IS NOT NULL THEN {} WHEN {} IS NULL THEN {} ELSE {} END",
                  condition().empty() ? ""
                                      : fmt::format("WHEN ({}) IS NOT TRUE THEN {} ", condition(),
                                                    static_cast<int>(Mark::kFiltered)),
                  static_cast<int>(Mark::kFailed), column_.name, static_cast<int>(Mark::kNoValue),
                  static_cast<int>(Mark::kHasValue)));
  query.set_where(fmt::format(
      "point IN (SELECT y.value + x.value FROM json_each('{}') AS y, json_each('{}') AS x)",
      offsets_json(grid_->y, grid_->first_point), offsets_json(grid_->x, 0)));
  return query;
}

void SliceAnswer::take_row(const protocol::ChunkRows& row) {
  const auto point = static_cast<std::uint64_t>(row.cell(0).integer);
  while (next_point_ < points_.size() && points_[next_point_].first < point) {
    ++next_point_;
  }
  if (next_point_ == points_.size() || points_[next_point_].first != point) {
    throw std::runtime_error("a reader process returned a point that was not requested");
  }
  const std::size_t cell = points_[next_point_].second;
  marks_[cell] = static_cast<Mark>(row.cell(2).integer);
  if (marks_[cell] == Mark::kHasValue && column_.is_category) {
    places_[std::string(row.cell(1).text)].push_back(cell);
  } else if (marks_[cell] == Mark::kHasValue) {
    numbers_[cell] = static_cast<float>(real_of(row.cell(1)));
  }
}

void SliceAnswer::mark_left_out(const ServedStudy& study) {
  for (const auto& [point, cell] : points_) {
    if (marks_[cell] == Mark::kNotSolved && study.leaves_out(point)) {
      marks_[cell] = Mark::kLeftOut;
    }
  }
}

HttpAnswer SliceAnswer::answer(std::uint64_t study) const {
  const auto count = [this](Mark mark) { return std::ranges::count(marks_, mark); };
  ordered_json head{{"study", study},
                    {"block", grid_->block},
                    {"z",
                     {{"name", column_.name},
                      {"unit", column_.unit},
                      {"kind", column_.is_category ? "categories" : "numbers"}}},
                    {"x", grid_->x.json()},
                    {"y", grid_->y.json()},
                    {"at", grid_->at},
                    {"nx", grid_->x.numbers.size()},
                    {"ny", grid_->y.numbers.size()},
                    {"first_point", grid_->first_point},
                    {"solved", count(Mark::kHasValue) + count(Mark::kNoValue)},
                    {"failed", count(Mark::kFailed)},
                    {"left_out", count(Mark::kLeftOut)},
                    {"missing", count(Mark::kNotSolved)},
                    {"filtered", count(Mark::kFiltered)}};
  const std::string cells = column_.is_category ? bytes_of(codes(head)) : bytes_of(number_bits());
  return numbers_answer(head, bytes_of(grid_->x.values) + bytes_of(grid_->y.values) + cells);
}

std::vector<std::uint32_t> SliceAnswer::number_bits() const {
  std::vector<std::uint32_t> bits;
  for (std::size_t cell = 0; cell < marks_.size(); ++cell) {
    bits.push_back(marks_[cell] == Mark::kHasValue
                       ? std::bit_cast<std::uint32_t>(numbers_[cell])
                       : kNan + static_cast<std::uint32_t>(marks_[cell]));
  }
  return bits;
}

/// Returns the codes of the cells and adds their dictionary to `head`. The most frequent text comes
/// first and equally frequent texts are in alphabetical order, as in `oblique plot`.
std::vector<std::uint16_t> SliceAnswer::codes(ordered_json& head) const {
  std::vector<std::uint16_t> codes;
  for (const Mark mark : marks_) {
    codes.push_back(static_cast<std::uint16_t>(kLastCode - static_cast<int>(mark)));
  }
  std::vector<std::pair<std::string, std::vector<std::size_t>>> ranked(places_.begin(),
                                                                       places_.end());
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& one, const auto& other) {
    return one.second.size() > other.second.size();
  });
  head["dictionary"] = ordered_json::array();
  for (std::size_t code = 0; code < ranked.size(); ++code) {
    const auto& [text, places] = ranked[code];
    for (const std::size_t cell : places) {
      // A larger code would have the meaning of a mark. Only an edited database has so many texts.
      codes[cell] = static_cast<std::uint16_t>(std::min<std::size_t>(code, kLastCode - 5));
    }
    head["dictionary"].push_back({{"text", text}, {"cells", places.size()}});
  }
  return codes;
}

// ---- Bins ---------------------------------------------------------------------------------------

constexpr std::uint64_t kUsualBins = 64;
/// A value counts as inside the ends of an axis if it is outside by at most this relative distance,
/// because users may type 0.2 for 0.6 / 3.
constexpr double kEndTolerance = 1e-12;

std::string sql_number(double value) {
  constexpr double kMax = std::numeric_limits<double>::max();
  return fmt::format("({:#})", std::clamp(value, -kMax, kMax));
}

struct BinSide {
  std::string name;  ///< "x" or "y"
  PictureColumn column;
  std::uint64_t bins = kUsualBins;
  bool is_logarithmic = false;
  std::optional<double> typed_least = {};
  std::optional<double> typed_most = {};
  double least = 0.0;
  double most = 0.0;

  bool has_typed_ends() const { return typed_least && typed_most; }
  /// Returns the SQL condition for rows whose value may be in a bin of this axis.
  std::string has_place_sql() const {
    return fmt::format("{} {}", column.name, is_logarithmic ? "> 0" : "IS NOT NULL");
  }
  std::string is_inside_sql() const {
    const double slack_below =
        kEndTolerance * (is_logarithmic ? least : std::max(std::abs(least), std::abs(most)));
    const double slack_above = kEndTolerance * std::max(std::abs(least), std::abs(most));
    return fmt::format("{} BETWEEN {} AND {}", column.name, sql_number(least - slack_below),
                       sql_number(most + slack_above));
  }
  std::string bin_sql() const {
    const double first = place_of(least);
    const double width = place_of(most) - first;
    if (!(width > 0.0)) {
      return "0";
    }
    const std::string place = is_logarithmic ? fmt::format("ln({})", column.name) : column.name;
    return fmt::format("max(min(CAST(({} - {}) * {} AS INTEGER), {}), 0)", place, sql_number(first),
                       sql_number(static_cast<double>(bins) / width), bins - 1);
  }
  /// Sets the ends of the axis. Ends that the user did not give come from `range`: the range of
  /// values in the column, empty if no row has a value. Equal ends make one bin. Throws
  /// std::invalid_argument for wrong ends.
  void set_ends(std::optional<std::pair<double, double>> range) {
    least = typed_least.value_or(range ? range->first : typed_most.value_or(0.0));
    most = typed_most.value_or(range ? range->second : least);
    const bool has_ends = range || typed_least || typed_most;
    if (least > most || (is_logarithmic && has_ends && least <= 0.0)) {
      throw std::invalid_argument(fmt::format(
          "{0}0 must be at most {0}1, and above 0 where the scale is logarithmic", name));
    }
    bins = most - least > kEndTolerance * std::max(std::abs(least), std::abs(most)) ? bins : 1;
  }
  ordered_json json() const {
    return {{"column", column.name}, {"unit", column.unit}, {"least", least},
            {"most", most},          {"bins", bins},        {"log", is_logarithmic}};
  }

 private:
  double place_of(double value) const {
    return is_logarithmic ? std::log(std::max(value, std::numeric_limits<double>::min())) : value;
  }
};

BinSide bin_side(const FieldReader& fields, const std::string& name) {
  return {name,
          picture_column(fields, name, false),
          fields.cells("n" + name, kUsualBins),
          fields.text(name + "log").value_or("") == "1",
          fields.number(name + "0"),
          fields.number(name + "1")};
}

class BinsAnswer : public StudyAnswer {
 public:
  explicit BinsAnswer(const Fields& asked);

  Next next(const ServedStudy& study) override;
  void take_row(const protocol::ChunkRows& row) override;

 private:
  protocol::StudyQuery query() const;
  protocol::StudyQuery ends_query() const;
  protocol::StudyQuery counts_query();
  void take_ends(const protocol::ChunkRows& row);
  HttpAnswer answer(std::uint64_t study) const;

  std::vector<BinSide> sides_;
  std::optional<PictureColumn> z_;  // column whose mean is requested
  bool has_ends_ = false;
  std::vector<std::uint32_t> counts_;  // empty until the ends are known
  std::vector<float> means_;
  std::uint64_t outside_ = 0;
};

BinsAnswer::BinsAnswer(const Fields& asked) : StudyAnswer(FieldReader(asked).condition()) {
  const FieldReader fields(asked);
  sides_.push_back(bin_side(fields, "x"));
  if (fields.text("y")) {
    sides_.push_back(bin_side(fields, "y"));
  }
  if (fields.text("z")) {
    z_ = picture_column(fields, "z", false);
  }
}

StudyAnswer::Next BinsAnswer::next(const ServedStudy& study) {
  if (!std::exchange(has_ends_, true)) {
    if (!std::ranges::all_of(sides_, &BinSide::has_typed_ends)) {
      return ends_query();
    }
    std::ranges::for_each(sides_, [](BinSide& side) { side.set_ends(std::nullopt); });
  }
  return counts_.empty() ? Next(counts_query()) : Next(answer(study.id));
}

/// Queries the solved points that meet the condition and have values on all axes of the picture.
protocol::StudyQuery BinsAnswer::query() const {
  std::string where =
      condition().empty() ? "error IS NULL" : fmt::format("({}) AND error IS NULL", condition());
  for (const BinSide& side : sides_) {
    where += " AND " + side.has_place_sql();
  }
  protocol::StudyQuery query;
  query.set_where(where);
  return query;
}

protocol::StudyQuery BinsAnswer::ends_query() const {
  protocol::StudyQuery query = this->query();
  for (const BinSide& side : sides_) {
    query.add_select(fmt::format("min({0}), max({0})", side.column.name));
  }
  return query;
}

/// Returns a query that gives one row per bin. The bin NULL is for points outside the axes.
protocol::StudyQuery BinsAnswer::counts_query() {
  std::size_t size = 1;
  std::string bin;
  std::string is_inside;
  for (const BinSide& side : sides_) {
    bin += fmt::format("{}{} * {}", bin.empty() ? "" : " + ", size, side.bin_sql());
    is_inside += (is_inside.empty() ? "" : " AND ") + side.is_inside_sql();
    size *= side.bins;
  }
  counts_.resize(size);
  means_.resize(z_ ? size : 0, std::numeric_limits<float>::quiet_NaN());
  protocol::StudyQuery query = this->query();
  query.add_select(fmt::format("CASE WHEN {} THEN CAST({} AS INTEGER) END AS bin", is_inside, bin));
  query.add_select("count(*)");
  if (z_) {
    query.add_select(fmt::format("avg({})", z_->name));
  }
  query.set_group("bin");
  return query;
}

void BinsAnswer::take_row(const protocol::ChunkRows& row) {
  if (counts_.empty()) {
    take_ends(row);
    return;
  }
  const auto count = static_cast<std::uint64_t>(row.cell(1).integer);
  if (row.cell(0).kind == protocol::CellKind::kNull) {
    outside_ = count;
    return;
  }
  const auto place = static_cast<std::size_t>(row.cell(0).integer);
  counts_.at(place) = static_cast<std::uint32_t>(count);
  if (z_ && row.cell(2).kind != protocol::CellKind::kNull) {
    means_[place] = static_cast<float>(real_of(row.cell(2)));
  }
}

void BinsAnswer::take_ends(const protocol::ChunkRows& row) {
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    const protocol::Cell& least = row.cell(2 * i);
    sides_[i].set_ends(
        least.kind == protocol::CellKind::kNull
            ? std::nullopt
            : std::optional(std::pair(real_of(least), real_of(row.cell(2 * i + 1)))));
  }
}

HttpAnswer BinsAnswer::answer(std::uint64_t study) const {
  return numbers_answer(
      {{"study", study},
       {"x", sides_[0].json()},
       {"y", sides_.size() > 1 ? sides_[1].json() : ordered_json(nullptr)},
       {"z", z_ ? ordered_json(z_->name) : ordered_json(nullptr)},
       {"points", std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0})},
       {"outside", outside_},
       {"most", *std::ranges::max_element(counts_)}},
      bytes_of(counts_) + bytes_of(means_));
}

}  // namespace

PendingAnswer slice_answer(ServiceClient& service, std::uint64_t study, const Fields& fields) {
  return study_flow(service, study, std::make_unique<SliceAnswer>(fields));
}

PendingAnswer bins_answer(ServiceClient& service, std::uint64_t study, const Fields& fields) {
  return study_flow(service, study, std::make_unique<BinsAnswer>(fields));
}

}  // namespace oblique::server
