#pragma once

#include <cstddef>
#include <string>

#include "client/io/console.h"

namespace oblique::client {

/// Parses the command line and carries it out. Returns the exit code: 0 done, 1 failed, 2 wrong
/// usage, 128 and its number for a signal that stopped a command which ends in order.
int run_command_line(Console& console, int argc, const char* const* argv);

/// Help as CLI11 makes it, in lines of at most `width` characters where words allow it: meanings go
/// on below themselves, at `column`, and sentences in the next line. Commands are left whole.
std::string fitted_help(const std::string& help, std::size_t width, std::size_t column);

}  // namespace oblique::client
