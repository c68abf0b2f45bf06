#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/study/study.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// What to show of the results of a study. Texts are SQL over the columns of the view `runs`.
struct ResultQuery {
  std::string study;
  std::string where;  ///< empty: all points
  std::string select{
      "point,H,mu,e,status,fn_peak_N,ft_peak_N,duration_s,slide_m,stick_total_s,major_mode"};
  std::string group;                  ///< columns of which each row has other values; empty: none
  std::string order{"point"};         ///< with a group, left so: its columns
  std::optional<std::int64_t> limit;  ///< none: all rows
  bool explain = false;               ///< the plan of the answer, and not the answer
};

/// Throws solver::InputError, naming the flag, for a limit below 0 and for texts that are no part
/// of a statement; see check_sql_part.
void check(const ResultQuery& query);

/// The same as a question.
protocol::QueryRequest request_for(const ResultQuery& query);

/// The statement for the first `rows` points of a study: the columns that tell its points apart,
/// then the results most asked for.
std::string statement_of_first_results(const Study& study, std::int64_t rows);

}  // namespace oblique::client
