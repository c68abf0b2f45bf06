#pragma once

#include <ostream>

#include <nlohmann/json.hpp>

#include "worker/solver/model/case_result.h"

namespace oblique::client {

/// One result as `solve --json` prints it: SI units, the field names that the database uses too.
nlohmann::ordered_json json_of(const solver::CaseResult& result);

/// One result for people.
void print_summary(std::ostream& out, const solver::CaseResult& result);

}  // namespace oblique::client
