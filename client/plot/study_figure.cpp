#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"
#include "client/io/row_output.h"
#include "client/plot/figure.h"
#include "client/plot/plot_request.h"
#include "client/service/source.h"
#include "server/query/columns.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

using solver::InputError;
using solver::readable_number;

constexpr std::size_t kMaxCellsAlong = 320;  // maximum number of cells along an axis
constexpr std::size_t kMaxCategories = 12;   // maximum number of categories in the legend
constexpr std::size_t kMaxNamedLines = 8;    // maximum number of lines that the legend names
constexpr std::size_t kMaxMarked = 60;       // lines with more points have no marks
constexpr std::size_t kMaxDots = 4000;       // maximum number of points drawn one by one
constexpr std::size_t kMaxNames = 16;        // maximum number of bars for texts

std::string counted(std::uint64_t count, const std::string& noun) {
  return client::counted(count, noun, noun + "s");
}

/// Sorts categories by number of points, largest first, and merges very small ones into one.
std::vector<Category> categories_of(const std::map<std::string, std::uint64_t>& points,
                                    const std::string& plural) {
  std::vector<Category> categories;
  std::uint64_t whole = 0;
  for (const auto& [name, count] : points) {
    categories.push_back({.name = name, .points = count});
    whole += count;
  }
  std::stable_sort(categories.begin(), categories.end(),
                   [](const Category& a, const Category& b) { return a.points > b.points; });
  std::size_t kept = categories.size();
  if (kept > kMaxCategories) {
    kept = kMaxCategories;
    while (kept > 1 && categories[kept - 1].points * 400 < whole) {
      --kept;  // less than 0.25 % of the points is not visible
    }
  }
  if (kept + 1 >= categories.size()) {  // a single category is not merged
    return categories;
  }
  Category other{.name = fmt::format("{} other {}", format_count(categories.size() - kept), plural),
                 .is_other = true};
  for (std::size_t i = kept; i < categories.size(); ++i) {
    other.points += categories[i].points;
  }
  categories.resize(kept);
  categories.push_back(std::move(other));
  return categories;
}

/// Returns bars for the most frequent texts, largest first, and one bar for all others.
Bars bars_of_names(const AnswerColumn& column) {
  std::vector<std::pair<double, std::string>> counts;
  for (const auto& word : column.words) {
    counts.emplace_back(0.0, word);
  }
  for (const std::uint32_t word : column.word_of_row) {
    if (word != AnswerColumn::kNoWord) {
      counts[word].first -= 1.0;  // counts are negative, so that the largest is sorted first
    }
  }
  std::sort(counts.begin(), counts.end());
  Bars bars;
  const std::size_t kept = counts.size() <= kMaxNames ? counts.size() : kMaxNames - 1;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (i <= kept) {
      bars.names.push_back(i < kept ? counts[i].second
                                    : fmt::format("other: {}", counts.size() - kept));
      bars.heights.push_back(0.0);
    }
    bars.heights.back() -= counts[i].first;
  }
  return bars;
}

/// Throws InputError if the column contains texts, which an axis cannot show.
void refuse_texts(const std::string& flag, const AnswerColumn& column) {
  if (column.has_texts()) {
    throw InputError(
        fmt::format("{}{}: its values are texts; use --map or --histogram", flag, column.name));
  }
}

/// Builds a figure with one panel from the rows of a source.
class FigureBuilder {
 public:
  FigureBuilder(Source& source, const StudyShape& shape, const PlotRequest& request,
                const Tell& tell)
      : source_(source), shape_(shape), request_(request), tell_(tell) {}

  Figure made() {
    !request_.map.empty()       ? draw_map()
    : !request_.lines.empty()   ? draw_lines()
    : !request_.scatter.empty() ? draw_scatter()
                                : draw_histogram();
    figure_.panels.push_back(std::move(panel_));
    return std::move(figure_);
  }

 private:
  void note(std::string sentence) { figure_.notes.push_back(std::move(sentence)); }
  void note_empty(const std::string& why) {
    figure_.is_empty = true;
    note("Nothing to draw: " + why + ".");
  }

