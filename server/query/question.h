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

/// Checks the texts of `question` by check_sql_part. Throws solver::InputError, which names the
/// flag.
void check_parts(const protocol::StudyQuery& question);

/// Throws solver::InputError for names that differ from one of `columns` only in case, and for a
/// column in a grouped row (or in the one row of all points) that is neither a key of the group nor
/// inside an aggregate: SQL would take its value from any point. `question` must have passed
/// check_parts.
void check_columns(const protocol::StudyQuery& question, std::span<const std::string> columns);

}  // namespace oblique::server
