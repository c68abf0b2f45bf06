#pragma once

#include <cstddef>
#include <ostream>

#include <nlohmann/json.hpp>

#include "worker/solver/case_result.h"

namespace oblique::client {

/// One result as `solve --json` prints it: SI units, the field names that the database uses too.
nlohmann::ordered_json json_of(const solver::CaseResult& result);

/// One result for people.
void print_summary(std::ostream& out, const solver::CaseResult& result);

/// Heading and lines of a trace file (CSV): the contact's quantities, then the force on each link
/// at its inner end (R0 at the pin O, R1, R2, ... at the joints), x and y.
void print_trace_header(std::ostream& out, std::size_t links);
void print_trace_row(std::ostream& out, const solver::TraceRow& row);

}  // namespace oblique::client
