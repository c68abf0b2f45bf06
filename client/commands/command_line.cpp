#include "client/commands/commands.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <exception>
#include <map>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"
#include "client/io/row_output.h"
#include "proto/program/origin/origin.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"
#include "server/query/columns.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

/// Column at which the descriptions of flags and commands begin.
constexpr std::size_t kHelpColumn = 28;

constexpr const char* kExamples = R"(Examples:
  oblique solve --H 1 --mu 0.4 --e 1               one impact, in this process
  oblique run deploy/studies/paper.toml            a study, on this machine
  oblique query paper --where "mu > 0.5"           its results
  oblique COMMAND --help                           flags and examples of a command

Exit codes: 0 done, 1 failed, 2 wrong usage, 130 stopped by Ctrl-C (128 + number of the signal).)";

/// Wraps the description of a flag or command, which begins at `column`. Leaves lines that begin
/// with "oblique" unchanged: they are example commands with a remark.
std::string fitted_meaning(const std::string& line, std::size_t width, std::size_t column) {
  if (line.size() <= width || width <= column || line.size() <= column || line[column - 1] != ' ' ||
      line[column] == ' ' || line.starts_with("  oblique ")) {
    return line;
  }
  const auto meaning = wrapped(line.substr(column), width - column);
  return line.substr(0, column) +
         fmt::format("{}", fmt::join(meaning, '\n' + std::string(column, ' ')));
}

void add_commands(CLI::App& app, Action& parsed) {
  for (const auto add :
       {add_solve,          add_run,       add_study, add_submit, add_status,      add_workers,
        add_study_changes,  add_query,     add_trace, add_plot,   add_view,        add_columns,
        add_paper,          add_converge,  add_fit,   add_map,    add_sensitivity, add_uncertainty,
        add_database_files, add_autoscale, add_keys,  add_doctor}) {
    add(app, parsed);
  }
}

/// Flags that every command has.
struct VerbosityFlags {
  bool quiet = false;
  bool verbose = false;
};

void add_verbosity_flags(CLI::App& command, VerbosityFlags& flags) {
  command.add_flag("--quiet", flags.quiet, "print only data and errors");
  if (command.get_option_no_throw("--verbose") == nullptr) {
    command.add_flag("--verbose", flags.verbose,
                     "also print what is done, where, and how long it takes");
  }
  for (auto* each : command.get_subcommands({})) {
    add_verbosity_flags(*each, flags);
  }
}

/// Returns the innermost command that was parsed, or the program itself.
CLI::App& parsed_command(CLI::App& app) {
  const auto commands = app.get_subcommands();
  return commands.empty() ? app : parsed_command(*commands.front());
}

/// Returns the command as the user types it: "oblique keys list".
std::string words_of(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  return parent == nullptr ? command.get_name() : words_of(*parent) + ' ' + command.get_name();
}

int wrong_usage(Console& console, const CLI::App& command, const std::string& message) {
  const auto words = words_of(command);
  console.error(words, message);
  console.errors() << fmt::format("Try `{} --help`.\n", words);
  return kWrongUsage;
}

/// Returns our name for a command that other programs call `command`, or an empty text. The table
/// has only names that the search for the nearest name would not find.
std::string other_name_of(const std::string& command) {
  const std::map<std::string_view, const char*> names{
      {"server", "oblique-server"}, {"worker", "oblique-worker"}, {"list", "oblique studies"}};
  const auto found = names.find(command);
  return found == names.end() ? "" : found->second;
}

int parse(Console& console, CLI::App& app, int argc, const char* const* argv) {
  const auto empty = protocol::empty_value_error(argc, argv);
  try {
    app.parse(argc, argv);
    return empty.empty() ? kDone : wrong_usage(console, parsed_command(app), empty);
  } catch (const CLI::ParseError& error) {
    if (!empty.empty()) {
      return wrong_usage(console, parsed_command(app), empty);
    }
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      std::ostringstream help;
      const int exit_code = app.exit(error, help, console.errors());
      const std::size_t width = terminal_size(STDOUT_FILENO).columns;
      console.out() << (width > 0 ? fitted_help(help.str(), width, kHelpColumn) : help.str());
      return protocol::end_output(console.out(), words_of(parsed_command(app)), exit_code);
    }
    auto& command = parsed_command(app);
    const auto unexpected = app.remaining(true);
    const auto other = unexpected.empty() ? "" : other_name_of(unexpected.front());
    return wrong_usage(
        console, command,
        &command == &app && !other.empty()
            ? fmt::format("unknown command `{}` (did you mean `{}`?)", unexpected.front(), other)
            : protocol::parse_error_message(app, command, error));
  }
}

