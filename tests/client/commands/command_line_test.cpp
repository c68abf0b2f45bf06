#include <sys/stat.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/commands/commands.h"
#include "tests/support/programs.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::Not;

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  return {std::istream_iterator<std::string>(in), {}};
}

TEST(CommandLine, AnswersWrongUsageWithExitCodeTwoAndASentence) {
  const struct {
    const char* line;
    const char* expected;
  } wrong[] = {
      {"", "no command given"},
      {"solv", "unknown command `solv` (did you mean `solve`?)"},
      {"server --db a.db", "unknown command `server` (did you mean `oblique-server`?)"},
      {"worker", "(did you mean `oblique-worker`?)"},
      {"list", "(did you mean `oblique studies`?)"},
      {"--verbos", "unexpected `--verbos`"},
      {"solve --H 1 --mu 0.4", "--e is missing"},
      {"solve --H 1.3 --mu 0.4 --e 1", "1.2 m"},
      {"solve --preset paper --H 1.19 --mu 0.4 --e 1", "1.179156"},
      {"submit --preset paper --H 1.19 --mu 0.4 --e 1", "1.179156"},
      {"converge --preset paper --H 1.19 --mu 0.4 --e 1", "1.179156"},
      {"solve --H 1 --mu 0.4 --e 1 --k 0-mu", "--k 0-mu: point 0: k = -0.4 N/m is not allowed"},
      {"solve --H 1 --mu log(0-H) --e 1", "mu = nan is not allowed"},
      {"solve --H 4*mu --mu 0.4 --e 1", "--H 4*mu: point 0: H = 1.6 m"},
      {"converge --H 1 --mu 0.4 --e 1 --k 0-mu", "--k 0-mu: point 0: k = -0.4 N/m is not allowed"},
      {"run --H 1 --mu 0.4 --e 1 --k 0-mu", "--k 0-mu: point 0: k = -0.4 N/m is not allowed"},
      {"study check --H 1 --mu 0.4 --e 1 --k 0-mu",
       "--k 0-mu: point 0: k = -0.4 N/m is not allowed"},
      {"submit --H 1 --mu 0.4 --e 1 --priority 1001", "--priority: priority = 1001 is not allowed"},
      {"solve --H 1,1.1 --mu 0.4 --e 1", "solve takes one value per flag"},
      {"solve --H 1 --mu 0.4 --e 1 --trace /nowhere/x.csv", "/nowhere/x.csv"},
      {"solve --elements-per-lnk=3", "(did you mean `--elements-per-link`?)"},
      {"solve --H 1 --mu 0.4 --e 1 --dt 0.1000000000000001", "dt = 0.1000000000000001 s"},
      {"run", "no points"},
      {"run nowhere.toml", "nowhere.toml"},
      {"run a.toml b.toml", "unexpected `b.toml`"},
      {"submit --H 1 --mu 0.4 --e 1 --server nowhere", "tcp://HOST:PORT"},
      {"status --timeout -1", "--timeout -1"},
      {"status --db a.db --server tcp://127.0.0.1:1", "--server"},
      {"view --server tcp://127.0.0.1:1", "A server has its own page"},
      {"paper --study x", "--db"},
      {"converge --H 1 --mu 0.4,0.6 --e 1", "2 points, but converge takes one"},
      {"converge --H 1 --mu 0.4 --e 1 --finest 24", "--finest 24"},
      {"solve --H 1 --mu 0.4 --e 1 --tolerance 0.1", "tolerance = 0.1"},
      {"fit --from papre", "papre"},
      {"solve --H 1 --mu 0.4 --e 1 --trace - --json", "both write to standard output"},
      {"solve --H 1 --mu 0.4 --e 1 --trace-shape", "--trace"},
  };
  for (const auto& [words, expected] : wrong) {
    const auto outcome = test::run_oblique(words_of(words));
    EXPECT_EQ(outcome.exit_code, 2) << words << outcome.err;
    EXPECT_EQ(outcome.out, "") << words;
    EXPECT_NE(outcome.err.find(expected), std::string::npos) << words << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("oblique")) << words << outcome.err;
  }
}

TEST(CommandLine, ConvergeUsesTheModelOfThePointThatTheFilterKeeps) {
  const auto converged = [](const std::vector<std::string>& more) {
    std::vector<std::string> words{"converge", "--preset", "paper", "--H",   "0.9",
                                   "--mu",     "0.4",      "--e",   "1",     "--coarsest",
                                   "1",        "--finest", "4",     "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const auto outcome = test::run_oblique(words);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return std::regex_replace(outcome.out, std::regex("\"wall_s\": [^,]*,"), "");
  };
  EXPECT_EQ(converged({"--k", "1e7,2e7", "--where", "k > 1.5e7"}), converged({"--k", "2e7"}));
}

TEST(CommandLine, WarnsOfTheErrorsOfACoarseMeshOnceOnStandardError) {
  const test::TemporaryFolder folder;
  const auto err_of = [&](std::vector<std::string> words) {
    words.insert(words.end(), {"--H", "0.6", "--mu", "0.4", "--e", "1"});
    return test::run_oblique(folder, words).err;
  };
  const std::string note = "Note: 4 elements a link give errors of 3 % in forces";
  EXPECT_THAT(err_of({"solve", "--preset", "paper", "--json"}), HasSubstr(note));
  EXPECT_THAT(err_of({"study", "check", "--preset", "paper", "--no-rate"}), HasSubstr(note));
  EXPECT_THAT(err_of({"run", "--preset", "paper"}), HasSubstr(note));
  EXPECT_THAT(err_of({"run", "--preset", "paper"}), Not(HasSubstr(note)))
      << "an existing study gets no note";
  EXPECT_THAT(err_of({"plot", "--preset", "paper"}), Not(HasSubstr(note)));
  EXPECT_THAT(err_of({"solve"}), Not(HasSubstr("Note")));
  for (const auto& words :
       {std::vector<std::string>{"solve"}, {"run"}, {"study", "check", "--no-rate"}}) {
    auto light = words;
    light.insert(light.end(), {"--rho", "2.7", "--elements-per-link", "1"});
    EXPECT_THAT(err_of(light),
                HasSubstr("Note: rho = 2.7 kg/m^3 is outside the usual 100 to 25000 kg/m^3"));
  }
}

