#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/service/source.h"
#include "client/study/study.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// What to show of the results of a study. Texts are SQL over the columns of the view `runs`.
struct ResultQuery {
  std::string study;
  std::string where;  ///< empty: all points
  std::string select{
      "point,H,mu,e,status,fn_peak_N,ft_peak_N,duration_s,slide_m,stick_total_s,major_mode"};
  std::string order{"point"};         ///< empty: as it comes
  std::optional<std::int64_t> limit;  ///< none: all rows
};

/// Throws solver::InputError, naming the flag, for a limit below 0 and for texts that are no part
/// of a statement; see check_sql_part.
void check(const ResultQuery& query);

/// Throws solver::InputError for names that differ from a column of `source` only in case.
void check_columns(const ResultQuery& query, Source& source);

/// The statement, from row `skipped` of what it gives. `query` was checked.
std::string statement_of(const ResultQuery& query, std::int64_t skipped);

/// The statement for the first `rows` points of a study: the columns that tell its points apart,
/// then the results most asked for.
std::string statement_of_first_results(const Study& study, std::int64_t rows);

/// The rows. A server cuts long answers off; the rest is asked for while the study is `at_rest`,
/// for new rows would shift the parts against each other.
protocol::QueryReply all_rows(Source& source, const ResultQuery& query, bool at_rest);

}  // namespace oblique::client
