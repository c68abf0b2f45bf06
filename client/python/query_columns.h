#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::python {

/// One column of an answer. Numbers stand in `reals` or, where all are whole and there, in
/// `integers`; a column with a text has all its values in `texts` and `kinds`.
struct AnswerColumn {
  std::string name;
  std::string unit;  ///< SI; empty for pure numbers and texts
  bool has_text = false;
  bool has_real = false;
  bool has_null = false;
  std::vector<char> kinds;  ///< a CellKind each
  std::vector<std::int64_t> integers;
  std::vector<double> reals;  ///< NaN for what is no number
  std::vector<std::string> texts;
};

/// The columns of an answer that comes in chunks.
class QueryColumns {
 public:
  /// The next chunk, which must be sound.
  void add(const protocol::QueryReply& chunk);
  std::vector<AnswerColumn>& columns() { return columns_; }

 private:
  std::vector<AnswerColumn> columns_;
};

}  // namespace oblique::python
