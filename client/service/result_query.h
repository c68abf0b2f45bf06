#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// What to show of the results of a study. Texts are SQL over the columns of the view `runs`.
struct ResultQuery {
  std::string study;
  std::string where;   ///< empty: all points
  std::string select;  ///< empty: the axes that vary and the main outputs, of a group its columns
  std::string group;   ///< columns of which each row has other values; empty: none
  std::string order;   ///< empty: by point, of a group by its columns
  std::optional<std::int64_t> limit;  ///< none: all rows
};

/// Throws solver::InputError, naming the flag, for a limit below 0 and for texts that are no part
/// of a statement; see check_sql_part.
void check(const ResultQuery& query);

/// The same as a question.
protocol::QueryRequest request_for(const ResultQuery& query);

/// The question for the first `rows` points of a study.
protocol::QueryRequest first_results(const std::string& study, std::int64_t rows);

}  // namespace oblique::client
