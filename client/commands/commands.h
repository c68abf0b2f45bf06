#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include "client/io/console.h"
#include "proto/program/usage.h"

namespace oblique::client {

using protocol::kDone;
using protocol::kFailed;
using protocol::kWrongUsage;

/// What the command line asks for; returns the exit code. Empty until a command is parsed.
using Action = std::function<int(Console& console)>;

/// A command and the variables for its flags, which live as long.
template <class Flags>
struct NewCommand {
  CLI::App& command;
  Flags& flags;
};

/// Adds a command. When it is parsed, `parsed` becomes a call of `run`. Without `examples` the help
/// has those of `app`.
template <class Flags>
NewCommand<Flags> new_command(CLI::App& app, Action& parsed, const std::string& name,
                              const std::string& summary, const std::string& examples,
                              int (*run)(const Flags& flags, Console& console)) {
  auto* command = app.add_subcommand(name, summary);
  auto flags = std::make_shared<Flags>();
  if (!examples.empty()) {
    command->footer(examples);
  }
  command->callback([&parsed, flags, run] {
    parsed = [flags, run](Console& console) { return run(*flags, console); };
  });
  return {*command, *flags};
}

// Each adds its commands with flags, help and examples to `app`.
void add_solve(CLI::App& app, Action& parsed);
void add_run(CLI::App& app, Action& parsed);
void add_study(CLI::App& app, Action& parsed);
void add_submit(CLI::App& app, Action& parsed);
/// `status`, `watch` and `studies`.
void add_status(CLI::App& app, Action& parsed);
void add_workers(CLI::App& app, Action& parsed);
/// `cancel`, `pause`, `resume`, `retry`, `describe`, `rename` and `delete`.
void add_study_changes(CLI::App& app, Action& parsed);
/// `query` and `sql`.
void add_query(CLI::App& app, Action& parsed);
void add_trace(CLI::App& app, Action& parsed);
void add_plot(CLI::App& app, Action& parsed);
void add_view(CLI::App& app, Action& parsed);
void add_columns(CLI::App& app, Action& parsed);
void add_paper(CLI::App& app, Action& parsed);
void add_converge(CLI::App& app, Action& parsed);
void add_fit(CLI::App& app, Action& parsed);
/// `merge`, `backup` and `check`.
void add_database_files(CLI::App& app, Action& parsed);
void add_autoscale(CLI::App& app, Action& parsed);
/// `keygen` and `keys`.
void add_keys(CLI::App& app, Action& parsed);
void add_doctor(CLI::App& app, Action& parsed);
// In client/explore:
void add_map(CLI::App& app, Action& parsed);

/// Parses the command line and carries it out. Returns the exit code: 0 done, 1 failed, 2 wrong
/// usage, 128 and its number for a signal that stopped a command which ends in order.
int run_command_line(Console& console, int argc, const char* const* argv);

/// Help as CLI11 makes it, in lines of at most `width` characters where words allow it: meanings go
/// on below themselves, at `column`, and sentences in the next line. Commands are left whole.
std::string fitted_help(const std::string& help, std::size_t width, std::size_t column);

}  // namespace oblique::client
