#pragma once

#include <string>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// The columns of a question that selects none: the point, the axes that vary in the study, and the
/// main outputs. Without a block in the recipe H, mu and e stand for the axes.
std::vector<std::string> usual_columns(const protocol::Recipe& recipe);

/// The columns that `question` selects, as one text.
std::string selected_by(const protocol::StudyQuery& question);

/// Throws solver::InputError, naming the flag, for texts that are no part of a statement; see
/// check_sql_part.
void check(const protocol::StudyQuery& question);

/// Throws solver::InputError for names that differ from one of `columns` only in case, and for
/// columns of a row of a group that are neither keys nor aggregated; see check_grouped. The
/// question passed `check`.
void check_columns(const protocol::StudyQuery& question, const std::vector<std::string>& columns);

}  // namespace oblique::server
