// Properties of every command, including future ones.
#include <algorithm>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/commands/commands.h"
#include "client/io/console.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"
#include "tests/support/stored_study.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::PrintToString;
using testing::StartsWith;

using Words = std::vector<std::string>;

Words with(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// Runs the command line in this process and returns its output.
test::Outcome parse(const Words& words) {
  std::vector<const char*> arguments{"oblique"};
  for (const auto& word : words) {
    arguments.push_back(word.c_str());
  }
  std::ostringstream out;
  std::ostringstream err;
  Console console(out, err);
  test::Outcome outcome;
  outcome.exit_code =
      run_command_line(console, static_cast<int>(arguments.size()), arguments.data());
  outcome.out = out.str();
  outcome.err = err.str();
  return outcome;
}

void expect_wrong_usage(const Words& words, const std::string& expected) {
  const auto outcome = parse(words);
  const std::string typed = PrintToString(words);
  EXPECT_EQ(outcome.exit_code, 2) << typed << outcome.err;
  EXPECT_EQ(outcome.out, "") << typed;
  EXPECT_THAT(outcome.err, AllOf(StartsWith("oblique"), HasSubstr(expected))) << typed;
}

/// A command, such as `study`, or a subcommand, such as `study check`.
struct Listed {
  Words words;       ///< as typed
  std::string help;  ///< output of --help
};

/// Returns the names that a help text lists under "Subcommands:".
Words listed_in(const std::string& help) {
  Words names;
  const auto begin = help.find("\nSubcommands:\n");
  std::istringstream lines(begin == std::string::npos ? "" : help.substr(begin + 1));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && line.starts_with("  ")) {
    std::string name;
    std::istringstream(line) >> name;
    if (line[2] != ' ') {  // other lines continue a description
      names.push_back(name);
    }
  }
  return names;
}

void add_commands_of(const Words& words, std::vector<Listed>& commands) {
  const auto outcome = parse(with(words, {"--help"}));
  ASSERT_EQ(outcome.exit_code, 0) << PrintToString(words) << outcome.err;
  ASSERT_EQ(outcome.err, "") << PrintToString(words);
  if (!words.empty()) {
    commands.push_back({words, outcome.out});
  }
  for (const auto& name : listed_in(outcome.out)) {
    add_commands_of(with(words, {name}), commands);
  }
}

const std::vector<Listed>& every_command() {
  static const std::vector<Listed> commands = [] {
    std::vector<Listed> all;
    add_commands_of({}, all);
    return all;
  }();
  return commands;
}

std::string usage_of(const Listed& command) {
  const auto at = command.help.find("Usage: ");
  return command.help.substr(at, command.help.find('\n', at) - at);
}

/// Returns a value for each required argument, and the required flags with values.
Words needed_words(const Listed& command) {
  Words words;
  std::istringstream usage(usage_of(command).substr(std::string("Usage: oblique").size()));
  std::string word;
  std::size_t skipped = 0;
  while (usage >> word) {
    if (skipped++ >= command.words.size() && word.front() != '[' && word != "SUBCOMMAND") {
      words.push_back(word == "SYSTEM" ? "slurm" : "1");
    }
  }
  const std::regex line("\n  (--[a-z0-9-]+) ([A-Z]+) REQUIRED");
  for (std::sregex_iterator found(command.help.begin(), command.help.end(), line), end;
       found != end; ++found) {
    words.push_back((*found)[1]);
    words.emplace_back((*found)[2] == "ROLE" ? "client" : "1");
  }
  return words;
}

/// Returns each flag that takes a value, with the value's name in the help, such as NUMBER.
std::vector<std::pair<std::string, std::string>> flags_with_values(const Listed& command) {
  std::vector<std::pair<std::string, std::string>> flags;
  const std::regex line("\n  (--[A-Za-z0-9-]+) ([A-Z]+)(?![a-z|])");
  for (std::sregex_iterator found(command.help.begin(), command.help.end(), line), end;
       found != end; ++found) {
    flags.emplace_back((*found)[1], (*found)[2]);
  }
  return flags;
}

TEST(EveryCommand, HasAtLeastTwoExamplesInItsHelp) {
  ASSERT_GT(every_command().size(), 20U);
  for (const auto& command : every_command()) {
    // Subcommands share the examples of their command.
    const std::string call = "\n  oblique " + command.words.front();
    std::size_t examples = 0;
    for (auto at = command.help.find(call); at != std::string::npos;
         at = command.help.find(call, at + 1)) {
      ++examples;
    }
    EXPECT_THAT(command.help, HasSubstr("Examples:")) << call;
    EXPECT_GE(examples, 2U) << call << "\n" << command.help;
  }
}

