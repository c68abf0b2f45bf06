#include "client/plot/figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"
#include "proto/wire/chunk.h"
#include "server/query/columns.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client::plot {
namespace {

// Smallest and largest size of a number in a picture. The units of axes and their margins multiply
// it by less than 1e7, which gnuplot can show.
constexpr double kSmallest = 1e-300;
constexpr double kLargest = 1e301;

/// Range with a margin around a single value.
Range around(double value, bool is_logarithmic) {
  const double half = std::abs(value) < kSmallest ? 0.5 : 0.1 * std::abs(value);
  return is_logarithmic ? Range{value / 1.25, value * 1.25} : Range{value - half, value + half};
}

/// Label of a quantity: its symbol with a name, else the start of its description, else its name.
std::string label_of(const std::string& name) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kSymbols{{
      {"H", "drop H"},
      {"mu", "coefficient of friction \u03bc"},
      {"e", "coefficient of restitution e*"},
      {"eta2", "stiffness ratio \u03b7\u00b2"},
  }};
  for (const auto& [symbol, label] : kSymbols) {
    if (symbol == name) {
      return std::string(label);
    }
  }
  constexpr std::size_t kLongest = 60;
  for (const auto& column : server::columns_and_functions()) {
    const std::string words = column.meaning.substr(0, column.meaning.find_first_of(",;:("));
    if (column.name == name && !words.empty() && words.size() <= kLongest) {
      return words.substr(0, words.find_last_not_of(' ') + 1);
    }
  }
  return name;
}

/// Returns about `bins` bin edges around the range, at multiples of 1, 2 or 5 times a power of ten.
/// The values of the range must not count as one: then `i` is below 1e15 and grows by 1.
std::vector<double> round_edges(const Range& range, double bins) {
  const double step = round_step(range, bins);
  std::vector<double> edges;
  for (double i = std::floor(range.from / step + 1e-9); edges.empty() || edges.back() <= range.to;
       ++i) {
    // If the step is below 1, an edge is the quotient of two integers. It equals the double of its
    // decimal text, which a user may type.
    edges.push_back(step < 1.0 ? i / std::round(1.0 / step) : i * step);
  }
  return edges;
}

}  // namespace

double round_step(const Range& range, double parts) {
  const double raw = (range.to - range.from) / parts;
  const double decade = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * decade;
  for (const double times : {5.0, 2.0, 1.0}) {
    step = times * decade >= raw * 0.999 ? times * decade : step;
  }
  return step;
}

bool is_drawable(double value, bool is_logarithmic) {
  return std::abs(value) <= kLargest && (!is_logarithmic || value >= kSmallest);
}

Range range_of(const std::vector<double>& values, bool is_logarithmic) {
  Range range{HUGE_VAL, -HUGE_VAL};
  for (const double value : values) {
    if (is_drawable(value, is_logarithmic)) {
      range = united(range, {value, value});
    }
  }
  return range.from <= range.to ? range : Range{is_logarithmic ? 0.1 : 0.0, 1.0};
}

Range united(const Range& one, const Range& other) {
  return {std::min(one.from, other.from), std::max(one.to, other.to)};
}

bool counts_as_one(const Range& range) {
  const double size = std::max(std::abs(range.from), std::abs(range.to));
  return !(range.to - range.from > std::max(1e-12 * size, kSmallest));
}

void FigureAxis::span(const Range& values, double wider_by) {
  range = counts_as_one(values) ? around(values.from, is_logarithmic) : values;
  const Range narrow = range;
  range = {value_at(-wider_by), value_at(1.0 + wider_by)};
  if (is_logarithmic) {
    range = {std::max(range.from, kSmallest / 10.0), std::min(range.to, kLargest)};
  } else if (wider_by > 0.0) {
    range.from = narrow.from * range.from < 0.0 ? 0.0 : range.from;
    range.to = narrow.to * range.to < 0.0 ? 0.0 : range.to;
  }
}

double FigureAxis::share_of(double value) const {
  if (!is_logarithmic) {
    return (value - range.from) / (range.to - range.from);
  }
  const double start = std::log(range.from);
  return value > 0.0 ? (std::log(value) - start) / (std::log(range.to) - start) : std::nan("");
}

