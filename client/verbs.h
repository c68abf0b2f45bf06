#pragma once

#include <functional>

#include <CLI/CLI.hpp>

namespace oblique::client {

/// What a verb does once all is parsed; gives the exit code.
using Command = std::function<int()>;

inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongUsage = 2;

// Each adds one verb with its flags, help and examples to `app`. When that verb is parsed,
// `command` is set to what it does.
void add_solve(CLI::App& app, Command& command);
void add_run(CLI::App& app, Command& command);
void add_submit(CLI::App& app, Command& command);
void add_status(CLI::App& app, Command& command);
void add_watch(CLI::App& app, Command& command);
void add_studies(CLI::App& app, Command& command);
void add_workers(CLI::App& app, Command& command);
void add_cancel(CLI::App& app, Command& command);
void add_pause(CLI::App& app, Command& command);
void add_resume(CLI::App& app, Command& command);
void add_retry(CLI::App& app, Command& command);
void add_query(CLI::App& app, Command& command);
void add_sql(CLI::App& app, Command& command);
void add_columns(CLI::App& app, Command& command);
void add_paper(CLI::App& app, Command& command);
void add_converge(CLI::App& app, Command& command);
void add_fit(CLI::App& app, Command& command);
void add_backup(CLI::App& app, Command& command);
void add_check(CLI::App& app, Command& command);

/// Parses the command line and does what it says: data to standard output, everything else to
/// standard error. The exit code: 0 done, 1 failed, 2 wrong usage, 128 and its number for a signal
/// that stopped a verb which ends in order.
int run_command_line(int argc, const char* const* argv);

}  // namespace oblique::client
