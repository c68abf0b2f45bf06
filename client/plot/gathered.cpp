#include "client/plot/gathered.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <tuple>
#include <unordered_map>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/format_units.h"
#include "proto/wire/chunk.h"

namespace oblique::client::plot {
namespace {

using protocol::CellKind;

/// Adds the values of one column, row by row.
class ColumnReader {
 public:
  explicit ColumnReader(AnswerColumn& column) : column_(column) {}

  void add(const protocol::Cell& cell) {
    column_.numbers.push_back(cell.kind == CellKind::kReal ? cell.real
                              : cell.kind == CellKind::kInteger
                                  ? static_cast<double>(cell.integer)
                                  : std::numeric_limits<double>::quiet_NaN());
    if (cell.kind == CellKind::kText) {
      // Rows before the first text have none.
      column_.word_of_row.resize(column_.numbers.size() - 1, AnswerColumn::kNoWord);
      column_.word_of_row.push_back(number_of(cell.text));
    } else if (!column_.word_of_row.empty()) {
      column_.word_of_row.push_back(AnswerColumn::kNoWord);
    }
  }

 private:
  std::uint32_t number_of(std::string_view text) {
    // Neighbours are often alike.
    if (last_ < column_.words.size() && column_.words[last_] == text) {
      return last_;
    }
    const auto next = static_cast<std::uint32_t>(column_.words.size());
    const auto [place, is_new] = numbers_.emplace(std::string(text), next);
    if (is_new) {
      column_.words.emplace_back(text);
    }
    last_ = place->second;
    return last_;
  }

  AnswerColumn& column_;
  std::unordered_map<std::string, std::uint32_t> numbers_;
  std::uint32_t last_ = 0;
};

constexpr std::size_t kNowhere = SIZE_MAX;
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

/// Puts rows into cells, one after another.
class CellGatherer {
 public:
  CellGatherer(std::vector<double> x_edges, std::vector<double> y_edges) {
    gathered_.cells.x_edges = std::move(x_edges);
    gathered_.cells.y_edges = std::move(y_edges);
    const std::size_t cells = gathered_.cells.columns() * gathered_.cells.rows();
    gathered_.cells.values.assign(cells, 0.0);
    gathered_.cells.states.assign(cells, CellState::kNoResult);
    gathered_.counts.assign(cells, 0);
  }

  void add(const MapRows& rows, std::size_t row, std::size_t column_of_cell,
           std::size_t row_of_cell) {
    const std::size_t cell = row_of_cell * gathered_.cells.columns() + column_of_cell;
    auto& state = gathered_.cells.states[cell];
    ++gathered_.points;
    if (rows.value.is_null(row)) {
      // A cell with a value keeps it; one that failed says more than one without a value.
      const bool failed = rows.status.text(row) == "failed";
      if (state == CellState::kNoResult || (failed && state == CellState::kNoValue)) {
        state = failed ? CellState::kFailed : CellState::kNoValue;
      }
      return;
    }
    if (rows.value.has_texts()) {
      // A column of texts may have numbers among them.
      words_.push_back({cell, rows.value.word_of_row[row]});
    } else {
      gathered_.cells.values[cell] += rows.value.numbers[row];
    }
    ++gathered_.counts[cell];
    state = CellState::kSolved;
  }

  Gathered gathered(const MapRows& rows) {
    for (std::size_t i = 0; i < gathered_.counts.size(); ++i) {
      auto& value = gathered_.cells.values[i];
      value =
          gathered_.counts[i] == 0 ? kNoNumber : value / static_cast<double>(gathered_.counts[i]);
      gathered_.most_in_a_cell = std::max(gathered_.most_in_a_cell, gathered_.counts[i]);
    }
    if (rows.value.has_texts()) {
      count_names(rows.value);
      name_cells(rows.value);
    }
    return std::move(gathered_);
  }

 private:
  struct WordOfCell {
    std::size_t cell;
    std::uint32_t word;