double FigureAxis::value_at(double share) const {
  if (share == 0.0 || share == 1.0) {
    return share == 0.0 ? range.from : range.to;
  }
  // The quotient of the ends may exceed the largest number, but their logarithms do not.
  return is_logarithmic
             ? std::exp(std::log(range.from) + share * (std::log(range.to) - std::log(range.from)))
             : range.from + share * (range.to - range.from);
}

FigureAxis axis_of(const std::string& name, const std::string& unit) {
  const auto* field = solver::find_result_column(name);
  FigureAxis axis{.label = label_of(name), .name = name};
  std::string shown_unit = unit;
  if (field != nullptr && field->shown_per_unit != 1.0) {
    axis.per_unit = field->shown_per_unit;
    shown_unit = field->shown_unit == "us" ? "\u00b5s" : std::string(field->shown_unit);
  }
  axis.label += shown_unit.empty() ? "" : fmt::format(" [{}]", shown_unit);
  return axis;
}

std::string shown_value(const FigureAxis& axis, double value, int digits) {
  std::string text =
      fmt::format("{} = {}", axis.name, solver::readable_number(value * axis.per_unit, digits));
  const auto bracket = axis.label.rfind(" [");
  if (bracket != std::string::npos) {
    text += ' ' + axis.label.substr(bracket + 2, axis.label.size() - bracket - 3);
  }
  return text;
}

std::uint64_t Cells::count(CellState state) const {
  return static_cast<std::uint64_t>(std::count(states.begin(), states.end(), state));
}

std::vector<double> edges_between(const std::vector<double>& values, bool is_logarithmic) {
  if (values.size() < 2) {
    const Range room = around(values.empty() ? 0.0 : values.front(), is_logarithmic);
    return values.empty() ? std::vector<double>{} : std::vector<double>{room.from, room.to};
  }
  std::vector<double> edges{0.0};
  for (std::size_t i = 1; i < values.size(); ++i) {
    edges.push_back(is_logarithmic ? std::sqrt(values[i - 1]) * std::sqrt(values[i])
                                   : 0.5 * (values[i - 1] + values[i]));
  }
  // Makes the outer cells symmetric about their values.
  const auto mirrored = [is_logarithmic](double end, double inner) {
    return is_logarithmic ? std::clamp(end / inner * end, kSmallest / 10.0, kLargest)
                          : end + (end - inner);
  };
  edges.front() = mirrored(values.front(), edges[1]);
  edges.push_back(mirrored(values.back(), edges.back()));
  return edges;
}

std::size_t interval_of(const std::vector<double>& edges, double value) {
  if (edges.size() < 2 || !(value >= edges.front() && value <= edges.back())) {
    return SIZE_MAX;
  }
  const auto above = std::upper_bound(edges.begin() + 1, edges.end() - 1, value);
  return static_cast<std::size_t>(above - edges.begin()) - 1;
}

Bars binned(const std::vector<double>& values, const FigureAxis& axis) {
  const double bins =
      std::clamp(std::round(std::sqrt(2.0 * static_cast<double>(values.size()))), 10.0, 100.0);
  Bars bars;
  bars.edges = axis.is_logarithmic ? cells_between(axis, static_cast<std::size_t>(bins)).edges
                                   : round_edges(axis.range, bins);
  bars.heights.assign(bars.edges.size() - 1, 0.0);
  for (const double value : values) {
    const double inside = std::clamp(value, bars.edges.front(), bars.edges.back());
    bars.heights[interval_of(bars.edges, inside)] += 1.0;
  }
  return bars;
}

