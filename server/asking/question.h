#pragma once

#include <string>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// What is asked for where a question selects nothing.
inline constexpr const char* kUsualColumns =
    "point,H,mu,e,status,fn_peak_N,ft_peak_N,duration_s,slide_m,stick_total_s,major_mode";

/// The columns that `question` asks for, as one text.
std::string selected_by(const protocol::StudyQuery& question);

/// Throws solver::InputError, naming the flag, for texts that are no part of a statement; see
/// check_sql_part.
void check(const protocol::StudyQuery& question);

/// Throws solver::InputError for names that differ from one of `columns` only in case, and for
/// columns that have many values in a group, or in the one row that a function makes of all. The
/// question was checked.
void check_columns(const protocol::StudyQuery& question, const std::vector<std::string>& columns);

}  // namespace oblique::server
