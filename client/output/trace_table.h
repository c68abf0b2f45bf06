#pragma once

#include <cstddef>
#include <ostream>

#include "worker/solver/model/trace_columns.h"

namespace oblique::client {

/// Heading and lines of a trace (CSV, SI units), one line an accepted instant. The columns are
/// those of solver::trace_columns(), which says what each means.
void print_trace_header(std::ostream& out, const solver::TraceShape& shape);
void print_trace_row(std::ostream& out, const solver::TraceRow& row);

}  // namespace oblique::client