  /// Sets the range of the axis to the drawable values, or to --range. Reports if different values
  /// count as one.
  void span(FigureAxis& axis, const std::vector<double>& values, double wider_by = 0.0,
            const std::optional<Range>& given = {}) {
    if (given && !is_drawable(given->from, axis.is_logarithmic)) {
      throw InputError(fmt::format(
          "--range {} is not allowed with {}: FROM must be above 0 on a logarithmic scale",
          request_.range,
          !request_.lines.empty()       ? "--log-y"
          : !request_.histogram.empty() ? "--log-x"
                                        : "--log-colour"));
    }
    const Range all = range_of(values, axis.is_logarithmic);
    axis.span(given.value_or(all), given ? 0.0 : wider_by);
    if (all.from < all.to && counts_as_one(all)) {
      note(fmt::format("All values of {} differ by less than 1e-12 of their size and count as one.",
                       axis.name));
      tell_(figure_.notes.back());
    }
  }

  /// Queries the columns of the points that meet a condition. If grouped, the answer has one row
  /// per combination of values.
  Answer query(const std::vector<std::string>& columns, const std::string& where,
               bool is_grouped = false) {
    ResultQuery query;
    query.study = request_.study;
    query.where = where;
    query.select = fmt::format("{}", fmt::join(columns, ", "));
    query.group = is_grouped ? query.select : std::string();
    check(query);
    const auto stream = source_.rows(request_for(query));
    auto answer = read_columns(*stream);
    if (answer.size() != columns.size()) {
      throw InputError(fmt::format("a flag of a picture takes one column, but `{}` are {}",
                                   query.select, answer.size()));
    }
    return answer;
  }

  /// Returns the axis that a flag names. Without the flag, returns the first axis that is not
  /// `taken` and not fixed by --at. Throws InputError with the remedy if there is none.
  ChosenAxis chosen_or(const std::string& flag, const std::string& text,
                       const std::vector<ChosenAxis>& taken, const std::string& remedy) const {
    if (!text.empty()) {
      return chosen_axis(flag, text, shape_);
    }
    for (const StudyAxis* axis : shape_.by_preference()) {
      const bool is_taken = std::any_of(
          taken.begin(), taken.end(), [axis](const ChosenAxis& each) { return each.axis == axis; });
      if (!is_taken && !at_holds(request_, *axis)) {
        return chosen_axis(flag, axis->key, shape_);
      }
    }
    throw InputError(fmt::format("{} {}", request_.study, remedy));
  }

  /// Throws InputError that names the flag if the column contains texts, or if a logarithmic axis
  /// has no positive value.
  FigureAxis axis_for(const std::string& flag, const ChosenAxis& axis, const AnswerColumn& column,
                      bool is_logarithmic) const {
    refuse_texts("", column);
    const bool is_length = axis.axis != nullptr && axis.axis->key.starts_with("length");
    FigureAxis made = axis_of(axis.name, is_length ? "m" : column.unit);
    made.is_logarithmic = is_logarithmic || (axis.axis != nullptr && axis.axis->is_logarithmic);
    const bool has_positive = std::any_of(column.numbers.begin(), column.numbers.end(),
                                          [](double value) { return value > 0.0; });
    if (made.is_logarithmic && !has_positive && !column.numbers.empty()) {
      throw InputError(fmt::format("{}: no value of {} is above 0", flag, column.name));
    }
    return made;
  }

  /// Sets the range of the colours from --range or the values; adds a note if values lie outside.
  void set_colours(FigureAxis axis, const std::vector<double>& values) {
    axis.is_logarithmic = request_.is_colour_logarithmic;
    span(axis, values, 0.0, range_given(request_));
    const Range all = range_of(values, axis.is_logarithmic);
    if (all.from < axis.range.from || all.to > axis.range.to) {
      note(fmt::format(
          "Values range from {} to {}; those outside the scale have the colour of its nearest end.",
          readable_number(all.from * axis.per_unit, 4),
          readable_number(all.to * axis.per_unit, 4)));
    }
    figure_.colours = std::move(axis);
  }

  /// Sets title and subtitle; reports automatic choices.
  void add_titles(const std::string& what, std::uint64_t points) {
    figure_.title = fmt::format("{}: {}", request_.study, what);
    for (const auto& shown : condition_.shown) {
      figure_.subtitle += shown + ", ";
    }
    figure_.subtitle += counted(points, "point");
    if (shape_.is_one_block) {
      note(fmt::format("Block {} of {}; not drawn: {} of {}.", shape_.block + 1, shape_.blocks,
                       counted(shape_.points - shape_.block_points, "point"),
                       shape_.blocks == 2 ? "the other" : "the others"));
      if (request_.block.empty()) {
        tell_(
            fmt::format("The study has {} blocks; block {} is drawn. --block N draws another, "
                        "--block all draws all.",
                        shape_.blocks, shape_.block + 1));
      }
    }
    for (const auto& sentence : condition_.said) {
      tell_(sentence);
    }
    if (figure_.is_empty) {
      tell_("No point has a value: the picture is empty.");
    }
  }

