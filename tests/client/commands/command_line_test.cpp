#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/programs.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::Not;

// Every verb that the program itself lists: one that is added is checked with the others.
std::vector<std::string> verbs_of(const std::string& help) {
  std::vector<std::string> verbs;
  std::istringstream lines(help.substr(std::min(help.size(), help.find("Subcommands:"))));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && line.starts_with("  ")) {
    std::string verb;
    std::istringstream(line) >> verb;
    if (line[2] != ' ') {  // not a description that goes on
      verbs.push_back(verb);
    }
  }
  return verbs;
}

TEST(CommandLine, AnswersWrongUsageWithExitCodeTwoAndASentence) {
  const struct {
    std::vector<std::string> arguments;
    std::string says;
  } wrong[] = {
      {{}, "no command given"},
      {{"solv"}, "unknown command `solv` (did you mean `solve`?)"},
      {{"server", "--db", "a.db"}, "unknown command `server` (did you mean `oblique-server`?)"},
      {{"worker"}, "(did you mean `oblique-worker`?)"},
      {{"list"}, "(did you mean `oblique studies`?)"},
      {{"--verbos"}, "unexpected `--verbos`"},
      {{"solve", "--H", "1", "--mu", "0.4"}, "--e is missing"},
      {{"solve", "--H", "1", "--mu", "-0.4", "--e", "1"}, "mu = -0.4"},
      {{"solve", "--H", "1", "--mu", "abc", "--e", "1"}, "\"abc\" is not a number"},
      {{"solve", "--H", "1", "--mu", "0.4", "--e", "1.1"}, "e = 1.1"},
      {{"solve", "--H", "1.3", "--mu", "0.4", "--e", "1"}, "1.2 m"},
      {{"solve", "--preset", "paper", "--H", "1.19", "--mu", "0.4", "--e", "1"}, "1.179156"},
      {{"run", "--preset", "paper", "--H", "1.19", "--mu", "0.4", "--e", "1"}, "1.179156"},
      {{"submit", "--preset", "paper", "--H", "1.19", "--mu", "0.4", "--e", "1"}, "1.179156"},
      {{"converge", "--preset", "paper", "--H", "1.19", "--mu", "0.4", "--e", "1"}, "1.179156"},
      {{"solve", "--H", "1", "--mu", "0.4", "--e", "1", "--k", "0-mu"},
       "--k 0-mu: point 0: k = -0.4 N/m is not allowed"},
      {{"solve", "--H", "1", "--mu", "log(0-H)", "--e", "1"}, "mu = nan is not allowed"},
      {{"solve", "--H", "4*mu", "--mu", "0.4", "--e", "1"}, "--H 4*mu: point 0: H = 1.6 m"},
      {{"converge", "--H", "1", "--mu", "0.4", "--e", "1", "--k", "0-mu"},
       "--k 0-mu: point 0: k = -0.4 N/m is not allowed"},
      {{"converge", "--H", "1", "--mu", "0.4,0.6", "--e", "1", "--where", "mu > 1"},
       "leaves no point in"},
      {{"run", "--H", "1", "--mu", "0.4", "--e", "1", "--k", "0-mu"},
       "--k 0-mu: point 0: k = -0.4 N/m is not allowed"},
      {{"submit", "--H", "1", "--mu", "0.4", "--e", "1", "--k", "0-mu"},
       "--k 0-mu: point 0: k = -0.4 N/m is not allowed"},
      {{"study", "check", "--H", "1", "--mu", "0.4", "--e", "1", "--k", "0-mu"},
       "--k 0-mu: point 0: k = -0.4 N/m is not allowed"},
      {{"submit", "--H", "1", "--mu", "0.4", "--e", "1", "--priority", "1001"},
       "--priority: priority = 1001 is not allowed"},
      {{"solve", "--H", "1,1.1", "--mu", "0.4", "--e", "1"}, "solve takes one value for each"},
      {{"solve", "--H", "1", "--mu", "0.4", "--e", "1", "--trace", "/nowhere/x.csv"},
       "/nowhere/x.csv"},
      {{"solve", "--elements-per-lnk=3"}, "(did you mean `--elements-per-link`?)"},
      {{"solve", "--H"}, "--H"},
      {{"solve", "--H", "1", "--mu", "0.4", "--e", "1", "--dt", "0.1000000000000001"},
       "dt = 0.1000000000000001 s"},
      {{"run"}, "no points"},
      {{"run", "nowhere.toml"}, "nowhere.toml"},
      {{"run", "a.toml", "b.toml"}, "unexpected `b.toml`"},
      {{"run", "--H", "1", "--mu", "0.4", "--e", "1", "--workers", "0"}, "--workers 0"},
      {{"run", "--H", "1", "--mu", "0.4", "--e", "1", "--limit", "-1"}, "--limit: -1"},
      {{"run", "--workers", "many"}, "many"},
      {{"submit", "--H", "1", "--mu", "0.4", "--e", "1", "--server", "nowhere"}, "tcp://HOST:PORT"},
      {{"status", "--timeout", "-1"}, "--timeout -1"},
      {{"status", "--db", "a.db", "--server", "tcp://127.0.0.1:1"}, "--server"},
      {{"query"}, "STUDY is required"},
      {{"query", "paper", "--format", "xml"}, "xml"},
      {{"query", "paper", "--limit", "-1"}, "--limit"},
      {{"sql"}, "STATEMENT is required"},
      {{"paper", "--preset", "papre"}, "papre"},
      {{"paper", "--study", "x"}, "--db"},
      {{"converge", "--H", "1", "--mu", "0.4,0.6", "--e", "1"}, "2 points, and converge takes one"},
      {{"converge", "--H", "1", "--mu", "0.4", "--e", "1", "--finest", "24"}, "--finest 24"},
      {{"converge", "--H", "1", "--mu", "0.4", "--e", "1", "--halvings", "1"}, "--halvings 1"},
      {{"solve", "--H", "1", "--mu", "0.4", "--e", "1", "--tolerance", "0.1"}, "tolerance = 0.1"},
      {{"fit", "--from", "papre"}, "papre"},
      {{"fit", "--elements-per-link", "0"}, "elements_per_link = 0"},
  };
  for (const auto& [arguments, says] : wrong) {
    const auto outcome = test::run_oblique(arguments);
    const auto words = testing::PrintToString(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << words << outcome.err;
    EXPECT_EQ(outcome.out, "") << words;
    EXPECT_NE(outcome.err.find(says), std::string::npos) << words << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("oblique")) << words << outcome.err;
  }
}

