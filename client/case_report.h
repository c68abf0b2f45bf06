#pragma once

#include <ostream>

#include <nlohmann/json.hpp>

#include "worker/solver/case_result.h"

namespace oblique::client {

/// One result as `solve --json` prints it: SI units, the field names that the database uses too.
nlohmann::ordered_json json_of(const solver::CaseResult& result);

/// One result for people.
void print_summary(std::ostream& out, const solver::CaseResult& result);

/// Heading and lines of a trace file (CSV).
void print_trace_header(std::ostream& out);
void print_trace_row(std::ostream& out, const solver::TraceRow& row);

}  // namespace oblique::client
