#pragma once

#include <cstddef>
#include <ostream>

#include "worker/solver/model/trace.h"

namespace oblique::client {

/// Heading and lines of a trace (CSV, SI units), one line an accepted instant: the contact's
/// quantities, the force on each link at its inner end (R0 at the pin O, R1, R2, ... at the
/// joints), energies and momentum of the chain, and where asked for the positions of its nodes
/// (node0 is O, the last one the tip). worker/solver/README.md says what each column means. `nodes`
/// is 0 for traces without shape.
void print_trace_header(std::ostream& out, std::size_t links, std::size_t nodes);
void print_trace_row(std::ostream& out, const solver::TraceRow& row);

}  // namespace oblique::client
