#pragma once

#include <cstddef>
#include <string>

#include "worker/solver/model/trace_columns.h"

namespace oblique::client {

/// Appends the heading and lines of a trace (CSV, SI units), one line an accepted instant. The
/// columns are those of solver::trace_columns(), which says what each means.
void append_trace_header(std::string& text, const solver::TraceShape& shape);
void append_trace_row(std::string& text, const solver::TraceRow& row);

}  // namespace oblique::client