int carry_out(Console& console, const std::string& words, const Action& action) {
  try {
    return protocol::end_output(console.out(), words, action(console));
  } catch (const ClosedPipe&) {
    return protocol::kReaderGone;
  } catch (const solver::InputError& error) {
    console.error(words, error.what());
    return kWrongUsage;
  } catch (const std::exception& error) {
    console.out().flush();
    console.error(words, protocol::failure_text(error));
    return kFailed;
  }
}

int execute(Console& console, CLI::App& app, const Action& action, const VerbosityFlags& flags) {
  const auto& command = parsed_command(app);
  const auto words = words_of(command);
  const bool verbose = flags.verbose || command.count("--verbose") > 0;
  if (flags.quiet && verbose) {
    return wrong_usage(console, command,
                       "--quiet and --verbose contradict each other: give only one");
  }
  console.set_verbosity(flags.quiet ? Verbosity::kQuiet
                        : verbose   ? Verbosity::kVerbose
                                    : Verbosity::kNormal);
  const auto start = std::chrono::steady_clock::now();
  console.detail(fmt::format("{}, version {}", words, protocol::version_and_commit()));
  const int code = carry_out(console, words, action);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  console.detail(fmt::format("{} {} after {}", words, code == kDone ? "is done" : "has failed",
                             format_duration(elapsed.count())));
  return code;
}

/// For shell completion: the column names, for each flag whose value names columns.
protocol::ValueWords columns_of_values() {
  std::vector<std::string> names;
  for (const auto& column : server::all_columns()) {
    names.push_back(column.name);
  }
  protocol::ValueWords words;
  for (const char* const value : {"COLUMNS", "COLUMN", "COL", "CONDITION", "EXPR", "OUTPUT", "X,Y",
                                  "STATEMENT", "--x", "--y", "--by"}) {
    words[value] = names;
  }
  return words;
}

}  // namespace

std::string fitted_help(const std::string& help, std::size_t width, std::size_t column) {
  std::string text;
  std::vector<std::string> sentences;  // the lines of one paragraph
  const auto end_paragraph = [&] {
    const bool fits = std::ranges::all_of(
        sentences, [width](const std::string& line) { return line.size() <= width; });
    if (!fits) {
      sentences = wrapped(fmt::format("{}", fmt::join(sentences, " ")), width);
    }
    for (const std::string& line : sentences) {
      text += line + '\n';
    }
    sentences.clear();
  };
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && !line.starts_with(' ')) {
      sentences.push_back(line);
    } else {
      end_paragraph();
      text += fitted_meaning(line, width, column) + '\n';
    }
  }
  end_paragraph();
  return text;
}

int run_command_line(Console& console, int argc, const char* const* argv) {
  CLI::App app("Solves and studies the oblique impact of a flexible robotic finger.", "oblique");
  app.set_version_flag("--version", "oblique " + protocol::version_and_commit());
  app.footer(kExamples);
  app.require_subcommand(1);
  app.get_formatter()->column_width(kHelpColumn);
  Action action;
  add_commands(app, action);
  VerbosityFlags verbosity;
  add_verbosity_flags(app, verbosity);
  if (const auto exit_code = protocol::print_completion(app, argc, argv, columns_of_values())) {
    return *exit_code;
  }
  if (argc == 1) {
    return wrong_usage(console, app, "no command given; an example: `oblique run STUDY.toml`");
  }
  const int code = parse(console, app, argc, argv);
  return code == kDone && action ? execute(console, app, action, verbosity) : code;
}

}  // namespace oblique::client
