#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/format_units.h"
#include "client/plot/figure_builder.h"
#include "server/query/columns.h"
#include "worker/solver/model/errors.h"

namespace oblique::client::plot {
namespace {

constexpr std::size_t kMostNamedLines = 8;  // more are coloured by their value
constexpr std::size_t kMostMarked = 60;     // points of a line that has marks
constexpr std::size_t kMostDots = 4000;     // more are gathered in cells
constexpr std::size_t kMostNames = 16;      // of a histogram of texts
constexpr double kMostBins = 100.0;

/// The range of the values, widened by a share of it.
Range range_for(const std::vector<double>& values, const FigureAxis& axis, double share) {
  const Scale scale(range_of(values, axis.is_logarithmic), axis.is_logarithmic);
  return widened(scale.range(), share, axis.is_logarithmic);
}

void add_notes(Figure& figure, const GatheredLines& gathered) {
  if (gathered.gaps > 0) {
    figure.notes.push_back(fmt::format(
        "Gaps in the lines: {} without a value.",
        gathered.gaps == 1 ? "1 point is" : format_count(gathered.gaps) + " points are"));
  }
  if (gathered.most_at_a_place > 1) {
    figure.notes.push_back(fmt::format("Where up to {} points share a place, their mean is drawn.",
                                       format_count(gathered.most_at_a_place)));
  }
}

/// Throws solver::InputError for a column with texts, which an axis cannot show.
void refuse_texts(const std::vector<AnswerColumn>& answer) {
  for (const auto& column : answer) {
    if (column.has_texts()) {
      throw solver::InputError(fmt::format(
          "{} has texts, which have no place on an axis; --map and --histogram take them",
          column.name));
    }
  }
}

/// The number of points of a scatter that lack a place, or a colour if the answer has one.
std::uint64_t count_missing(const std::vector<AnswerColumn>& answer, const Scale& x_scale,
                            const Scale& y_scale, bool is_colour_logarithmic) {
  std::uint64_t missing = 0;
  for (std::size_t i = 0; i < answer[0].numbers.size(); ++i) {
    const bool is_drawn =
        std::isfinite(x_scale.share_of(answer[0].numbers[i])) &&
        std::isfinite(y_scale.share_of(answer[1].numbers[i])) &&
        (answer.size() < 3 || (std::isfinite(answer[2].numbers[i]) &&
                               (!is_colour_logarithmic || answer[2].numbers[i] > 0.0)));
    missing += is_drawn ? 0 : 1;
  }
  return missing;
}

/// Cells for values along an axis. Of few different values, as of a grid, there are fewer cells
/// than values: otherwise empty cells were stripes.
std::size_t cells_for(const std::vector<double>& values, std::size_t most) {
  std::unordered_set<double> different;
  for (const double value : values) {
    if (std::isfinite(value) && different.insert(value).second && different.size() > 2 * most) {
      return most;
    }
  }
  return std::clamp<std::size_t>(different.size() * 9 / 10, 2, most);
}

/// Bins of 2 IQR / n^(1/3) each, as Freedman and Diaconis advise.
int bins_for(const std::vector<double>& values, const Scale& scale) {
  if (values.size() < 2) {
    return 1;
  }
  std::vector<double> shares;
  for (const double value : values) {
    shares.push_back(scale.share_of(value));
  }
  const auto quartile = [&shares](std::size_t quarters) {
    const auto at =
        shares.begin() + static_cast<std::ptrdiff_t>((shares.size() - 1) * quarters / 4);
    std::nth_element(shares.begin(), at, shares.end());
    return *at;
  };
  const double width =
      2.0 * (quartile(3) - quartile(1)) / std::cbrt(static_cast<double>(values.size()));
  constexpr double kFewest = 10.0;
  return static_cast<int>(
      std::clamp(width > 0.0 ? std::ceil(1.0 / width) : kFewest, kFewest, kMostBins));
}

/// Edges at multiples of 1, 2 or 5 times a power of ten, about `bins` apart, around the range.
std::vector<double> round_edges(const Range& range, int bins) {
  const double raw = (range.to - range.from) / bins;
  const double decade = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * decade;
  for (const double times : {5.0, 2.0, 1.0}) {
    step = times * decade >= raw * 0.999 ? times * decade : step;
  }
  // Below 1 a quotient of whole numbers is the double that people write.
  const auto multiple = [step](double times) {
    return step < 1.0 ? times / std::round(1.0 / step) : times * step;
  };
  std::vector<double> edges;
  const double first = std::floor(range.from / step + 1e-9);
  for (int i = 0; i <= 2 * bins + 2; ++i) {
    edges.push_back(multiple(first + i));
    if (edges.back() > range.to) {
      break;
    }
  }
  return edges;
}

/// Of whole lists hardly two are alike; their elements can be counted.
void refuse_list(const std::string& column) {
  if (server::is_list_column(column)) {
    throw solver::InputError(
        fmt::format("--histogram {0}: its values are lists; take an element, as {0}[0]", column));
  }
}

}  // namespace

std::optional<ChosenAxis> FigureBuilder::lines_by(const ChosenAxis& x) const {
  if (!request_.by.empty()) {
    return chosen_axis("--by", request_.by, shape_);
  }
  // Of the others that with the fewest values has the fewest lines.
  const StudyAxis* fewest = nullptr;
  for (const StudyAxis* axis : by_preference(shape_)) {
    const bool is_open = shape_.is_grid && axis != x.axis && axis->is_listed && !is_held(*axis) &&
                         (request_.where.empty() || !names_axis(request_.where, *axis));
    if (is_open && (fewest == nullptr || axis->values.size() < fewest->values.size())) {
      fewest = axis;
    }
  }
  return fewest == nullptr ? std::nullopt : std::optional(chosen_axis("--by", fewest->key, shape_));
}

Figure FigureBuilder::lines() {
  const ChosenAxis x =
      chosen_or("--x", request_.x, {}, "has no axis with more than one value: name --x");
  const auto by = lines_by(x);
  if (by && by->column == x.column) {
    throw solver::InputError(fmt::format("--x and --by are both {}", x.name));
  }
  std::vector<ChosenAxis> drawn{x};
  std::vector<std::string> columns{x.column, request_.lines};
  if (by) {
    drawn.push_back(*by);
    columns.push_back(by->column);
  }
  condition_ = condition_of(request_, shape_, drawn, x.axis != nullptr && shape_.is_grid);
  const auto answer = query(columns);
  if (answer[1].has_texts()) {
    throw solver::InputError(
        fmt::format("--lines {}: its values are texts; take --map {} or --histogram {}",
                    request_.lines, request_.lines, request_.lines));
  }
  Figure figure;
  Panel panel;
  panel.x = axis_for("--log-x", x, answer[0], request_.is_x_logarithmic);
  panel.y = axis_for("--log-y", {request_.lines, answer[1].name, nullptr}, answer[1],
                     request_.is_y_logarithmic);
  const bool is_whole_axis = x.axis != nullptr && shape_.is_grid;
  auto gathered = gathered_lines(answer[0], answer[1], by ? &answer[2] : nullptr,
                                 is_whole_axis ? x.axis->values : std::vector<double>());
  std::vector<double> xs;
  std::vector<double> ys;
  std::vector<double> bys;
  for (const Curve& curve : gathered.curves) {
    xs.insert(xs.end(), curve.x.begin(), curve.x.end());
    ys.insert(ys.end(), curve.y.begin(), curve.y.end());
    bys.push_back(curve.by.value_or(0.0));
  }
  const bool are_coloured = by && gathered.curves.size() > kMostNamedLines;
  if (by) {
    FigureAxis axis = axis_for("--by", *by, answer[2], false);
    panel.by_name = axis.name;
    for (Curve& curve : gathered.curves) {
      curve.name = shown_value(axis, *curve.by);
    }
    if (are_coloured) {
      axis.range = range_of(bys);
      figure.colours = axis;
    }
  }
  const bool has_marks =
      !are_coloured && !gathered.curves.empty() && gathered.curves.front().x.size() <= kMostMarked;
  for (std::size_t i = 0; i < gathered.curves.size(); ++i) {
    Curve& curve = gathered.curves[i];
    curve.stroke = i;
    curve.has_marks = has_marks;
    curve.is_coloured_by = are_coloured;
  }
  panel.x.range = range_for(xs, panel.x, has_marks ? 0.02 : 0.0);
  panel.y.range = range_given(request_.range).value_or(range_for(ys, panel.y, 0.05));
  panel.curves = std::move(gathered.curves);
  figure.panels.push_back(std::move(panel));
  if (std::all_of(ys.begin(), ys.end(), [](double v) { return std::isnan(v); })) {
    note_empty(figure, "no point has a value");
  }
  add_notes(figure, gathered);
  add_titles(figure, answer[1].name, answer[0].numbers.size());
  return figure;
}

Figure FigureBuilder::scatter() {
  const auto names = names_in(request_.scatter);
  const ChosenAxis x = chosen_axis("--scatter", names[0], shape_);
  const ChosenAxis y = chosen_axis("--scatter", names[1], shape_);
  condition_ = condition_of(request_, shape_, {x, y}, false);
  std::vector<std::string> columns{x.column, y.column};
  if (!request_.colour.empty()) {
    columns.push_back(chosen_axis("--colour", request_.colour, shape_).column);
  }
  auto answer = query(columns);
  if (answer.size() > 2 && answer[2].has_texts()) {
    throw solver::InputError(
        fmt::format("--colour {}: its values are texts, and --scatter colours by numbers; take "
                    "--map {}, or --where for the points of one of them",
                    request_.colour, request_.colour));
  }
  refuse_texts(answer);
  Figure figure;
  Panel panel;
  panel.x = axis_for("--log-x", x, answer[0], request_.is_x_logarithmic);
  panel.y = axis_for("--log-y", y, answer[1], request_.is_y_logarithmic);
  const bool has_colour = answer.size() > 2;
  const Scale x_scale(range_for(answer[0].numbers, panel.x, 0.03), panel.x.is_logarithmic);
  const Scale y_scale(range_for(answer[1].numbers, panel.y, 0.03), panel.y.is_logarithmic);
  panel.x.range = x_scale.range();
  panel.y.range = y_scale.range();
  FigureAxis colour = has_colour ? axis_of(answer[2].name, answer[2].unit) : FigureAxis();
  const std::uint64_t points = answer[0].numbers.size();
  const std::uint64_t missing =
      count_missing(answer, x_scale, y_scale, request_.is_colour_logarithmic);
  if (missing > 0) {
    figure.notes.push_back(fmt::format("{} of {} points lack a value that can be drawn.",
                                       format_count(missing), format_count(points)));
  }
  if (missing == points) {
    note_empty(figure, "no point has both values");
  }
  if (points <= kMostDots) {
    if (has_colour) {
      figure.colours = colours_for(figure, colour, answer[2].numbers);
    }
    panel.dots = Dots{std::move(answer[0].numbers), std::move(answer[1].numbers),
                      has_colour ? std::move(answer[2].numbers) : std::vector<double>()};
  } else {
    const AnswerColumn no_status;
    auto gathered = gathered_in_bins(
        {answer[0], answer[1], has_colour ? answer[2] : answer[0], no_status}, x_scale,
        cells_for(answer[0].numbers, 160), y_scale, cells_for(answer[1].numbers, 110));
    Cells& cells = gathered.cells;
    figure.notes.push_back(
        fmt::format("{} points, gathered in {} x {} cells; colours are {}.", format_count(points),
                    cells.columns(), cells.rows(),
                    has_colour ? "means of their points" : "the number of their points"));
    for (std::size_t i = 0; !has_colour && i < cells.values.size(); ++i) {
      cells.values[i] =
          gathered.counts[i] == 0 ? std::nan("") : static_cast<double>(gathered.counts[i]);
    }
    colour = has_colour ? colour : FigureAxis{.label = "points in a cell", .name = "points"};
    colour.label = has_colour ? "mean of " + colour.label : colour.label;
    cells.name = colour.name;
    figure.colours = colours_for(figure, colour, cells.values);
    panel.cells = std::move(cells);
  }
  figure.panels.push_back(std::move(panel));
  const std::string what = fmt::format("{} over {}", y.name, x.name);
  add_titles(figure, has_colour ? fmt::format("{}, coloured by {}", what, colour.name) : what,
             points);
  return figure;
}

Bars binned(const std::vector<double>& values, const Range& range, bool is_logarithmic) {
  const Scale scale(range, is_logarithmic);
  const int bins = bins_for(values, scale);
  Bars bars;
  bars.edges = is_logarithmic ? scale.edges(static_cast<std::size_t>(bins))
                              : round_edges(scale.range(), bins);
  bars.heights.assign(bars.edges.size() - 1, 0.0);
  for (const double value : values) {
    const auto above = std::upper_bound(bars.edges.begin(), bars.edges.end(), value);
    const auto bin = std::clamp<std::ptrdiff_t>(
        above - bars.edges.begin() - 1, 0, static_cast<std::ptrdiff_t>(bars.heights.size()) - 1);
    bars.heights[static_cast<std::size_t>(bin)] += 1.0;
  }
  return bars;
}

Bars counted(const AnswerColumn& column) {
  std::vector<std::pair<double, std::string>> counts;
  for (const auto& word : column.words) {
    counts.emplace_back(0.0, word);
  }
  for (const std::uint32_t word : column.word_of_row) {
    if (word != AnswerColumn::kNoWord) {
      counts[word].first -= 1.0;  // below 0, so that sorting puts the largest first
    }
  }
  std::sort(counts.begin(), counts.end());
  Bars bars;
  const std::size_t kept = counts.size() <= kMostNames ? counts.size() : kMostNames - 1;
  for (std::size_t i = 0; i < kept; ++i) {
    bars.names.push_back(counts[i].second);
    bars.heights.push_back(-counts[i].first);
  }
  if (kept < counts.size()) {
    bars.names.push_back(fmt::format("other: {}", counts.size() - kept));
    bars.heights.push_back(0.0);
    for (std::size_t i = kept; i < counts.size(); ++i) {
      bars.heights.back() -= counts[i].first;
    }
  }
  return bars;
}

Figure FigureBuilder::histogram() {
  refuse_list(request_.histogram);
  const ChosenAxis column = chosen_axis("--histogram", request_.histogram, shape_);
  condition_ = condition_of(request_, shape_, {column}, false);
  const auto answer = query({column.column});
  const std::size_t points = answer[0].numbers.size();
  const FigureAxis points_axis{.label = "points", .name = "points"};
  Figure figure;
  Panel panel;
  std::size_t counted_points = 0;
  if (answer[0].has_texts()) {
    panel.bars = counted(answer[0]);
    for (const double height : panel.bars->heights) {
      counted_points += static_cast<std::size_t>(height);
    }
    panel.x = points_axis;
    panel.x.range = {0.0, std::max(range_of(panel.bars->heights).to * 1.05, 1.0)};
    panel.y = axis_for("--histogram", column, answer[0], false);
  } else {
    panel.x = axis_for("--log-x", column, answer[0], request_.is_x_logarithmic);
    const auto range = range_given(request_.range);
    std::vector<double> values = answer[0].numbers;
    std::erase_if(values, [&](double value) {
      return !std::isfinite(value) || (panel.x.is_logarithmic && value <= 0.0) ||
             (range && (value < range->from || value > range->to));
    });
    counted_points = values.size();
    panel.bars = binned(values, range.value_or(range_of(values, panel.x.is_logarithmic)),
                        panel.x.is_logarithmic);
    panel.x.range = {panel.bars->edges.front(), panel.bars->edges.back()};
    const double tallest = range_of(panel.bars->heights).to;
    panel.y = points_axis;
    panel.y.is_logarithmic = request_.is_y_logarithmic && tallest >= 1.0;
    panel.y.range = panel.y.is_logarithmic ? Range{0.5, tallest * 1.5}
                                           : Range{0.0, std::max(tallest * 1.05, 1.0)};
  }
  figure.panels.push_back(std::move(panel));
  if (counted_points < points) {
    figure.notes.push_back(fmt::format("{} of {} points have no value, or one outside the axis.",
                                       format_count(points - counted_points),
                                       format_count(points)));
  }
  if (counted_points == 0) {
    note_empty(figure, "no point has a value");
  }
  add_titles(figure, answer[0].name, points);
  return figure;
}

}  // namespace oblique::client::plot
