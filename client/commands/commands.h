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

/// Carries out the parsed command and returns the exit code. An empty Action means that no command
/// has been parsed.
using Action = std::function<int(Console& console)>;

/// A command and the values of its flags, which live as long as the command.
template <class Flags>
struct NewCommand {
  CLI::App& command;
  Flags& flags;
};

/// Adds a command. When the command is parsed, `parsed` becomes a call of `run`. If `examples` is
/// empty, the help shows the examples of `app`.
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

// Each of these functions adds commands with flags, help and examples to `app`. Those of `fit`,
// `map`, `sensitivity` and `uncertainty` are in client/explore.
void add_solve(CLI::App& app, Action& parsed);
void add_run(CLI::App& app, Action& parsed);
void add_study(CLI::App& app, Action& parsed);
void add_submit(CLI::App& app, Action& parsed);
/// Adds `status`, `watch` and `studies`.
void add_status(CLI::App& app, Action& parsed);
void add_workers(CLI::App& app, Action& parsed);
/// Adds `cancel`, `pause`, `resume`, `retry`, `describe`, `rename` and `delete`.
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
void add_sensitivity(CLI::App& app, Action& parsed);
void add_uncertainty(CLI::App& app, Action& parsed);
/// Adds `merge`, `backup` and `check`.
void add_database_files(CLI::App& app, Action& parsed);
void add_autoscale(CLI::App& app, Action& parsed);
/// `keygen` and `keys`.
void add_keys(CLI::App& app, Action& parsed);
void add_doctor(CLI::App& app, Action& parsed);
void add_map(CLI::App& app, Action& parsed);

/// Parses and carries out the command line. Returns the exit code: 0 done, 1 failed, 2 wrong usage,
/// 128 + number of the signal that stopped the command.
int run_command_line(Console& console, int argc, const char* const* argv);

/// Wraps help text from CLI11 to `width` characters. Wrapped descriptions continue at `column`,
/// other sentences at the start of the next line. Example commands are not wrapped.
std::string fitted_help(const std::string& help, std::size_t width, std::size_t column);

}  // namespace oblique::client
