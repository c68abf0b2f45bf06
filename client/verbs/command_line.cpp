#include "client/verbs/command_line.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <exception>
#include <iostream>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/io/sink.h"
#include "client/output/help_text.h"
#include "client/output/human_units.h"
#include "client/output/speech.h"
#include "client/output/terminal.h"
#include "client/verbs/verbs.h"
#include "proto/program/origin/origin.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "server/query/columns.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

/// Of the meanings of flags and verbs.
constexpr std::size_t kHelpColumn = 28;

constexpr const char* kExamples = R"(Examples:
  oblique solve --H 1 --mu 0.4 --e 1               one impact, here and now
  oblique run deploy/studies/paper.toml            a study, solved here
  oblique query paper --where "mu > 0.5"           its results
  oblique VERB --help                              flags and examples of a verb

Exit codes: 0 done, 1 failed, 2 wrong usage; stopped by a signal: 128 and its number, 130 for Ctrl-C.)";

void add_verbs(CLI::App& app, Command& command) {
  add_solve(app, command);
  add_run(app, command);
  add_study(app, command);
  add_submit(app, command);
  add_status(app, command);
  add_watch(app, command);
  add_studies(app, command);
  add_workers(app, command);
  add_cancel(app, command);
  add_pause(app, command);
  add_resume(app, command);
  add_retry(app, command);
  add_describe(app, command);
  add_rename(app, command);
  add_delete(app, command);
  add_query(app, command);
  add_sql(app, command);
  add_trace(app, command);
  add_plot(app, command);
  add_view(app, command);
  add_columns(app, command);
  add_paper(app, command);
  add_converge(app, command);
  add_fit(app, command);
  add_merge(app, command);
  add_backup(app, command);
  add_check(app, command);
  add_autoscale(app, command);
  add_keygen(app, command);
  add_keys(app, command);
  add_doctor(app, command);
}

/// What people want to be told; as of all verbs.
struct SpeechFlags {
  bool quiet = false;
  bool verbose = false;
};

void add_speech_flags(CLI::App& verb, SpeechFlags& flags) {
  verb.add_flag("--quiet", flags.quiet, "say nothing but data and errors");
  if (verb.get_option_no_throw("--verbose") == nullptr) {
    verb.add_flag("--verbose", flags.verbose, "say what is done, where, and how long it took");
  }
  for (auto* each : verb.get_subcommands({})) {
    add_speech_flags(*each, flags);
  }
}

/// The verb that was parsed, of a verb of verbs the inner one, or the program itself.
CLI::App& parsed_verb(CLI::App& app) {
  const auto verbs = app.get_subcommands();
  return verbs.empty() ? app : parsed_verb(*verbs.front());
}

/// As it is typed: "oblique keys list".
std::string words_of(const CLI::App& verb) {
  const CLI::App* parent = verb.get_parent();
  return parent == nullptr ? verb.get_name() : words_of(*parent) + ' ' + verb.get_name();
}

int wrong_usage(const CLI::App& verb, const std::string& message) {
  return protocol::tell_wrong_usage(words_of(verb), message);
}

/// What has another name here, where that is not the nearest one.
std::string other_name_of(const std::string& verb) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kOtherNames{
      {{"server", "oblique-server"}, {"worker", "oblique-worker"}, {"list", "oblique studies"}}};
  const auto* const found = std::find_if(kOtherNames.begin(), kOtherNames.end(),
                                         [&](const auto& pair) { return pair.first == verb; });
  return found == kOtherNames.end() ? std::string() : std::string(found->second);
}

int parse(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
    return kDone;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      std::ostringstream help;
      const int exit_code = app.exit(error, help, std::cerr);
      const std::size_t width = terminal_size().columns;
      std::cout << (width > 0 ? fitted_help(help.str(), width, kHelpColumn) : help.str());
      return exit_code;
    }
    auto& verb = parsed_verb(app);
    const auto unexpected = app.remaining(true);
    if (&verb == &app && !unexpected.empty()) {
      if (const auto other = other_name_of(unexpected.front()); !other.empty()) {
        return wrong_usage(
            app, fmt::format("unknown verb `{}` (did you mean `{}`?)", unexpected.front(), other));
      }
    }
    return wrong_usage(verb, protocol::objection_of(app, verb, error));
  }
}