  // ---- Maps -------------------------------------------------------------------------------------

  /// Values on an axis of a map, one for each cell; empty if a cell groups several values.
  std::vector<double> cell_values(const ChosenAxis& axis, const AnswerColumn& column) const {
    if (!shape_.is_grid || axis.axis == nullptr || !axis.axis->is_listed) {
      return {};
    }
    std::vector<double> of_study = axis.axis->values;
    if (where_names(request_, *axis.axis) && !column.numbers.empty()) {
      // Draws only the part of the axis that has rows.
      const Range part = range_of(column.numbers);
      std::erase_if(of_study, [&part](double v) { return v < part.from || v > part.to; });
    }
    auto values = axis_values(std::move(of_study), column);
    return values.size() <= kMaxCellsAlong ? values : std::vector<double>();
  }

  Gathered gather_map(const Answer& answer, const ChosenAxis& x, const ChosenAxis& y) {
    const auto x_values = cell_values(x, answer[0]);
    const auto y_values = cell_values(y, answer[1]);
    const auto has_cells = [](const FigureAxis& axis, const std::vector<double>& values) {
      return !values.empty() && is_drawable(values.front(), axis.is_logarithmic);
    };
    if (has_cells(panel_.x, x_values) && has_cells(panel_.y, y_values)) {
      auto gathered = gathered_in(answer, cells_around(x_values, panel_.x.is_logarithmic),
                                  cells_around(y_values, panel_.y.is_logarithmic));
      if (!request_.where.empty() && gathered.cells.count(CellState::kNoResult) > 0) {
        // A cell without a row may have points that --where excludes.
        mark_filtered(gathered.cells,
                      query({x.column, y.column}, condition_.sql_without_where, true));
      }
      return gathered;
    }
    // Chooses the number of cells so that a cell has about three points.
    const double side = std::sqrt(static_cast<double>(answer[0].numbers.size()) / 3.0);
    span(panel_.x, answer[0].numbers);
    span(panel_.y, answer[1].numbers);
    return gather_scattered(answer, static_cast<std::size_t>(std::clamp(side, 8.0, 320.0)));
  }

  /// Groups points in equal cells, at most `most` along an axis. Empty cells are not marked.
  Gathered gather_scattered(const Answer& answer, std::size_t most) const {
    // An axis with few different values, such as those of a grid, gets fewer cells than values;
    // otherwise empty cells would form stripes.
    const auto cells_for = [most](const FigureAxis& axis, const AnswerColumn& column) {
      const std::size_t different = axis_values({}, column).size();
      return cells_between(axis, std::clamp<std::size_t>(different * 9 / 10, 2, most));
    };
    auto gathered =
        gathered_in(answer, cells_for(panel_.x, answer[0]), cells_for(panel_.y, answer[1]));
    auto& states = gathered.cells.states;
    std::replace(states.begin(), states.end(), CellState::kNoResult, CellState::kNoPoint);
    return gathered;
  }

  /// Sets the colour scale of cells with numbers; clears values that the scale cannot show.
  void colour_cells(Cells& cells, const FigureAxis& axis) {
    std::vector<double> values;
    for (std::size_t i = 0; i < cells.values.size(); ++i) {
      if (cells.states[i] != CellState::kSolved) {
        continue;
      }
      if (is_drawable(cells.values[i], request_.is_colour_logarithmic)) {
        values.push_back(cells.values[i]);
      } else {
        cells.states[i] = CellState::kNoValue;
        cells.values[i] = std::nan("");
      }
    }
    set_colours(axis, values);
  }