TEST(EveryCommand, AcceptsQuietOrVerboseButNotBoth) {
  for (const auto& command : every_command()) {
    EXPECT_THAT(command.help, HasSubstr("\n  --quiet")) << PrintToString(command.words);
    EXPECT_THAT(command.help, HasSubstr("\n  --verbose")) << PrintToString(command.words);
    if (listed_in(command.help).empty()) {
      expect_wrong_usage(with(with(command.words, needed_words(command)), {"--quiet", "--verbose"}),
                         "--quiet and --verbose contradict each other");
    }
  }
}

TEST(EveryCommand, SuggestsTheNearestWordAndNamesMissingArguments) {
  for (const auto& command : every_command()) {
    expect_wrong_usage(with(command.words, {"--hlep"}), "(did you mean `--help`?)");
    Words words = command.words;
    words.back() += words.back().back();
    expect_wrong_usage(words, "(did you mean `" + command.words.back() + "`?)");
    if (!needed_words(command).empty() || !listed_in(command.help).empty()) {
      expect_wrong_usage(command.words, "required");
    }
  }
}

TEST(EveryCommand, RefusesInvalidAndEmptyValuesOfFlags) {
  const std::set<std::string> checked{"N", "SECONDS", "FLOAT", "INT", "UINT", "FORMAT"};
  int flags = 0;
  for (const auto& command : every_command()) {
    const Words called = with(command.words, needed_words(command));
    for (const auto& [flag, value] : flags_with_values(command)) {
      expect_wrong_usage(with(called, {flag, ""}), flag);
      expect_wrong_usage(with(with(command.words, {flag + "="}), needed_words(command)),
                         flag + ": the value is empty");
      if (checked.contains(value)) {
        expect_wrong_usage(with(called, {flag, "vorhanden"}), "vorhanden");
      }
      ++flags;
    }
  }
  EXPECT_GT(flags, 200);
}

TEST(EveryCommand, RefusesEmptyValuesOfSwitches) {
  for (const auto& command : every_command()) {
    for (const std::string flag : {"--quiet", "--verbose"}) {
      expect_wrong_usage(with(with(command.words, needed_words(command)), {flag + "="}),
                         flag + ": the value is empty");
    }
  }
}

TEST(Flags, OfParametersRefuseValuesOutsideTheirRange) {
  const auto refuse = [](const solver::ParameterKey& key) {
    for (const char* value :
         {"nan", "-nan", "inf", "-inf", "-1", "1e999", "abc", "0x1p", "1,", ":"}) {
      std::string flag = "--" + std::string(key.name);
      std::replace(flag.begin(), flag.end(), '_', '-');
      Words words{"solve"};
      for (const std::string point : {"--H", "--mu", "--e"}) {
        if (point != flag) {
          words = with(words, {point, point == "--mu" ? "0.4" : "1"});
        }
      }
      expect_wrong_usage(with(words, {flag, value}),
                         std::string(key.name).substr(0, key.name.find('_')));
    }
  };
  for (const auto& key : solver::point_keys()) {
    refuse(key);
  }
  for (const auto& key : solver::model_keys()) {
    refuse(key);
  }
}

TEST(Flags, WithNumbersRefuseInvalidNumbers) {
  const Words point{"--H", "1", "--mu", "0.4", "--e", "1"};
  const struct {
    Words words;
    std::string flag;
    Words values;
  } wrong[] = {
      {with({"run"}, point),
       "--workers",
       {"nan", "-1", "0", "1.5", "1025", "99999999999999999999"}},
      {with({"run"}, point), "--limit", {"nan", "-1", "1.5", "99999999999999999999"}},
      {with({"submit"}, point),
       "--priority",
       {"nan", "-1001", "1001", "1.5", "99999999999999999999"}},
      {with({"submit"}, point), "--timeout", {"nan", "inf", "0", "-1", "1e9", "1e999", "x"}},
      {with({"converge"}, point),
       "--coarsest",
       {"nan", "0", "-1", "1.5", "2147483647", "99999999999"}},
      {with({"converge"}, point),
       "--finest",
       {"nan", "0", "-1", "1.5", "2147483647", "99999999999"}},
      {with({"converge"}, point), "--halvings", {"nan", "0", "-1", "1", "9", "99999999999"}},
      {{"query", "paper"}, "--limit", {"nan", "-1", "1.5", "99999999999999999999"}},
  };
  for (const auto& [words, flag, values] : wrong) {
    for (const auto& value : values) {
      expect_wrong_usage(with(words, {flag, value}), flag);
    }
  }
  for (const char* value : {"nan", "0", "-1", "257", "1.5", "99999999999"}) {
    expect_wrong_usage({"fit", "--elements-per-link", value}, "elements");
  }
}

