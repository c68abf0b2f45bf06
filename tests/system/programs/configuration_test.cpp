// Settings of server and worker from a file, the environment and flags.
#include <csignal>
#include <fstream>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/programs.h"

namespace oblique::test {
namespace {

std::string write(const std::string& file, const std::string& text) {
  std::ofstream(file) << text;
  return file;
}

/// Removes the first line, a comment with the path of the configuration file.
std::string values_of(const std::string& printed) {
  return printed.substr(printed.find('\n'));
}

TEST(ConfigurationOfProgramsTest, PrintedSettingsAreAFileThatGivesTheSameSettings) {
  const TemporaryFolder folder;
  for (const auto& [program, variable, flags] :
       {std::tuple{server_program(), "OBLIQUE_SERVER_DB",
                   std::vector<std::string>{"--client-port", "7", "--print-config"}},
        {worker_program(), "OBLIQUE_WORKER_NAME", {"--threads", "3", "--print-config"}}}) {
    Process first(folder, program, flags, {{variable, "from environment"}});
    ASSERT_EQ(first.wait(), 0) << first.err();
    EXPECT_EQ(first.err(), "");
    EXPECT_NE(first.out().find(" = \"from environment\"\n"), std::string::npos) << first.out();
    const std::string file = write(folder.file("printed.toml"), first.out());
    Process second(folder, program, {"--config", file, "--print-config"});
    ASSERT_EQ(second.wait(), 0) << second.err();
    EXPECT_EQ(values_of(second.out()), values_of(first.out()));
  }
}

TEST(ConfigurationOfProgramsTest, ServerAndWorkerRunWithSettingsFromFilesAlone) {
  const TemporaryFolder folder;
  const std::string server_file = write(folder.file("server.toml"),
                                        "db = \"in_the_file.db\"\nworker_port = 0\nclient_port = "
                                        "0\nhttp = \"127.0.0.1:0\"\n[limits]\n"
                                        "connections = 100\n[log]\nformat = \"json\"\n");
  Process server(folder, server_program(), {"--config", server_file});
  wait_until("the server is ready",
             [&] { return server.err().find("workers at ") != std::string::npos; });
  const std::string log = server.err();
  const auto at = log.find("workers at ") + 11;
  const std::string url = log.substr(at, log.find_first_of("\",", at) - at);
  const std::string worker_file = write(
      folder.file("worker.toml"), "server = \"" + url + "\"\nthreads = 1\nname = \"filed\"\n");
  Process worker(folder, worker_program(), {}, {{"OBLIQUE_WORKER_CONFIG", worker_file}});
  wait_until("the worker joins",
             [&] { return server.err().find("(filed, 1 threads) joins") != std::string::npos; });
  EXPECT_NE(log.find("in_the_file.db"), std::string::npos) << log;
  for (Process* process : {&worker, &server}) {
    process->send(SIGTERM);
    EXPECT_EQ(process->wait(), 0) << process->err();
  }
  std::istringstream json(server.err());
  for (std::string line; std::getline(json, line);) {
    EXPECT_TRUE(nlohmann::json::parse(line, nullptr, false).is_object()) << line;
  }
}

TEST(ConfigurationOfProgramsTest, LimitsOfTheServerArePrintedAndWrongOnesRefused) {
  const TemporaryFolder folder;
  for (const std::string key : {"connections", "waiting-out-bytes", "unstored-bytes",
                                "running-queries", "open-points", "credit"}) {
    const auto printed = [&](const std::string& value) {
      Process process(folder, server_program(),
                      {"--limits-" + key + "=" + value, "--print-config"});
      const int exit_code = process.wait();
      return exit_code == 0 ? process.out() : std::to_string(exit_code) + " " + process.err();
    };
    const std::string value = key == "waiting-out-bytes" ? "20000000" : "200";
    EXPECT_NE(printed(value).find(" = " + value + "\n"), std::string::npos) << printed(value);
    for (const char* wrong : {"-1", "0", "1.5", "99999999999999999999", "all"}) {
      const std::string output = printed(wrong);
      EXPECT_TRUE(output.starts_with("2 ")) << output;
      EXPECT_NE(output.find("--limits-" + key), std::string::npos) << output;
    }
  }
}

TEST(ConfigurationOfProgramsTest, HelpNamesTheVariableOfAnOptionAtItsEnd) {
  const TemporaryFolder folder;
  for (const auto& [program, words] : std::vector<std::pair<std::string, std::string>>{
           {server_program(), "(--log-level: OBLIQUE_SERVER_LOG_LEVEL)"},
           {worker_program(), "(--log-level: OBLIQUE_WORKER_LOG_LEVEL)"}}) {
    Process process(folder, program, {"--help"});
    EXPECT_EQ(process.wait(), 0);
    const auto output = process.out().find(words);
    ASSERT_NE(output, std::string::npos) << process.out();
    EXPECT_GT(output, process.out().rfind("\n  --"));
    EXPECT_NE(process.out().find("--print-config shows", output), std::string::npos);
  }
}

TEST(ConfigurationOfProgramsTest, AnUnknownKeyIsWrongUsageAndTheMessageHasTheNearestName) {
  const TemporaryFolder folder;
  for (const auto& [program, text, named] :
       {std::tuple{server_program(), "worker_prot = 5\n", "worker_port"},
        {worker_program(), "thread = 5\n", "threads"}}) {
    Process process(folder, program, {"--config", write(folder.file("a.toml"), text)});
    EXPECT_EQ(process.wait(), 2);
    EXPECT_NE(process.err().find("a.toml:1:1: "), std::string::npos) << process.err();
    EXPECT_NE(process.err().find("did you mean `" + std::string(named)), std::string::npos)
        << process.err();
  }
}

TEST(ConfigurationOfProgramsTest, TheServiceOfARunIgnoresSettingsOfTheMachinesService) {
  const TemporaryFolder folder;
  Process run(folder, client_program(),
              {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1", "--db",
               folder.file("a.db")},
              {{"OBLIQUE_SERVER_DB", folder.file("not_this.db")},
               {"OBLIQUE_SERVER_LISTEN", "192.0.2.1"},
               {"OBLIQUE_WORKER_THREADS", "none"},
               {"OBLIQUE_SERVER_CONFIG", folder.file("missing.toml")}});
  EXPECT_EQ(run.wait(), 0) << run.err();
}

}  // namespace
}  // namespace oblique::test