    bool operator<(const WordOfCell& other) const {
      return std::tie(cell, word) < std::tie(other.cell, other.word);
    }
  };

  /// The text that each cell has most often; of those that are equally many the first in the
  /// answer.
  void name_cells(const AnswerColumn& column) {
    gathered_.cells.names.resize(gathered_.counts.size());
    std::sort(words_.begin(), words_.end());
    for (auto at = words_.begin(); at != words_.end();) {
      const auto cell_ends = std::upper_bound(at, words_.end(), WordOfCell{at->cell, UINT32_MAX});
      gathered_.mixed_cells += at->word == (cell_ends - 1)->word ? 0U : 1U;
      const std::size_t cell = at->cell;
      std::ptrdiff_t most = 0;
      while (at != cell_ends) {
        const auto word_ends = std::upper_bound(at, cell_ends, *at);
        if (word_ends - at > most) {
          most = word_ends - at;
          gathered_.cells.names[cell] = name_of_word(column, at->word);
        }
        at = word_ends;
      }
    }
    words_.clear();
  }

  void count_names(const AnswerColumn& column) {
    std::map<std::uint32_t, std::uint64_t> points_of_word;
    for (const WordOfCell& each : words_) {
      ++points_of_word[each.word];
    }
    for (const auto& [word, points] : points_of_word) {
      gathered_.points_of_name[name_of_word(column, word)] += points;
    }
  }

  static std::string name_of_word(const AnswerColumn& column, std::uint32_t word) {
    return word == AnswerColumn::kNoWord ? std::string() : column.words[word];
  }

