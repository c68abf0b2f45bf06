#pragma once

#include <string>

namespace oblique::protocol {

/// Settings of the log. The options --log-level and --log-format set them.
struct LogSettings {
  std::string level = "info";   ///< lowest level that is logged: debug, info, warning or error
  std::string format = "text";  ///< or "json"
};

/// Makes spdlog's default logger write lines such as
///     2026-11-21T05:46:10.153Z oblique-server info: ready
/// to standard error, with times in UTC. Text from outside is escaped (text.h), so that no peer can
/// control a terminal or forge a line. If standard error is systemd's journal, the lines lack time
/// and program name, because the journal adds these:
///     <6>ready
/// where the number is the level. With format "json" each line is a JSON object with
/// `time`, `level`, `program` and `message`, always valid JSON and UTF-8. May be called again.
void set_up_log(const std::string& program, const LogSettings& settings = {});

}  // namespace oblique::protocol
