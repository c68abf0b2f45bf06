#pragma once

namespace oblique::client {

/// Parses the command line and does what it says: data to standard output, everything else to
/// standard error. The exit code: 0 done, 1 failed, 2 wrong usage, 128 and its number for a signal
/// that stopped a verb which ends in order.
int run_command_line(int argc, const char* const* argv);

}  // namespace oblique::client