/// Of a program that a broken pipe ended (SIGPIPE), which is what happens unless that is ignored.
constexpr int kReaderGone = 128 + SIGPIPE;

/// An error for people, as "oblique query: ...".
int tell_error(const std::string& words, const std::string& message, int exit_code) {
  const ErrorOn error(std::cerr);
  const bool is_coloured = may_colour(STDERR_FILENO);
  std::cerr << fmt::format("{}{}:{} {}\n", is_coloured ? "\x1b[1;31m" : "", words,
                           is_coloured ? "\x1b[0m" : "", protocol::visible_lines(message));
  return exit_code;
}

int carried_out(const std::string& words, const Command& command) {
  try {
    const int code = command();
    errno = 0;
    if (!std::cout.flush()) {
      if (errno == EPIPE) {
        return kReaderGone;
      }
      return tell_error(words, "standard output could not be written", kFailed);
    }
    return code;
  } catch (const ClosedPipe&) {
    return kReaderGone;
  } catch (const solver::InputError& error) {
    return tell_error(words, error.what(), kWrongUsage);
  } catch (const std::exception& error) {
    std::cout.flush();
    return tell_error(words, error.what(), kFailed);
  }
}

int execute(CLI::App& app, const Command& command, const SpeechFlags& flags) {
  const auto& verb = parsed_verb(app);
  const bool verbose = flags.verbose || verb.count("--verbose") > 0;
  if (flags.quiet && verbose) {
    return wrong_usage(verb, "--quiet and --verbose want opposite things: give one of them");
  }
  const SpeechOf speech(std::cerr, flags.quiet ? Speech::kQuiet
                                   : verbose   ? Speech::kVerbose
                                               : Speech::kUsual);
  const auto began = std::chrono::steady_clock::now();
  tell_detail(std::cerr,
              fmt::format("{}, version {}", words_of(verb), protocol::version_and_commit()));
  const int code = carried_out(words_of(verb), command);
  const std::chrono::duration<double> lasted = std::chrono::steady_clock::now() - began;
  tell_detail(std::cerr, fmt::format("{} {} after {}", words_of(verb),
                                     code == kDone ? "is done" : "has failed",
                                     shown_duration(lasted.count())));
  return code;
}

/// Columns complete the values that hold names of columns.
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

/// Also where it is written wrong, for then the flag that may be meant is named.
bool may_name_single_lengths(int argc, const char* const* argv) {
  return std::any_of(argv, argv + argc, [](const char* word) {
    return std::string_view(word).find("len") != std::string_view::npos;
  });
}

}  // namespace

int run_command_line(int argc, const char* const* argv) {
  std::ios::sync_with_stdio(false);
  CLI::App app("Studies of the oblique impact of a flexible robotic finger.", "oblique");
  app.set_version_flag("--version", "oblique " + protocol::version_and_commit());
  app.footer(kExamples);
  app.require_subcommand(1);
  app.get_formatter()->column_width(kHelpColumn);
  Command command;
  command.names_single_lengths = may_name_single_lengths(argc, argv);
  add_verbs(app, command);
  SpeechFlags speech;
  add_speech_flags(app, speech);
  protocol::refuse_empty_values(app);
  if (const auto exit_code = protocol::print_completion(app, argc, argv, columns_of_values())) {
    return *exit_code;
  }
  if (argc == 1) {
    return wrong_usage(app, "no verb given, as in `oblique run STUDY.toml`");
  }
  const int code = parse(app, argc, argv);
  return command ? execute(app, command, speech) : code;
}

}  // namespace oblique::client
