#pragma once

#include <CLI/CLI.hpp>

#include "proto/program/completion/offers.h"

namespace oblique::protocol {

/// Answers `PROGRAM __complete SHELL ...`, as the scripts in proto/program/completion ask, and
/// ends the program, with 0 and without a word beside the answer.
/// Returns for any other command line. `app` has all its verbs and options.
void answer_shell(CLI::App& app, int argc, const char* const* argv, const ValuesOf& values = {});

}  // namespace oblique::protocol
