// What holds for every verb that the program lists, those to come included.
#include <algorithm>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"
#include "tests/support/stored_study.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::PrintToString;

using Words = std::vector<std::string>;

Words with(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// A verb, or one of the verbs that a verb has.
struct Verb {
  Words words;       ///< as they are typed
  std::string help;  ///< that it prints
};

/// The names listed under "Subcommands:".
std::vector<std::string> listed_in(const std::string& help) {
  std::vector<std::string> names;
  const auto begin = help.find("\nSubcommands:\n");
  std::istringstream lines(begin == std::string::npos ? "" : help.substr(begin + 1));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && line.starts_with("  ")) {
    std::string name;
    std::istringstream(line) >> name;
    if (line[2] != ' ') {  // not a description that goes on
      names.push_back(name);
    }
  }
  return names;
}

void add_verbs_of(const Words& words, std::vector<Verb>& verbs) {
  const auto outcome = test::run_oblique(with(words, {"--help"}));
  ASSERT_EQ(outcome.exit_code, 0) << PrintToString(words) << outcome.err;
  ASSERT_EQ(outcome.err, "") << PrintToString(words);
  if (!words.empty()) {
    verbs.push_back({words, outcome.out});
  }
  for (const auto& name : listed_in(outcome.out)) {
    add_verbs_of(with(words, {name}), verbs);
  }
}

const std::vector<Verb>& every_verb() {
  static const std::vector<Verb> verbs = [] {
    std::vector<Verb> all;
    add_verbs_of({}, all);
    return all;
  }();
  return verbs;
}

/// The line of the help that says how it is called.
std::string usage_of(const Verb& verb) {
  const auto at = verb.help.find("Usage: ");
  return verb.help.substr(at, verb.help.find('\n', at) - at);
}

/// A word for each argument that it must have, and the flags that it must have.
Words needed_words(const Verb& verb) {
  Words words;
  std::istringstream usage(usage_of(verb).substr(std::string("Usage: oblique").size()));
  std::string word;
  std::size_t skipped = 0;
  while (usage >> word) {
    if (skipped++ >= verb.words.size() && word.front() != '[' && word != "SUBCOMMAND") {
      words.push_back(word == "SYSTEM" ? "slurm" : "1");
    }
  }
  const std::regex line("\n  (--[a-z0-9-]+) ([A-Z]+) REQUIRED");
  for (std::sregex_iterator found(verb.help.begin(), verb.help.end(), line), end; found != end;
       ++found) {
    words.push_back((*found)[1]);
    words.emplace_back((*found)[2] == "ROLE" ? "client" : "1");
  }
  return words;
}

/// The flags with a value, by the name that the help gives the value.
std::vector<std::pair<std::string, std::string>> flags_with_values(const Verb& verb) {
  std::vector<std::pair<std::string, std::string>> flags;
  const std::regex line("\n  (--[a-z0-9-]+) ([A-Z]+)(?![a-z])");
  for (std::sregex_iterator found(verb.help.begin(), verb.help.end(), line), end; found != end;
       ++found) {
    flags.emplace_back((*found)[1], (*found)[2]);
  }
  return flags;
}

void expect_wrong_usage(const Words& words, const std::string& says) {
  const auto outcome = test::run_oblique(words);
  const std::string typed = PrintToString(words);
  EXPECT_EQ(outcome.exit_code, 2) << typed << outcome.err;
  EXPECT_EQ(outcome.out, "") << typed;
  EXPECT_TRUE(outcome.err.starts_with("oblique")) << typed << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(says)) << typed;
}

TEST(EveryVerb, HasAtLeastTwoExamplesInItsHelp) {
  ASSERT_GT(every_verb().size(), 20U);
  for (const auto& verb : every_verb()) {
    // The verbs of a verb share theirs.
    const std::string call = "\n  oblique " + verb.words.front();
    std::size_t examples = 0;
    for (auto at = verb.help.find(call); at != std::string::npos;
         at = verb.help.find(call, at + 1)) {
      ++examples;
    }
    EXPECT_THAT(verb.help, HasSubstr("Examples:")) << call;
    EXPECT_GE(examples, 2U) << call << "\n" << verb.help;
  }
}

TEST(EveryVerb, CanBeQuietOrVerboseAndNotBoth) {
  for (const auto& verb : every_verb()) {
    EXPECT_THAT(verb.help, HasSubstr("\n  --quiet")) << PrintToString(verb.words);
    EXPECT_THAT(verb.help, HasSubstr("\n  --verbose")) << PrintToString(verb.words);
    if (listed_in(verb.help).empty()) {
      expect_wrong_usage(with(with(verb.words, needed_words(verb)), {"--quiet", "--verbose"}),
                         "--quiet and --verbose contradict each other");
    }
  }
}

TEST(EveryVerb, AnswersWordsThatItDoesNotKnowWithTwoAndTheNearestThatItDoes) {
  for (const auto& verb : every_verb()) {
    expect_wrong_usage(with(verb.words, {"--hlep"}), "(did you mean `--help`?)");
    Words words = verb.words;
    words.back() += words.back().back();
    expect_wrong_usage(words, "(did you mean `" + verb.words.back() + "`?)");
  }
}