  void name_categories(Cells& cells, const std::map<std::string, std::uint64_t>& points) {
    const bool is_mode = request_.map.find("mode") != std::string::npos;
    const std::string plural = is_mode ? "modes" : "texts";
    cells.categories = categories_of(points, plural);
    std::map<std::string, std::size_t> numbers;
    for (std::size_t k = 0; k < cells.categories.size(); ++k) {
      numbers.emplace(cells.categories[k].name, k);
    }
    for (std::size_t i = 0; i < cells.names.size(); ++i) {
      if (cells.states[i] == CellState::kSolved) {
        const auto found = numbers.find(cells.names[i]);
        cells.values[i] = static_cast<double>(found == numbers.end() ? cells.categories.size() - 1
                                                                     : found->second);
      }
    }
    if (is_mode) {
      note(fmt::format("{}, in order of time.", kModeLetters));
    }
    if (!cells.categories.empty() && cells.categories.back().is_other) {
      note(fmt::format("The {} {} with the most points are named; --format csv lists all {}.",
                       cells.categories.size() - 1, plural, format_count(points.size())));
    }
  }

  void draw_map() {
    const std::string remedy = fmt::format(
        "has fewer than two axes{}: use --lines, --scatter or --histogram, or name --x and --y",
        request_.at.empty() ? "" : " that --at leaves open");
    // x must not take the axis that --y names.
    std::vector<ChosenAxis> taken;
    if (!request_.y.empty()) {
      taken.push_back(chosen_axis("--y", request_.y, shape_));
    }
    const ChosenAxis x = chosen_or("--x", request_.x, taken, remedy);
    const ChosenAxis y = chosen_or("--y", request_.y, {x}, remedy);
    if (x.column == y.column) {
      throw InputError(fmt::format("--x and --y are both {}: a map has two axes", x.name));
    }
    condition_ = condition_of(request_, shape_, {x, y},
                              x.axis != nullptr && y.axis != nullptr && shape_.is_grid);
    const auto answer =
        query({x.column, y.column, chosen_axis("--map", request_.map, shape_).column, "status"},
              condition_.sql);
    panel_.x = axis_for("--log-x", x, answer[0], request_.is_x_logarithmic);
    panel_.y = axis_for("--log-y", y, answer[1], request_.is_y_logarithmic);
    Gathered gathered = gather_map(answer, x, y);
    Cells& cells = gathered.cells;
    cells.name = answer[2].name;
    if (!cells.values.empty()) {
      panel_.x.range = {cells.x.edges.front(), cells.x.edges.back()};
      panel_.y.range = {cells.y.edges.front(), cells.y.edges.back()};
    }
    if (cells.names.empty()) {
      colour_cells(cells, axis_of(answer[2].name, answer[2].unit));
    } else {
      name_categories(cells, gathered.points_of_name);
    }
    if (const auto blank = cells.count(CellState::kNoValue); blank > 0) {
      note(fmt::format("{} blank: solved, but the output is missing or cannot be drawn.",
                       counted(blank, "cell") + (blank == 1 ? " is" : " are")));
    }
    if (cells.count(CellState::kSolved) == 0) {
      note_empty("no cell has a value");
    }
    if (gathered.most_in_a_cell > 1) {
      note(fmt::format("Cells contain up to {} points and show {}.",
                       format_count(gathered.most_in_a_cell),
                       cells.names.empty() ? "their mean"
                                           : "the most frequent value; percentages count points"));
    }
    panel_.cells = std::move(cells);
    add_titles(answer[2].name, gathered.points);
  }

  // ---- Lines ------------------------------------------------------------------------------------

  /// Returns the axis that has one line for each of its values; nothing if there is only one line.
  std::optional<ChosenAxis> lines_by(const ChosenAxis& x) const {
    if (!request_.by.empty()) {
      return chosen_axis("--by", request_.by, shape_);
    }
    // The axis with the fewest values gives the fewest lines.
    const StudyAxis* fewest = nullptr;
    for (const StudyAxis* axis : shape_.by_preference()) {
      const bool is_open = shape_.is_grid && axis != x.axis && axis->is_listed &&
                           !at_holds(request_, *axis) && !where_names(request_, *axis);
      if (is_open && (fewest == nullptr || axis->values.size() < fewest->values.size())) {
        fewest = axis;
      }
    }
    return fewest == nullptr ? std::nullopt
                             : std::optional(chosen_axis("--by", fewest->key, shape_));
  }

