#pragma once

#include <string>

namespace oblique::protocol {

/// Makes spdlog's default logger write lines like
///     2026-11-21T05:46:10.153Z oblique-server info: ready
/// to standard error: UTC, as the database has it, and with all text from outside made visible
/// (text.h), so that no name or message of a peer steers a terminal or forges a line.
void set_up_log(const std::string& program);

}  // namespace oblique::protocol