  Gathered gathered_;
  std::vector<WordOfCell> words_;
};

/// Where each row's value is among `values`, which rise and have it.
std::vector<std::size_t> places_among(const std::vector<double>& values,
                                      const AnswerColumn& column) {
  std::vector<std::size_t> places;
  places.reserve(column.numbers.size());
  std::size_t last = 0;
  for (const double number : column.numbers) {
    if (last >= values.size() || values[last] != number) {
      const auto found = std::lower_bound(values.begin(), values.end(), number);
      last = static_cast<std::size_t>(found - values.begin());
    }
    places.push_back(last < values.size() && values[last] == number ? last : kNowhere);
  }
  return places;
}

std::vector<std::size_t> places_in_bins(const Scale& scale, std::size_t cells,
                                        const AnswerColumn& column) {
  std::vector<std::size_t> places;
  places.reserve(column.numbers.size());
  for (const double number : column.numbers) {
    const double share = scale.share_of(number);
    const bool is_in = share >= 0.0 && share <= 1.0;
    places.push_back(
        is_in ? std::min(static_cast<std::size_t>(share * static_cast<double>(cells)), cells - 1)
              : kNowhere);
  }
  return places;
}

Gathered gathered_at(const MapRows& rows, const std::vector<std::size_t>& x,
                     const std::vector<std::size_t>& y, CellGatherer gatherer) {
  for (std::size_t row = 0; row < x.size(); ++row) {
    if (x[row] != kNowhere && y[row] != kNowhere) {
      gatherer.add(rows, row, x[row], y[row]);
    }
  }
  return gatherer.gathered(rows);
}

}  // namespace

bool AnswerColumn::is_null(std::size_t row) const {
  return std::isnan(numbers[row]) && (word_of_row.empty() || word_of_row[row] == kNoWord);
}

const std::string& AnswerColumn::text(std::size_t row) const {
  static const std::string kEmpty;
  return word_of_row.empty() || word_of_row[row] == kNoWord ? kEmpty : words[word_of_row[row]];
}

std::vector<AnswerColumn> read_columns(RowStream& stream) {
  std::vector<AnswerColumn> columns;
  std::vector<ColumnReader> readers;
  for (bool ends = false; !ends;) {
    const protocol::QueryReply chunk = stream.next();
    if (readers.empty()) {
      columns.resize(static_cast<std::size_t>(chunk.columns_size()));
      for (int i = 0; i < chunk.columns_size(); ++i) {
        auto& column = columns[static_cast<std::size_t>(i)];
        column.name = chunk.columns(i);
        column.unit = i < chunk.units_size() ? chunk.units(i) : std::string();
        readers.emplace_back(column);
      }
    }
    protocol::ChunkRows rows(chunk);
    while (rows.next()) {
      for (std::size_t i = 0; i < readers.size(); ++i) {
        readers[i].add(rows.cell(i));
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

std::vector<double> axis_values(std::vector<double> of_study, const AnswerColumn& column) {
  std::sort(of_study.begin(), of_study.end());
  std::vector<double> others;
  for (const double number : column.numbers) {
    if (!std::isnan(number) && (others.empty() || others.back() != number) &&
        !std::binary_search(of_study.begin(), of_study.end(), number)) {
      others.push_back(number);
    }
  }
  of_study.insert(of_study.end(), others.begin(), others.end());
  std::sort(of_study.begin(), of_study.end());
  of_study.erase(std::unique(of_study.begin(), of_study.end()), of_study.end());
  return of_study;
}

Gathered gathered_on(const MapRows& rows, const std::vector<double>& x_values,
                     const std::vector<double>& y_values, bool is_x_logarithmic,
                     bool is_y_logarithmic) {
  auto gathered = gathered_at(rows, places_among(x_values, rows.x), places_among(y_values, rows.y),
                              CellGatherer(edges_between(x_values, is_x_logarithmic),
                                           edges_between(y_values, is_y_logarithmic)));
  gathered.cells.x_values = x_values;
  gathered.cells.y_values = y_values;
  return gathered;
}

void mark_filtered(Cells& cells, const AnswerColumn& x, const AnswerColumn& y) {
  const auto columns = places_among(cells.x_values, x);
  const auto rows = places_among(cells.y_values, y);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i] != kNowhere && rows[i] != kNowhere) {
      auto& state = cells.states[rows[i] * cells.columns() + columns[i]];
      state = state == CellState::kNoResult ? CellState::kFiltered : state;
    }
  }
}

Gathered gathered_in_bins(const MapRows& rows, const Scale& x, std::size_t x_cells, const Scale& y,
                          std::size_t y_cells) {
  auto gathered =
      gathered_at(rows, places_in_bins(x, x_cells, rows.x), places_in_bins(y, y_cells, rows.y),
                  CellGatherer(x.edges(x_cells), y.edges(y_cells)));
  auto& states = gathered.cells.states;
  std::replace(states.begin(), states.end(), CellState::kNoResult, CellState::kNoPoint);
  return gathered;
}

GatheredLines gathered_lines(const AnswerColumn& x, const AnswerColumn& y, const AnswerColumn* by,
                             const std::vector<double>& x_values) {
  struct Sum {
    double sum = 0.0;
    std::uint64_t count = 0;
  };
  std::map<double, std::map<double, Sum>> lines;
  for (std::size_t row = 0; row < x.numbers.size(); ++row) {
    const double value_of_by = by == nullptr ? 0.0 : by->numbers[row];
    if (std::isnan(value_of_by) || std::isnan(x.numbers[row])) {
      continue;
    }
    Sum& sum = lines[value_of_by][x.numbers[row]];
    if (!std::isnan(y.numbers[row])) {
      sum.sum += y.numbers[row];
      ++sum.count;
    }
  }
  GatheredLines gathered;
  for (auto& [value, points] : lines) {
    const double first = points.begin()->first;
    const double last = points.rbegin()->first;
    const auto begin = std::upper_bound(x_values.begin(), x_values.end(), first);
    const auto end = std::lower_bound(begin, x_values.end(), last);
    std::for_each(begin, end, [&points = points](double at) { points.try_emplace(at); });
    Curve line;
    line.by = value;
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
