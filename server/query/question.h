#pragma once

#include <span>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// The columns of a query that selects none: the point, the axes that vary in the study, and the
/// main outputs. Without a block in the recipe H, mu and e stand for the axes.
std::vector<std::string> usual_columns(const protocol::Recipe& recipe);

/// The columns that `question` selects, as one text.
std::string selected_by(const protocol::StudyQuery& question);

/// Throws solver::InputError, naming the flag, for texts that are no part of a statement; see
/// check_sql_part.
void check_parts(const protocol::StudyQuery& question);

/// Throws solver::InputError for names that differ from one of `columns` only in case, and for a
/// column in a grouped row (or in the one row of all points) that is neither a key of the group nor
/// inside an aggregate: SQL would take its value from any point. `question` passed check_parts.
void check_columns(const protocol::StudyQuery& question, std::span<const std::string> columns);

}  // namespace oblique::server
