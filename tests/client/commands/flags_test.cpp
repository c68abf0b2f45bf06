// Every flag of every verb, given values that no flag may have.
#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

#include "client/commands/command_line.h"
#include "client/commands/commands.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

struct Ending {
  int exit_code;
  std::string errors;
};

Ending run(std::vector<std::string> words) {
  words.insert(words.begin(), "oblique");
  std::vector<const char*> arguments;
  for (const auto& word : words) {
    arguments.push_back(word.c_str());
  }
  std::ostringstream out;
  std::ostringstream err;
  Console console(out, err);
  const int exit_code =
      run_command_line(console, static_cast<int>(arguments.size()), arguments.data());
  return {exit_code, err.str()};
}

/// How an option is written: --db, or nothing before the value of an argument.
std::vector<std::string> words_for(const CLI::Option& option, const std::string& value) {
  return option.get_lnames().empty()
             ? std::vector<std::string>{value}
             : std::vector<std::string>{"--" + option.get_lnames().front(), value};
}

std::string name_of(const CLI::Option& option) {
  return option.get_lnames().empty() ? option.get_name() : "--" + option.get_lnames().front();
}

void expect_refused(std::vector<std::string> words, const std::string& named) {
  const auto ending = run(words);
  const auto line = testing::PrintToString(words);
  EXPECT_EQ(ending.exit_code, 2) << line << ending.errors;
  EXPECT_NE(ending.errors.find(named), std::string::npos) << line << ending.errors;
  EXPECT_TRUE(ending.errors.starts_with("oblique ")) << line << ending.errors;
}

TEST(Flags, OfEveryVerbRefuseAnEmptyValueAndNameTheFlag) {
  CLI::App app;
  Action parsed;
  for (const auto add :
       {add_solve, add_run, add_submit, add_status, add_workers, add_study_changes, add_query,
        add_trace, add_paper, add_converge, add_fit, add_database_files}) {
    add(app, parsed);
  }
  int flags = 0;
  for (const auto* verb : app.get_subcommands({})) {
    for (const auto* option : verb->get_options()) {
      if (option->get_items_expected_min() == 0) {
        continue;  // takes no value
      }
      std::vector<std::string> words{verb->get_name()};
      const auto more = words_for(*option, "");
      words.insert(words.end(), more.begin(), more.end());
      expect_refused(words, name_of(*option));
      ++flags;
    }
  }
  EXPECT_GT(flags, 100) << "flags were looked at";
}

TEST(Flags, OfParametersRefuseWhatIsNoNumberOfTheirRange) {
  const auto refuse = [](const solver::ParameterKey& key) {
    for (const char* value :
         {"nan", "-nan", "inf", "-inf", "-1", "1e999", "abc", "0x1p", "1,", ":"}) {
      std::string flag = "--" + std::string(key.name);
      std::replace(flag.begin(), flag.end(), '_', '-');
      std::vector<std::string> words{"solve"};
      for (const std::string point : {"--H", "--mu", "--e"}) {
        if (point != flag) {
          words.insert(words.end(), {point, point == "--mu" ? "0.4" : "1"});
        }
      }
      words.insert(words.end(), {flag, value});
      expect_refused(words, std::string(key.name).substr(0, key.name.find('_')));
    }
  };
  for (const auto& key : solver::point_keys()) {
    refuse(key);
  }
  for (const auto& key : solver::model_keys()) {
    refuse(key);
  }
}

TEST(Flags, ThatTakeNumbersRefuseThoseThatTheyCannotMean) {
  const std::vector<std::string> point{"--H", "1", "--mu", "0.4", "--e", "1"};
  const struct {
    std::string verb;
    std::string flag;
    std::vector<std::string> values;
  } wrong[] = {
      {"run", "--workers", {"nan", "-1", "0", "1.5", "1025", "99999999999999999999"}},
      {"run", "--limit", {"nan", "-1", "1.5", "99999999999999999999"}},
      {"submit", "--priority", {"nan", "-1001", "1001", "1.5", "99999999999999999999"}},
      {"submit", "--timeout", {"nan", "inf", "0", "-1", "1e9", "1e999", "x"}},
      {"converge", "--coarsest", {"nan", "0", "-1", "1.5", "2147483647", "99999999999"}},
      {"converge", "--finest", {"nan", "0", "-1", "1.5", "2147483647", "99999999999"}},
      {"converge", "--halvings", {"nan", "0", "-1", "1", "9", "99999999999"}},
  };
  for (const auto& [verb, flag, values] : wrong) {
    for (const auto& value : values) {
      std::vector<std::string> words{verb, flag, value};
      words.insert(words.end(), point.begin(), point.end());
      expect_refused(words, flag);
    }
  }
  for (const char* value : {"nan", "0", "-1", "257", "1.5", "99999999999"}) {
    expect_refused({"fit", "--elements-per-link", value}, "elements");
  }
  for (const char* value : {"nan", "-1", "1.5", "99999999999999999999"}) {
    expect_refused({"query", "paper", "--limit", value}, "--limit");
  }
}

TEST(Flags, ShowWhatIsWrongWithoutSteeringTheTerminal) {
  const auto name = run({"run", "--name", "a\x1b[2J\u202eb", "--H", "1", "--mu", "1", "--e", "1"});
  EXPECT_EQ(name.exit_code, 2);
  EXPECT_NE(name.errors.find("a\\x1b[2J\\u202eb"), std::string::npos) << name.errors;
  for (const std::vector<std::string>& words : {std::vector<std::string>{"so\x1blve"},
                                                {"solve", "--H", "\x1b[2J"},
                                                {"solve", "--\u009bx"},
                                                {"fit", "--from", "\x1b"},
                                                {"query", "p", "--format", "\xff"}}) {
    const auto ending = run(words);
    EXPECT_EQ(ending.exit_code, 2) << ending.errors;
    EXPECT_NE(ending.errors.find("\\"), std::string::npos) << ending.errors;
    for (const char* raw : {"\x1b", "\u009b", "\xff"}) {
      EXPECT_EQ(ending.errors.find(raw), std::string::npos) << ending.errors;
    }
  }
}

}  // namespace
}  // namespace oblique::client