namespace {

using protocol::CellKind;
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

/// For each row, the index of the cell that contains its (x, y); SIZE_MAX if no cell does.
std::vector<std::size_t> places_in(const Cells& cells, const Answer& answer) {
  std::vector<std::size_t> places;
  for (std::size_t row = 0; row < answer[0].numbers.size(); ++row) {
    const std::size_t column = interval_of(cells.x.edges, answer[0].numbers[row]);
    const std::size_t line = interval_of(cells.y.edges, answer[1].numbers[row]);
    places.push_back(column == SIZE_MAX || line == SIZE_MAX ? SIZE_MAX
                                                            : line * cells.columns() + column);
  }
  return places;
}

/// A cell and the index of a text in AnswerColumn::words.
using WordOfCell = std::pair<std::size_t, std::uint32_t>;

/// Sets the value of each cell to its most frequent text. Of equally frequent texts, the one that
/// appears first in the answer wins.
void name_cells(Gathered& gathered, std::vector<WordOfCell>& words, const AnswerColumn& column) {
  gathered.cells.names.resize(gathered.counts.size());
  std::vector<std::ptrdiff_t> most(gathered.counts.size(), 0);
  std::sort(words.begin(), words.end());
  for (auto at = words.begin(); at != words.end();) {
    const auto next = std::upper_bound(at, words.end(), *at);
    const std::string& name = column.words[at->second];
    gathered.points_of_name[name] += static_cast<std::uint64_t>(next - at);
    if (next - at > most[at->first]) {
      most[at->first] = next - at;
      gathered.cells.names[at->first] = name;
    }
    at = next;
  }
}

}  // namespace

bool AnswerColumn::is_null(std::size_t row) const {
  return has_texts() ? word(row) == kNoWord : std::isnan(numbers[row]);
}

void AnswerColumn::add(const protocol::Cell& cell) {
  numbers.push_back(cell.kind == CellKind::kReal      ? cell.real
                    : cell.kind == CellKind::kInteger ? static_cast<double>(cell.integer)
                                                      : kNoNumber);
  if (cell.kind == CellKind::kText || !word_of_row.empty()) {
    word_of_row.resize(numbers.size(), kNoWord);  // rows without a text get kNoWord
  }
  if (cell.kind == CellKind::kText) {
    const auto next = static_cast<std::uint32_t>(words.size());
    const auto [place, is_new] = number_of_word.emplace(cell.text, next);
    if (is_new) {
      words.emplace_back(cell.text);
    }
    word_of_row.back() = place->second;
  }
}

Answer read_columns(RowStream& stream) {
  Answer columns;
  for (bool ends = false; !ends;) {
    const protocol::QueryReply chunk = stream.next();
    for (int i = static_cast<int>(columns.size()); i < chunk.columns_size(); ++i) {
      columns.push_back({.name = chunk.columns(i),
                         .unit = i < chunk.units_size() ? chunk.units(i) : std::string()});
    }
    protocol::ChunkRows rows(chunk);
    while (rows.next()) {
      for (std::size_t i = 0; i < columns.size(); ++i) {
        columns[i].add(rows.cell(i));
      }
    }
    if (!columns.empty() && columns.front().numbers.size() > kMaxRows) {
      throw std::runtime_error(
          fmt::format("a picture shows at most {} points, and these are more: select fewer with "
                      "--where or --at",
                      format_count(kMaxRows)));
    }
    ends = chunk.ends();
  }
  return columns;
}

CellAxis cells_around(const std::vector<double>& values, bool is_logarithmic) {
  return {values, edges_between(values, is_logarithmic)};
}

CellAxis cells_between(const FigureAxis& axis, std::size_t cells) {
  CellAxis made;
  const auto count = static_cast<double>(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    made.values.push_back(axis.value_at((static_cast<double>(i) + 0.5) / count));
    made.edges.push_back(axis.value_at(static_cast<double>(i) / count));
  }
  made.edges.push_back(axis.range.to);
  return made;
}

std::vector<double> axis_values(std::vector<double> of_study, const AnswerColumn& column) {
  std::vector<double> others = column.numbers;
  std::erase_if(others, [&of_study](double number) {
    return !is_drawable(number) || std::binary_search(of_study.begin(), of_study.end(), number);
  });
  of_study.insert(of_study.end(), others.begin(), others.end());
  std::sort(of_study.begin(), of_study.end());
  // Merges values that differ only because different machines computed them.
  const auto end = std::unique(of_study.begin(), of_study.end(), [](double a, double b) {
    return counts_as_one({a, b});
  });
  of_study.erase(end, of_study.end());
  return of_study;
}