  void draw_lines() {
    const ChosenAxis x =
        chosen_or("--x", request_.x, {}, "has no axis with more than one value: name --x");
    const ChosenAxis output = chosen_axis("--lines", request_.lines, shape_);
    const auto by = lines_by(x);
    if (by && by->column == x.column) {
      throw InputError(fmt::format("--x and --by are both {}", x.name));
    }
    std::vector<ChosenAxis> drawn{x};
    std::vector<std::string> columns{x.column, output.column};
    if (by) {
      drawn.push_back(*by);
      columns.push_back(by->column);
    }
    const bool is_whole_axis = x.axis != nullptr && shape_.is_grid;
    condition_ = condition_of(request_, shape_, drawn, is_whole_axis);
    const auto answer = query(columns, condition_.sql);
    panel_.x = axis_for("--log-x", x, answer[0], request_.is_x_logarithmic);
    refuse_texts("--lines ", answer[1]);
    panel_.y = axis_for("--log-y", {output.column, answer[1].name, output.axis}, answer[1],
                        request_.is_y_logarithmic);
    auto gathered = gathered_lines(answer, is_whole_axis ? x.axis->values : std::vector<double>());
    auto& curves = gathered.curves;
    const bool are_coloured = by && curves.size() > kMaxNamedLines;
    const bool has_marks =
        !are_coloured && !curves.empty() && curves.front().x.size() <= kMaxMarked;
    FigureAxis by_axis = by ? axis_for("--by", *by, answer[2], false) : FigureAxis();
    panel_.by_name = by_axis.name;
    int digits = 6;  // more if values that distinguish lines differ in later ones
    for (std::size_t i = 1; by && i < curves.size(); ++i) {
      while (digits < 17 && shown_value(by_axis, *curves[i - 1].by, digits) ==
                                shown_value(by_axis, *curves[i].by, digits)) {
        ++digits;
      }
    }
    for (std::size_t i = 0; i < curves.size(); ++i) {
      Curve& curve = curves[i];
      curve.name = by ? shown_value(by_axis, *curve.by, digits) : std::string();
      curve.stroke = i;
      curve.mark = has_marks ? Curve::Mark::kLineAndMarks : Curve::Mark::kLine;
      if (are_coloured) {
        curve.colours.assign(curve.x.size(), *curve.by);
      }
    }
    if (are_coloured) {
      by_axis.span({*curves.front().by, *curves.back().by});
      figure_.colours = by_axis;
    }
    panel_.curves = std::move(curves);
    span(panel_.x, answer[0].numbers, has_marks ? 0.02 : 0.0);
    span(panel_.y, answer[1].numbers, 0.05, range_given(request_));
    if (std::none_of(answer[1].numbers.begin(), answer[1].numbers.end(),
                     [&](double value) { return is_drawable(value, panel_.y.is_logarithmic); })) {
      note_empty("no point has a value");
    }
    if (gathered.gaps > 0) {
      note(fmt::format("Gaps in the lines: {} without a value.",
                       counted(gathered.gaps, "point") + (gathered.gaps == 1 ? " is" : " are")));
    }
    if (gathered.most_at_a_place > 1) {
      note(fmt::format("Up to {} points share a place; their mean is drawn.",
                       format_count(gathered.most_at_a_place)));
    }
    add_titles(answer[1].name, answer[0].numbers.size());
  }

  // ---- Points and histograms --------------------------------------------------------------------