TEST(EveryVerb, WantsTheArgumentsThatItNeeds) {
  for (const auto& verb : every_verb()) {
    if (!needed_words(verb).empty() || !listed_in(verb.help).empty()) {
      expect_wrong_usage(verb.words, "required");
    }
  }
}

TEST(EveryVerb, RefusesValuesThatItsFlagsCannotHave) {
  const std::set<std::string> numbers{"N", "SECONDS", "W", "FLOAT", "INT", "UINT"};
  const std::set<std::string> words{"FORMAT", "SAMPLER"};
  for (const auto& verb : every_verb()) {
    const Words called = with(verb.words, needed_words(verb));
    const auto flags = flags_with_values(verb);
    if (!flags.empty()) {
      expect_wrong_usage(with(called, {flags.front().first, ""}), flags.front().first);
    }
    for (const auto& [flag, value] : flags) {
      if (numbers.contains(value) || words.contains(value)) {
        expect_wrong_usage(with(called, {flag, "vorhanden"}), "vorhanden");
      }
    }
  }
}

/// A folder with oblique.db, which has the study `friction`.
class EveryVerbThatReads : public testing::Test {
 protected:
  EveryVerbThatReads() {
    server::Store store((folder_.path() / "oblique.db").string());
    test::add_study(store, "friction", 4, 2);
  }
  /// Those whose first argument is a study of a database.
  static std::vector<Verb> verbs_of_studies() {
    std::vector<Verb> verbs;
    for (const auto& verb : every_verb()) {
      const bool has_study = std::regex_search(usage_of(verb), std::regex(" \\[?STUDY\\]?( |$)"));
      if (has_study && verb.help.find("\n  --db ") != std::string::npos &&
          verb.words.front() != "run") {
        verbs.push_back(verb);
      }
    }
    return verbs;
  }

  test::TemporaryFolder folder_;
};

TEST_F(EveryVerbThatReads, SuggestsTheNearestStudyAndFailsWithOneWhereAStudyIsNotThere) {
  ASSERT_GE(verbs_of_studies().size(), 4U);
  for (const auto& verb : verbs_of_studies()) {
    Words words = with(verb.words, {"frition"});
    Words rest = needed_words(verb);
    if (rest.size() > 1) {
      words = with(words, {rest.begin() + 1, rest.end()});
    }
    if (verb.help.find("--yes ") != std::string::npos) {
      words.emplace_back("--yes");  // nobody can be asked here
    }
    if (verb.help.find("--show ") != std::string::npos) {
      words.emplace_back("--show");  // a picture goes into no pipe
    }
    const auto outcome = test::run_oblique(folder_, words);
    EXPECT_EQ(outcome.exit_code, 1) << PrintToString(words) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("(did you mean `friction`?)")) << PrintToString(words);
  }
}

TEST_F(EveryVerbThatReads, SaysNothingButDataWhenItIsQuietAndWhereAndHowLongWhenVerbose) {
  const auto usual = test::run_oblique(folder_, {"query", "friction", "--format", "csv"});
  const auto quiet =
      test::run_oblique(folder_, {"query", "friction", "--format", "csv", "--quiet"});
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_EQ(quiet.err, "");
  EXPECT_EQ(quiet.out, usual.out);
  const auto verbose =
      test::run_oblique(folder_, {"query", "friction", "--format", "csv", "--verbose"});
  EXPECT_EQ(verbose.out, usual.out);
  EXPECT_THAT(verbose.err, HasSubstr("oblique.db"));
  EXPECT_THAT(verbose.err, HasSubstr("oblique query is done after "));
  const auto error = test::run_oblique(folder_, {"query", "frition", "--quiet"});
  EXPECT_EQ(error.exit_code, 1);
  EXPECT_THAT(error.err, HasSubstr("no study called"));
  const auto watch = test::run_oblique(folder_, {"status", "friction", "--quiet"});
  EXPECT_THAT(watch.out, HasSubstr("friction"));
}

TEST_F(EveryVerbThatReads, StatusHasRoomInEightyColumns) {
  const auto status = test::run_oblique(folder_, {"status"});
  EXPECT_EQ(status.exit_code, 0);
  std::istringstream lines(status.out);
  std::string line;
  std::getline(lines, line);
  for (const char* column : {"study", "state", "points", "done", "prio"}) {
    EXPECT_THAT(line, HasSubstr(column));
  }
  EXPECT_LE(line.size(), 80U);
  EXPECT_THAT(status.out, HasSubstr("50 %"));
  EXPECT_THAT(status.out,
              HasSubstr("friction waits for a server: nobody is at work on oblique.db."));
}

TEST(Colours, AreForTerminalsAlone) {
  const auto outcome = test::run_oblique({"solve", "--H", "1"});
  EXPECT_EQ(outcome.err.find('\x1b'), std::string::npos);
}

}  // namespace
}  // namespace oblique::client