Gathered gathered_in(const Answer& answer, const CellAxis& x, const CellAxis& y) {
  const AnswerColumn& value = answer[2];
  Gathered gathered;
  Cells& cells = gathered.cells;
  cells.x = x;
  cells.y = y;
  cells.values.assign(cells.columns() * cells.rows(), 0.0);
  cells.states.assign(cells.values.size(), CellState::kNoResult);
  gathered.counts.assign(cells.values.size(), 0);
  const auto places = places_in(cells, answer);
  std::vector<WordOfCell> words;
  for (std::size_t row = 0; row < places.size(); ++row) {
    const std::size_t cell = places[row];
    if (cell == SIZE_MAX) {
      continue;
    }
    ++gathered.points;
    auto& state = cells.states[cell];
    if (!value.is_null(row)) {
      if (value.has_texts()) {
        words.emplace_back(cell, value.word(row));
      } else {
        cells.values[cell] += value.numbers[row];
      }
      ++gathered.counts[cell];
      state = CellState::kSolved;
    } else if (state != CellState::kSolved && state != CellState::kFailed) {
      const std::uint32_t status = answer.size() > 3 ? answer[3].word(row) : AnswerColumn::kNoWord;
      const bool failed = status != AnswerColumn::kNoWord && answer[3].words[status] == "failed";
      state = failed ? CellState::kFailed : CellState::kNoValue;
    }
  }
  for (std::size_t i = 0; i < cells.values.size(); ++i) {
    const auto count = static_cast<double>(gathered.counts[i]);
    cells.values[i] = count == 0.0 ? kNoNumber : cells.values[i] / count;
    gathered.most_in_a_cell = std::max(gathered.most_in_a_cell, gathered.counts[i]);
  }
  if (value.has_texts()) {
    name_cells(gathered, words, value);
  }
  return gathered;
}

void mark_filtered(Cells& cells, const Answer& answer) {
  for (const std::size_t cell : places_in(cells, answer)) {
    if (cell != SIZE_MAX && cells.states[cell] == CellState::kNoResult) {
      cells.states[cell] = CellState::kFiltered;
    }
  }
}

GatheredLines gathered_lines(const Answer& answer, const std::vector<double>& x_values) {
  struct Sum {
    double sum = 0.0;
    std::uint64_t count = 0;
  };
  const auto merged = [](const std::vector<double>& values, double value) {
    const auto next = std::lower_bound(values.begin(), values.end(), value);
    return next != values.begin() && counts_as_one({*(next - 1), value}) ? *(next - 1) : *next;
  };
  std::map<double, std::map<double, Sum>> lines;
  const auto places = axis_values(x_values, answer[0]);
  const auto names = answer.size() < 3 ? std::vector<double>{} : axis_values({}, answer[2]);
  const auto& x = answer[0].numbers;
  const auto& y = answer[1].numbers;
  for (std::size_t row = 0; row < x.size(); ++row) {
    const double by = answer.size() < 3 ? 0.0 : answer[2].numbers[row];
    if (!is_drawable(by) || !is_drawable(x[row])) {
      continue;
    }
    Sum& sum = lines[names.empty() ? by : merged(names, by)][merged(places, x[row])];
    if (!std::isnan(y[row])) {
      sum.sum += y[row];
      ++sum.count;
    }
  }
  GatheredLines gathered;
  for (auto& [value, points] : lines) {
    const double first = points.begin()->first;
    const double last = points.rbegin()->first;
    for (const double study_x : x_values) {
      const double at = merged(places, study_x);
      if (at > first && at < last) {
        points.try_emplace(at);
      }
    }
    Curve line{.by = value};
    for (const auto& [at, sum] : points) {
      line.x.push_back(at);
      line.y.push_back(sum.count > 0 ? sum.sum / static_cast<double>(sum.count) : kNoNumber);
      gathered.gaps += sum.count > 0 ? 0U : 1U;
      gathered.most_at_a_place = std::max(gathered.most_at_a_place, sum.count);
    }
    gathered.curves.push_back(std::move(line));
  }
  return gathered;
}

}  // namespace oblique::client::plot
