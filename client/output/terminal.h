#pragma once

#include <cstddef>

namespace oblique::client {

/// Whether standard error is a terminal, on which progress may be drawn over itself.
bool draws_on_terminal();

/// How many characters a line of standard error's terminal has; 80 where it does not tell. It may
/// change meanwhile.
std::size_t terminal_columns();

/// Whether what is written to that descriptor may have colours: it is a terminal that knows them,
/// and NO_COLOR is not set.
bool may_colour(int descriptor);

}  // namespace oblique::client
