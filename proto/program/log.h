#pragma once

#include <string>

namespace oblique::protocol {

/// How a program logs; the names are those of --log-level and --log-format.
struct LogSettings {
  std::string level = "info";   ///< "debug", "info", "warning" or "error": lines below are left out
  std::string format = "text";  ///< or "json"
};

/// Makes spdlog's default logger write lines like
///     2026-11-21T05:46:10.153Z oblique-server info: ready
/// to standard error: UTC, as the database has it, and with all text from outside made visible
/// (text.h), so that no name or message of a peer steers a terminal or forges a line. Where
/// standard error is the journal, which has times and names itself, the lines are like
///     <6>ready
/// with the level as the journal reads it. As "json" each line is an object with `time`, `level`,
/// `program` and `message`, always valid JSON and UTF-8. May be called again.
void set_up_log(const std::string& program, const LogSettings& settings = {});

}  // namespace oblique::protocol
