#include "client/plot/gathered.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/format_units.h"
#include "proto/wire/chunk.h"

namespace oblique::client::plot {
namespace {

using protocol::CellKind;
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

/// The cell of each row of an answer of x and y; SIZE_MAX: none.
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

/// A text in a cell.
using WordOfCell = std::pair<std::size_t, std::uint32_t>;

/// Names each cell by the text that it has most often; of those that are equally many by the first
/// in the answer.
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
    word_of_row.resize(numbers.size(), kNoWord);  // rows before the first text have none
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
    if (!columns.empty() && columns.front().numbers.size() > kMostRows) {
      throw std::runtime_error(
          fmt::format("a picture is made of at most {} points, and these are more: take fewer by "
                      "--where or --at",
                      format_count(kMostRows)));
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
    return std::isnan(number) || std::binary_search(of_study.begin(), of_study.end(), number);
  });
  of_study.insert(of_study.end(), others.begin(), others.end());
  std::sort(of_study.begin(), of_study.end());
  // Another machine may have computed a value with another last bit.
  const auto end = std::unique(of_study.begin(), of_study.end(), [](double a, double b) {
    return std::abs(b - a) <= 1e-12 * std::abs(b);
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
  std::map<double, std::map<double, Sum>> lines;
  const auto& x = answer[0].numbers;
  const auto& y = answer[1].numbers;
  for (std::size_t row = 0; row < x.size(); ++row) {
    const double by = answer.size() < 3 ? 0.0 : answer[2].numbers[row];
    if (std::isnan(by) || std::isnan(x[row])) {
      continue;
    }
    Sum& sum = lines[by][x[row]];
    if (!std::isnan(y[row])) {
      sum.sum += y[row];
      ++sum.count;
    }
  }
  GatheredLines gathered;
  for (auto& [value, points] : lines) {
    const double first = points.begin()->first;
    const double last = points.rbegin()->first;
    for (const double at : x_values) {
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
