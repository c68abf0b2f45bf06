#pragma once

#include <string>

#include "server/database/sqlite.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {

/// The columns of the view `results` that `fault_of_arrays` needs, as a list for SQL. `when`, an
/// expression, says of which rows they are asked.
std::string array_columns_sql(const std::string& when);

/// Why the arrays of a solved row cannot be right, or an empty text: one that is not the JSON that
/// views.sql describes, instants that do not ascend, phases with gaps or in another order than the
/// mode's, a largest force, duration or time in stick that is not the arrays'. The columns of
/// `array_columns_sql` stand from `first` on in the present row of `row`; `reaction_peaks` may be
/// NULL.
std::string fault_of_arrays(const Statement& row, int first);

}  // namespace oblique::server
