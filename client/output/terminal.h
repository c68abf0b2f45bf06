#pragma once

#include <cstddef>

namespace oblique::client {

/// Whether standard error is a terminal, on which progress may be drawn over itself.
bool draws_on_terminal();

/// How many characters a line of standard error's terminal has; 80 where it does not tell. It may
/// change meanwhile.
std::size_t terminal_columns();

}  // namespace oblique::client
