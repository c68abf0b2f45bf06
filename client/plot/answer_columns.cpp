#include "client/plot/answer_columns.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "proto/wire/chunk_rows.h"

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
                      shown_count(kMostRows)));
    }
    ends = chunk.ends();
  }
  return columns;
}

}  // namespace oblique::client::plot