TEST(Flags, EscapeControlCodesInErrorMessages) {
  for (const Words& words : {Words{"so\x1blve"},
                             {"run", "--name", "a\u202eb", "--H", "1", "--mu", "1", "--e", "1"},
                             {"solve", "--H", "\x1b[2J"},
                             {"solve", "--\u009bx"},
                             {"fit", "--from", "\x1b"},
                             {"query", "p", "--format", "\xff"}}) {
    const auto outcome = parse(words);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("\\"));
    for (const char* raw : {"\x1b", "\u009b", "\u202e", "\xff"}) {
      EXPECT_THAT(outcome.err, Not(HasSubstr(raw)));
    }
  }
}

/// A folder whose oblique.db contains the study `friction`.
class EveryCommandThatReads : public testing::Test {
 protected:
  EveryCommandThatReads() {
    server::Store store((folder_.path() / "oblique.db").string());
    test::add_study(store, "friction", 4, 2);
  }

  test::TemporaryFolder folder_;
};

TEST_F(EveryCommandThatReads, SuggestsTheNearestStudyForAMissingStudyAndExitsWithOne) {
  int commands = 0;
  for (const auto& command : every_command()) {
    const bool has_study = std::regex_search(usage_of(command), std::regex(" \\[?STUDY\\]?( |$)"));
    if (!has_study || command.help.find("\n  --db ") == std::string::npos ||
        command.words.front() == "run") {
      continue;
    }
    Words words = with(command.words, {"frition"});
    if (const Words rest = needed_words(command); rest.size() > 1) {
      words = with(words, {rest.begin() + 1, rest.end()});
    }
    for (const char* flag :
         {"--yes", "--show"}) {  // flags that some commands require without a terminal
      if (command.help.find(flag + std::string(" ")) != std::string::npos) {
        words.emplace_back(flag);
      }
    }
    const auto outcome = test::run_oblique(folder_, words);
    EXPECT_EQ(outcome.exit_code, 1) << PrintToString(words) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("(did you mean `friction`?)")) << PrintToString(words);
    ++commands;
  }
  EXPECT_GE(commands, 4);
}

TEST_F(EveryCommandThatReads, PrintsOnlyDataWhenQuietAndSourceAndTimesWhenVerbose) {
  const auto query = [this](const std::string& study, const Words& more) {
    return test::run_oblique(folder_, with({"query", study, "--format", "csv"}, more));
  };
  const auto usual = query("friction", {});
  const auto quiet = query("friction", {"--quiet"});
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_EQ(quiet.err, "");
  EXPECT_EQ(quiet.out, usual.out);
  const auto verbose = query("friction", {"--verbose"});
  EXPECT_EQ(verbose.out, usual.out);
  EXPECT_THAT(verbose.err,
              AllOf(HasSubstr("oblique.db"), HasSubstr("oblique query is done after ")));
  const auto error = query("frition", {"--quiet"});
  EXPECT_EQ(error.exit_code, 1);
  EXPECT_THAT(error.err, AllOf(HasSubstr("no study called"), Not(HasSubstr("\x1b"))));
}

TEST_F(EveryCommandThatReads, WithoutFileAndServerNamesBothFlags) {
  const test::TemporaryFolder empty;
  const auto query = test::run_oblique(empty, {"query", "friction", "--timeout", "0.05"});
  EXPECT_EQ(query.exit_code, 1);
  EXPECT_THAT(query.err, AllOf(HasSubstr("no database oblique.db in this folder"),
                               HasSubstr("--db FILE"), HasSubstr("--server URL")));
}

TEST_F(EveryCommandThatReads, StatusFitsInEightyColumns) {
  const auto status = test::run_oblique(folder_, {"status"});
  EXPECT_EQ(status.exit_code, 0);
  const auto line = status.out.substr(0, status.out.find('\n'));
  for (const char* column : {"study", "state", "points", "done", "prio"}) {
    EXPECT_THAT(line, HasSubstr(column));
  }
  EXPECT_LE(line.size(), 80U);
  EXPECT_THAT(status.out,
              AllOf(HasSubstr("50 %"),
                    HasSubstr("friction waits for a server; none uses oblique.db now.")));
}

}  // namespace
}  // namespace oblique::client
