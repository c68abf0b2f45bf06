#pragma once

#include <ostream>

#include <nlohmann/json.hpp>

#include "worker/solver/model/case_result.h"

namespace oblique::client {

/// Returns one result as `solve --json` prints it: SI units, names as in the database.
nlohmann::ordered_json json_of(const solver::CaseResult& result);

/// Prints the report that `solve` shows for one result.
void print_summary(std::ostream& out, const solver::CaseResult& result);

}  // namespace oblique::client
