#pragma once

#include <functional>

#include <CLI/CLI.hpp>

#include "proto/program/usage.h"

namespace oblique::client {

/// What a verb does once all is parsed; gives the exit code.
struct Command : std::function<int()> {
  using function::operator=;

  /// Whether the line may name the length of a single link. That is some hundred flags in all, and
  /// half of the time in which the program begins.
  bool names_single_lengths = true;
};

using protocol::kDone;
using protocol::kFailed;
using protocol::kWrongUsage;

// Each adds one verb with its flags, help and examples to `app`. When that verb is parsed,
// `command` is set to what it does.
void add_solve(CLI::App& app, Command& command);
void add_run(CLI::App& app, Command& command);
void add_submit(CLI::App& app, Command& command);
void add_status(CLI::App& app, Command& command);
void add_watch(CLI::App& app, Command& command);
void add_study(CLI::App& app, Command& command);
void add_studies(CLI::App& app, Command& command);
void add_workers(CLI::App& app, Command& command);
void add_cancel(CLI::App& app, Command& command);
void add_pause(CLI::App& app, Command& command);
void add_resume(CLI::App& app, Command& command);
void add_retry(CLI::App& app, Command& command);
void add_describe(CLI::App& app, Command& command);
void add_rename(CLI::App& app, Command& command);
void add_delete(CLI::App& app, Command& command);
void add_query(CLI::App& app, Command& command);
void add_sql(CLI::App& app, Command& command);
void add_trace(CLI::App& app, Command& command);
void add_plot(CLI::App& app, Command& command);
void add_columns(CLI::App& app, Command& command);
void add_paper(CLI::App& app, Command& command);
void add_converge(CLI::App& app, Command& command);
void add_fit(CLI::App& app, Command& command);
void add_merge(CLI::App& app, Command& command);
void add_backup(CLI::App& app, Command& command);
void add_check(CLI::App& app, Command& command);
void add_autoscale(CLI::App& app, Command& command);
void add_keygen(CLI::App& app, Command& command);
void add_keys(CLI::App& app, Command& command);
void add_view(CLI::App& app, Command& command);
void add_doctor(CLI::App& app, Command& command);

}  // namespace oblique::client