  void draw_scatter() {
    const auto [x_name, y_name] = scatter_columns(request_);
    const ChosenAxis x = chosen_axis("--scatter", x_name, shape_);
    const ChosenAxis y = chosen_axis("--scatter", y_name, shape_);
    condition_ = condition_of(request_, shape_, {x, y}, false);
    const bool has_colour = !request_.colour.empty();
    std::vector<std::string> columns{x.column, y.column};
    if (has_colour) {
      columns.push_back(chosen_axis("--colour", request_.colour, shape_).column);
    }
    auto answer = query(columns, condition_.sql);
    panel_.x = axis_for("--log-x", x, answer[0], request_.is_x_logarithmic);
    panel_.y = axis_for("--log-y", y, answer[1], request_.is_y_logarithmic);
    span(panel_.x, answer[0].numbers, 0.03);
    span(panel_.y, answer[1].numbers, 0.03);
    FigureAxis colour{.label = "points in a cell", .name = "points"};
    if (has_colour) {
      refuse_texts("--colour ", answer[2]);
      colour = axis_of(answer[2].name, answer[2].unit);
    }
    const std::uint64_t points = answer[0].numbers.size();
    std::uint64_t missing = 0;
    for (std::size_t i = 0; i < points; ++i) {
      const bool is_drawn =
          is_drawable(answer[0].numbers[i], panel_.x.is_logarithmic) &&
          is_drawable(answer[1].numbers[i], panel_.y.is_logarithmic) &&
          (!has_colour || is_drawable(answer[2].numbers[i], request_.is_colour_logarithmic));
      missing += is_drawn ? 0U : 1U;
    }
    if (missing > 0) {
      note(fmt::format("{} of {} points have no value that can be drawn.", format_count(missing),
                       format_count(points)));
    }
    if (missing == points) {
      note_empty("no point has both values");
    }
    const std::string what = fmt::format("{} over {}", y.name, x.name);
    const std::string title =
        has_colour ? fmt::format("{}, coloured by {}", what, colour.name) : what;
    if (points <= kMaxDots) {
      Curve dots{.x = answer[0].numbers, .y = answer[1].numbers, .mark = Curve::Mark::kDots};
      if (has_colour) {
        dots.colours = answer[2].numbers;
        set_colours(colour, dots.colours);
      }
      panel_.curves.push_back(std::move(dots));
    } else {
      answer.resize(3, answer[0]);
      auto gathered = gather_scattered(answer, 130);
      Cells& cells = gathered.cells;
      note(fmt::format("{} points, grouped in {} x {} cells; colours show {}.",
                       format_count(points), cells.columns(), cells.rows(),
                       has_colour ? "means of their points" : "the number of their points"));
      for (std::size_t i = 0; !has_colour && i < cells.values.size(); ++i) {
        cells.values[i] = static_cast<double>(gathered.counts[i]);
      }
      colour.label = has_colour ? "mean of " + colour.label : colour.label;
      cells.name = colour.name;
      colour_cells(cells, colour);
      panel_.cells = std::move(cells);
    }
    add_titles(title, points);
  }

  void draw_histogram() {
    const ChosenAxis column = chosen_axis("--histogram", request_.histogram, shape_);
    if (server::is_list_column(column.column)) {
      throw InputError(
          fmt::format("--histogram {0}: its values are lists; choose an element, such as {0}[0]",
                      column.column));
    }
    condition_ = condition_of(request_, shape_, {column}, false);
    const auto answer = query({column.column}, condition_.sql);
    const std::size_t points = answer[0].numbers.size();
    FigureAxis points_axis{.label = "points", .name = "points"};
    if (answer[0].has_texts()) {
      panel_.bars = bars_of_names(answer[0]);
      panel_.y = axis_of(column.name, answer[0].unit);
    } else {
      panel_.x = axis_for("--log-x", column, answer[0], request_.is_x_logarithmic);
      const auto range = range_given(request_);
      std::vector<double> values = answer[0].numbers;
      std::erase_if(values, [&](double value) {
        return !is_drawable(value, panel_.x.is_logarithmic) ||
               (range && (value < range->from || value > range->to));
      });
      span(panel_.x, values, 0.0, range);
      panel_.bars = binned(values, panel_.x);
      panel_.x.range = {panel_.bars->edges.front(), panel_.bars->edges.back()};
    }
    double drawn = 0.0;
    for (const double height : panel_.bars->heights) {
      drawn += height;
    }
    const double tallest = range_of(panel_.bars->heights).to;
    points_axis.is_logarithmic =
        request_.is_y_logarithmic && !answer[0].has_texts() && tallest >= 1.0;
    points_axis.range = points_axis.is_logarithmic ? Range{0.5, tallest * 1.5}
                                                   : Range{0.0, std::max(tallest * 1.05, 1.0)};
    (answer[0].has_texts() ? panel_.x : panel_.y) = points_axis;
    if (const auto counted_points = static_cast<std::size_t>(drawn); counted_points < points) {
      note(fmt::format("{} of {} points have no value or lie outside the axis.",
                       format_count(points - counted_points), format_count(points)));
    }
    if (drawn == 0.0) {
      note_empty("no point has a value");
    }
    add_titles(answer[0].name, points);
  }

  Source& source_;
  const StudyShape& shape_;
  const PlotRequest& request_;
  const Tell& tell_;
  Condition condition_ = {};
  Figure figure_ = {};
  Panel panel_ = {};
};

}  // namespace

Figure figure_of(Source& source, const StudyShape& shape, const PlotRequest& request,
                 const Tell& tell) {
  return FigureBuilder(source, shape, request, tell).made();
}

}  // namespace oblique::client::plot