TEST(CommandLine, RefusesIrregularFilesAndNamesTheirKind) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(mkfifo(folder.file("pipe").c_str(), 0600), 0);
  std::ofstream(folder.path() / "pipe.toml") << "[[block]]\ncsv = 'pipe'\n";
  const struct {
    const char* line;
    const char* expected;
  } wrong[] = {
      {"study check /dev/zero", "the study file /dev/zero cannot be read: it is a device"},
      {"study check pipe", "the study file pipe cannot be read: it is a pipe"},
      {"study check pipe.toml", "the CSV file pipe cannot be read: it is a pipe"},
      {"study check --H @pipe --mu 1 --e 1", "the CSV file ./pipe cannot"},
      {"status --keys pipe", "the key file pipe cannot be read: it is a pipe"},
      {"status --db pipe", "pipe is a pipe: a database must be a regular file"},
      {"run --db pipe --H 1 --mu 1 --e 1", "pipe is a pipe"},
      {"merge pipe", "pipe is a pipe"},
      {"backup saved.db --db pipe --salvage", "pipe is a pipe"},
      {"autoscale slurm --max 1 --script pipe", "the script pipe cannot be read"},
  };
  for (const auto& [line, expected] : wrong) {
    const auto outcome = test::run_oblique(folder, words_of(line));
    EXPECT_NE(outcome.exit_code, 0) << line;
    EXPECT_THAT(outcome.err, HasSubstr(expected));
  }
  const auto doctor = test::run_oblique(folder, {"doctor", "--db", "./pipe"});
  EXPECT_NE(doctor.out.find("/pipe is a pipe"), std::string::npos) << doctor.out;
}

TEST(CommandLine, RepeatsAtMostEightyCharactersOfAWrongKey) {
  const test::TemporaryFolder folder;
  const std::string key(100'000, 'k');
  std::ofstream(folder.path() / "a.toml") << "[[block]]\nH = { " << key << " = 1 }\n";
  ASSERT_EQ(test::run_oblique(folder, {"keygen", "keys"}).exit_code, 0);
  std::ofstream(folder.path() / "keys/client.key", std::ios::app) << key << " = 1\n";
  for (const auto& words :
       std::vector<std::vector<std::string>>{{key},
                                             {"solve", "--" + key},
                                             {"study", "check", "a.toml"},
                                             {"status", "--keys", "keys/client.key"}}) {
    const auto outcome = test::run_oblique(folder, words);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err.substr(0, 1000);
    EXPECT_NE(outcome.err.find(key.substr(0, 40)), std::string::npos) << outcome.err;
    EXPECT_LT(outcome.err.size(), 300U) << outcome.err.substr(0, 1000);
  }
}

TEST(CommandLine, AMissingServerOrFileIsNamedAndGivesExitCodeOne) {
  const struct {
    const char* line;
    const char* expected;
  } missing[] = {
      {"status --server tcp://127.0.0.1:1 --timeout 0.05",
       "no answer from tcp://127.0.0.1:1 within 0.05 s"},
      {"studies --db nowhere.db", "nowhere.db"},
      {"view nowhere.db", "there is no file nowhere.db"},
  };
  for (const auto& [line, expected] : missing) {
    const auto outcome = test::run_oblique(words_of(line));
    EXPECT_EQ(outcome.exit_code, 1) << line;
    EXPECT_EQ(outcome.out, "") << line;
    EXPECT_THAT(outcome.err, HasSubstr(expected));
  }
}

TEST(CommandLine, ADatabaseGivenAsAStudyFileIsRecognised) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "camp.db") << "SQLite format 3 and so on";
  const auto run = test::run_oblique(folder, {"run", "camp.db"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("camp.db is a database, not a study file"));
  EXPECT_THAT(run.err, HasSubstr("--db camp.db"));
}

TEST(CommandLine, FailsWhenStandardOutputCannotBeWritten) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "script")
      << "exec '" << test::client_program() << "' solve --H 1 --mu 0.4 --e 1 > /dev/full\n";
  const int status = std::system(
      ("sh " + (folder.path() / "script").string() + " 2> " + (folder.path() / "err").string())
          .c_str());
  EXPECT_EQ(WEXITSTATUS(status), 1);
}

TEST(HelpText, WrapsDescriptionsAtTheirColumn) {
  EXPECT_EQ(fitted_help("  --at N    one two three four\n  --b       five\n", 20, 12),
            "  --at N    one two\n"
            "            three\n"
            "            four\n"
            "  --b       five\n");
}

TEST(HelpText, WrapsSentences) {
  EXPECT_EQ(fitted_help("one two three\nfour five\n\nsix seven eight\n", 10, 12),
            "one two\nthree four\nfive\n\nsix seven\neight\n");
}

TEST(HelpText, DoesNotBreakCommandsOrLongWords) {
  const std::string help = "Examples:\n  oblique run a.toml   a study here\nabcdefghijklmnop\n";
  EXPECT_EQ(fitted_help(help, 12, 20), help);
}

}  // namespace
}  // namespace oblique::client