TEST(CommandLine, ShowsEveryVerbWithExamplesOnStandardOutput) {
  const auto help = test::run_oblique({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_EQ(help.err, "");
  const auto verbs = verbs_of(help.out);
  for (const char* verb : {"solve", "run", "backup", "retry"}) {
    ASSERT_EQ(std::count(verbs.begin(), verbs.end(), verb), 1) << verb << '\n' << help.out;
  }
  for (const auto& verb : verbs) {
    const auto outcome = test::run_oblique({verb, "--help"});
    EXPECT_EQ(outcome.exit_code, 0) << verb;
    EXPECT_EQ(outcome.err, "") << verb;
    EXPECT_NE(outcome.out.find("Examples:\n  oblique " + verb), std::string::npos) << outcome.out;
  }
}

TEST(CommandLine, SolvesOnePointAsOneJsonObject) {
  const auto outcome = test::run_oblique(
      {"solve", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["H"], 1.0);
  EXPECT_EQ(json["mode"], "sC sR sC sR sC sR");
  EXPECT_NEAR(json["fn_peak_N"], 5057.63, 0.15);
  EXPECT_EQ(json["major_peaks_N"].size(), 3U);
}

TEST(CommandLine, ConvergesWithTheModelOfThePointThatItsFilterLeavesIn) {
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

TEST(CommandLine, SaysOfACoarseMeshWhatItCostsBesideTheDataAndOfAStudyOnce) {
  const test::TemporaryFolder folder;
  const auto err_of = [&](std::vector<std::string> words) {
    words.insert(words.end(), {"--H", "0.6", "--mu", "0.4", "--e", "1"});
    return test::run_oblique(folder, words).err;
  };
  const std::string note = "Note: on 4 elements a link forces are off by 3 %";
  EXPECT_THAT(err_of({"solve", "--preset", "paper", "--json"}), HasSubstr(note));
  EXPECT_THAT(err_of({"study", "check", "--preset", "paper", "--no-rate"}), HasSubstr(note));
  EXPECT_THAT(err_of({"run", "--preset", "paper"}), HasSubstr(note));
  EXPECT_THAT(err_of({"run", "--preset", "paper"}), Not(HasSubstr(note))) << "it is there already";
  EXPECT_THAT(err_of({"plot", "--preset", "paper"}), Not(HasSubstr(note)));
  EXPECT_THAT(err_of({"solve"}), Not(HasSubstr("Note")));
}

TEST(CommandLine, AStudyOfThePaperWithoutItsPresetIsRefusedWithWhatDiffers) {
  const test::TemporaryFolder folder;
  const auto run = [&](const std::string& model) {
    std::ofstream(folder.path() / "old.toml") << model << "[[block]]\nH = 0.6\nmu = 0.4\ne = 1\n";
    return test::run_oblique(folder, {"run", "old.toml"});
  };
  ASSERT_EQ(run("[model]\npreset = 'paper'\n").exit_code, 0);
  const auto refused = run("");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("model, elements_per_link: stored 4, given 16"));
}

TEST(CommandLine, PeaksThatAreNoRipplesAreColumnsAndAbsentWhereThereAreFewer) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> point{"--preset", "paper",   "--H", "1",
                                       "--mu",     "1.2,0.6", "--e", "1"};
  std::vector<std::string> words{"run", "--name", "a"};
  words.insert(words.end(), point.begin(), point.end());
  ASSERT_EQ(test::run_oblique(folder, words).exit_code, 0);
  const auto rows = [&](const std::string& format) {
    return test::run_oblique(folder, {"query", "a", "--format", format, "--select",
                                      "mu,major_peak_2_N,major_peak_3_N,major_peak_3_t_s"})
        .out;
  };
  const auto json = nlohmann::json::parse(rows("json"));
  EXPECT_NEAR(json[0]["major_peak_2_N"].get<double>(), 1573.71, 0.02);
  EXPECT_TRUE(json[0]["major_peak_3_N"].is_null());
  EXPECT_NEAR(json[1]["major_peak_2_N"].get<double>(), 1587.48, 0.02) << "no ripple of 784.43 N";
  EXPECT_NEAR(json[1]["major_peak_3_N"].get<double>(), 2395.13, 0.02);
  EXPECT_THAT(rows("csv"), HasSubstr(",,\n"));
  EXPECT_EQ(test::run_oblique(folder, {"query", "a", "--where", "major_peak_3_N IS NULL",
                                       "--select", "point", "--format", "csv"})
                .out,
            "point\n0\n");
}

TEST(CommandLine, WritesATraceFromTouchToSeparation) {
  const test::TemporaryFolder folder;
  const auto outcome = test::run_oblique(folder, {"solve", "--preset", "paper", "--H", "1", "--mu",
                                                  "1.2", "--e", "1", "--trace", "trace.csv"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("contact"), std::string::npos);
  std::ifstream trace(folder.path() / "trace.csv");
  std::string line;
  std::getline(trace, line);
  EXPECT_TRUE(line.starts_with("t_s,fn_N,ft_N,uy_m,ux_m,xP_m,vP_m_s,x_m,y_m,vt_m_s,vn_m_s,state"))
      << line;
  int rows = 0;
  double t_s = -1.0;
  while (std::getline(trace, line)) {
    const double next_s = std::stod(line);
    EXPECT_GE(next_s, t_s);
    t_s = next_s;
    ++rows;
  }
  EXPECT_GT(rows, 100);
  EXPECT_NEAR(t_s, 345.82e-6, 0.1e-6);
}

TEST(CommandLine, WritesATraceWithShapeToStandardOutputAndTheRestToStandardError) {
  const auto outcome =
      test::run_oblique({"solve", "--H", "0.9", "--mu", "0.4", "--e", "1", "--elements-per-link",
                         "1", "--trace", "-", "--trace-shape"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream trace(outcome.out);
  std::string line;
  std::getline(trace, line);
  EXPECT_TRUE(line.ends_with("node2x_m,node2y_m,node3x_m,node3y_m")) << line;
  const auto columns = std::count(line.begin(), line.end(), ',');
  int rows = 0;
  while (std::getline(trace, line)) {
    ASSERT_EQ(std::count(line.begin(), line.end(), ','), columns) << line;
    ++rows;
  }
  EXPECT_GT(rows, 20);
  EXPECT_NE(outcome.err.find("contact"), std::string::npos) << "the summary";
}

TEST(CommandLine, RefusesATraceThatHasNoPlaceToGo) {
  const std::vector<std::string> point{
      "solve", "--H", "0.9", "--mu", "0.4", "--e", "1", "--elements-per-link", "1"};
  const auto with = [&point](std::vector<std::string> more) {
    more.insert(more.begin(), point.begin(), point.end());
    return test::run_oblique(more);
  };
  for (const auto& [flags, reason] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--trace", "-", "--json"}, "both write to standard output"},
           {{"--trace", ""}, "--trace: the value is empty"},
           {{"--trace-shape"}, "--trace"}}) {
    const auto outcome = with(flags);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err.find(reason), std::string::npos) << outcome.err;
  }
}

TEST(CommandLine, SaysThatNobodyAnswersAndWhatToDo) {
  const auto outcome =
      test::run_oblique({"status", "--server", "tcp://127.0.0.1:1", "--timeout", "0.05"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(outcome.err.find("no answer from tcp://127.0.0.1:1 within 0.05 s"), std::string::npos)
      << outcome.err;
}

TEST(CommandLine, RefusesFilesThatAreNotRegularAndSaysWhatTheyAre) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(mkfifo(folder.file("pipe").c_str(), 0600), 0);
  std::ofstream(folder.path() / "pipe.toml") << "[[block]]\ncsv = 'pipe'\n";
  const struct {
    std::vector<std::string> arguments;
    std::string says;
  } wrong[] = {
      {{"study", "check", "/dev/zero"}, "the study file /dev/zero cannot be read: it is a device"},
      {{"study", "check", "pipe"}, "the study file pipe cannot be read: it is a pipe"},
      {{"study", "check", "pipe.toml"}, "the CSV file pipe cannot be read: it is a pipe"},
      {{"study", "check", "--H", "@pipe", "--mu", "1", "--e", "1"}, "the CSV file ./pipe cannot"},
      {{"status", "--keys", "pipe"}, "the key file pipe cannot be read: it is a pipe"},
      {{"status", "--db", "pipe"}, "pipe is a pipe: a database is a regular file"},
      {{"run", "--db", "pipe", "--H", "1", "--mu", "1", "--e", "1"}, "pipe is a pipe"},
      {{"merge", "pipe"}, "pipe is a pipe"},
      {{"backup", "saved.db", "--db", "pipe", "--salvage"}, "pipe is a pipe"},
      {{"autoscale", "slurm", "--max", "1", "--script", "pipe"}, "the script pipe cannot be read"},
  };
  for (const auto& [arguments, says] : wrong) {
    const auto outcome = test::run_oblique(folder, arguments);
    EXPECT_NE(outcome.exit_code, 0) << testing::PrintToString(arguments);
    EXPECT_NE(outcome.err.find(says), std::string::npos) << outcome.err;
  }
  const auto doctor = test::run_oblique(folder, {"doctor", "--db", "./pipe"});
  EXPECT_NE(doctor.out.find("/pipe is a pipe"), std::string::npos) << doctor.out;
}

TEST(CommandLine, RepeatsAtMostEightyCharactersOfAWrongKey) {
  const test::TemporaryFolder folder;
  const std::string key(100'000, 'k');
  const auto expect_short = [&](const std::vector<std::string>& arguments) {
    const auto outcome = test::run_oblique(folder, arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err.substr(0, 1000);
    EXPECT_NE(outcome.err.find(key.substr(0, 40)), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find(key.substr(0, 81)), std::string::npos)
        << outcome.err.substr(0, 1000);
  };
  expect_short({"solve", "--" + key});
  expect_short({key});
  for (const std::string& text :
       {key + " = 1\n", "[model]\n" + key + " = 1\n", "[[block]]\n" + key + " = 1\n",
        "[[block]]\nH = { " + key + " = 1 }\n", "[[block]]\nsample = { " + key + " = 1 }\n",
        "[[block]]\nmu = '" + key + "'\nH = 1\ne = 1\n", key + " = 1\n" + key + " = 2\n"}) {
    std::ofstream(folder.path() / "a.toml") << text;
    expect_short({"study", "check", "a.toml"});
  }
  ASSERT_EQ(test::run_oblique(folder, {"keygen", "keys"}).exit_code, 0);
  std::ofstream(folder.path() / "keys/client.key", std::ios::app) << key << " = 1\n";
  expect_short({"status", "--keys", "keys/client.key"});
}

TEST(CommandLine, SaysThatADatabaseIsNotThere) {
  const auto outcome = test::run_oblique({"studies", "--db", "nowhere.db"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("nowhere.db"), std::string::npos) << outcome.err;
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

}  // namespace
}  // namespace oblique::client
