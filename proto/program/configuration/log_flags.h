#pragma once

#include <CLI/CLI.hpp>

#include "proto/program/configuration/configuration.h"
#include "proto/program/log.h"

namespace oblique::protocol {

/// Adds --log-level, --log-format and --quiet, which must not outlive `settings`.
void add_log_flags(CLI::App& app, Configuration& configuration, LogSettings& settings);

}  // namespace oblique::protocol
