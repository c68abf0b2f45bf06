#include "client/command_line.h"

#include <algorithm>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/verbs/verbs.h"
#include "proto/program/usage.h"
#include "proto/suggestion.h"
#include "proto/text.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/version.h"

namespace oblique::client {
namespace {

constexpr const char* kExamples = R"(Examples:
  oblique solve --H 1 --mu 0.4 --e 1               one impact, here and now
  oblique run deploy/studies/paper.toml            a study: server, workers and database here
  oblique query paper --where "mu > 0.5"           its results
  oblique VERB --help                              flags, defaults and examples of a verb

Exit codes: 0 done, 1 failed, 2 wrong usage; stopped by a signal: 128 and its number, 130 for Ctrl-C.)";

void add_verbs(CLI::App& app, Command& command) {
  add_solve(app, command);
  add_run(app, command);
  add_submit(app, command);
  add_status(app, command);
  add_watch(app, command);
  add_studies(app, command);
  add_workers(app, command);
  add_cancel(app, command);
  add_pause(app, command);
  add_resume(app, command);
  add_retry(app, command);
  add_rename(app, command);
  add_delete(app, command);
  add_query(app, command);
  add_sql(app, command);
  add_trace(app, command);
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
}

// The verb that was parsed, or the program itself.
CLI::App& parsed_verb(CLI::App& app) {
  const auto verbs = app.get_subcommands();
  return verbs.empty() ? app : *verbs.front();
}

// Names of verbs, or of the flags of one verb, for suggestions.
std::vector<std::string> known_words(CLI::App& app, const CLI::App& verb) {
  std::vector<std::string> words;
  if (&verb == &app) {
    for (const auto* each : app.get_subcommands({})) {
      words.push_back(each->get_name());
    }
  }
  for (const auto* option : verb.get_options()) {
    for (const auto& name : option->get_lnames()) {
      words.push_back("--" + name);
    }
  }
  return words;
}

std::string unexpected_words(CLI::App& app, CLI::App& verb) {
  const auto words = known_words(app, verb);
  const std::vector<std::string_view> candidates(words.begin(), words.end());
  const auto unexpected = app.remaining(true);
  const std::string first = unexpected.empty() ? std::string() : unexpected.front();
  const bool is_verb = &verb == &app && !first.starts_with("-");
  return fmt::format("{} `{}`{}", is_verb ? "unknown verb" : "unexpected", first,
                     protocol::did_you_mean(first.substr(0, first.find('=')), candidates));
}

int wrong_usage(const CLI::App& app, const CLI::App& verb, const std::string& message) {
  return protocol::tell_wrong_usage(
      &verb == &app ? app.get_name() : fmt::format("{} {}", app.get_name(), verb.get_name()),
      message);
}

int parse(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
    return kDone;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(error, std::cout, std::cerr);
    }
    // A word too many says more than the missing verb or flag that it may have been meant for.
    auto& verb = parsed_verb(app);
    const bool word_too_many = !app.remaining(true).empty();
    return wrong_usage(app, verb, word_too_many ? unexpected_words(app, verb) : error.what());
  }
}

int execute(CLI::App& app, const Command& command) {
  const auto& verb = parsed_verb(app);
  const std::string words = fmt::format("{} {}: ", app.get_name(), verb.get_name());
  try {
    const int code = command();
    if (!std::cout.flush()) {
      std::cerr << words << "standard output could not be written\n";
      return kFailed;
    }
    return code;
  } catch (const solver::InputError& error) {
    std::cerr << words << protocol::visible_lines(error.what()) << '\n';
    return kWrongUsage;
  } catch (const std::exception& error) {
    std::cout.flush();
    std::cerr << words << protocol::visible_lines(error.what()) << '\n';
    return kFailed;
  }
}

}  // namespace

int run_command_line(int argc, const char* const* argv) {
  std::ios::sync_with_stdio(false);
  CLI::App app("Studies of the oblique impact of a flexible robotic finger.", "oblique");
  app.set_version_flag("--version", "oblique " + solver::solver_version());
  app.footer(kExamples);
  app.require_subcommand(1);
  app.get_formatter()->column_width(28);
  Command command;
  add_verbs(app, command);
  protocol::refuse_empty_values(app);
  if (argc == 1) {
    return wrong_usage(app, app, "no verb given, as in `oblique run STUDY.toml`");
  }
  const int code = parse(app, argc, argv);
  return command ? execute(app, command) : code;
}

}  // namespace oblique::client
