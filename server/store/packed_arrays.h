#pragma once

#include <string>

#include "server/database/sqlite.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {

/// The list as a column packs it: a JSON array with an array for each element. Doubles keep their
/// bits; a whole number keeps its ".0", so that SQL takes it for a real.
std::string packed(const solver::ResultList& list, const solver::CaseResult& result);

/// The columns that `fault_of_arrays` needs, as a list for SQL, of a database of that schema. What
/// the schema does not have yet is NULL.
std::string array_columns_sql(int schema);

/// Why the arrays of a solved row cannot be right, or an empty text: one that is not the JSON that
/// schema.sql describes, instants that do not ascend, phases with gaps or in another order than the
/// mode's, a largest force, duration or time in stick that is not the arrays'. The columns of
/// `array_columns_sql` stand from `first` on in the present row of `row`; lists that later schemas
/// brought may be NULL.
std::string fault_of_arrays(const Statement& row, int first);

}  // namespace oblique::server
