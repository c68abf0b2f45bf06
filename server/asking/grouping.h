#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// Throws solver::InputError, naming `flag`, if `question` has a row for each group, or one for all
/// points, and an item of `text` has one of `columns` that is neither inside an aggregate function
/// nor one of the keys of --group: SQL would take its value from any row of the group.
/// `names_given` are names of other items than these columns. The texts passed check_sql_part.
void check_grouped(std::string_view flag, std::string_view text,
                   const protocol::StudyQuery& question, std::vector<std::string> columns,
                   const std::vector<std::string>& names_given);

/// Whether `selected` gives a row for each point: it has no aggregate and no DISTINCT.
bool gives_points(std::string_view selected);

}  // namespace oblique::server
