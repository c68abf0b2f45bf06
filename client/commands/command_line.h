#pragma once

#include "client/io/console.h"

namespace oblique::client {

/// Parses the command line and carries it out. Returns the exit code: 0 done, 1 failed, 2 wrong
/// usage, 128 and its number for a signal that stopped a command which ends in order.
int run_command_line(Console& console, int argc, const char* const* argv);

}  // namespace oblique::client
