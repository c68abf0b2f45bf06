#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "client/service/source.h"
#include "proto/oblique.pb.h"

namespace oblique::client::plot {

/// One column of an answer, held for drawing.
struct AnswerColumn {
  std::string name;
  std::string unit;                             ///< SI; empty: none, or not known
  std::vector<double> numbers = {};             ///< of each row; NaN: NULL, or a text
  std::vector<std::string> words = {};          ///< the different texts
  std::vector<std::uint32_t> word_of_row = {};  ///< empty: there is no text in it
  static constexpr std::uint32_t kNoWord = UINT32_MAX;

  bool has_texts() const { return !words.empty(); }
  /// Whether a row has neither a number nor a text.
  bool is_null(std::size_t row) const;
  /// "" where the row has no text.
  const std::string& text(std::size_t row) const;
};

/// More rows are not held: a picture of them wants a narrower question.
inline constexpr std::size_t kMostRows = 20'000'000;

/// All rows of an answer: 8 bytes a value. Throws what the stream throws, and std::runtime_error
/// for more than kMostRows.
std::vector<AnswerColumn> read_columns(RowStream& stream);

}  // namespace oblique::client::plot
