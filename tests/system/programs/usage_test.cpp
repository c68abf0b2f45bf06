#include <filesystem>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::test {
namespace {

struct WrongUse {
  std::string program;
  std::vector<std::string> arguments;
  std::string named;  ///< text that the message must contain
};

TEST(UsageTest, WrongArgumentsExitWithTwoAndTheMessageNamesThem) {
  const TemporaryFolder folder;
  const std::string client = client_program();
  const std::vector<std::string> point{"--mu", "0.4", "--e", "1", "--db", folder.file("a.db")};
  const auto run_with = [&](std::vector<std::string> flags) {
    flags.insert(flags.begin(), "run");
    flags.insert(flags.end(), point.begin(), point.end());
    return flags;
  };
  const std::vector<WrongUse> uses{
      {client, {"--bogus"}, "--bogus"},
      {client, {"dance"}, "dance"},
      {client, {"run", "--H"}, "--H"},
      {client, {"run", folder.file("missing.toml")}, "missing.toml"},
      {client, run_with({"--H", "two"}), "two"},
      {client, run_with({"--H", "-1"}), "-1"},
      {client, run_with({"--H", "1.19"}), "1.19"},
      {client, run_with({"--H", "1.1:0.9:3"}), "1.1"},
      {client, run_with({"--H", "1", "--workers", "0"}), "--workers"},
      {client, {"submit", "--H", "1", "--mu", "0.4", "--e", "1", "--server", "nowhere"}, "nowhere"},
      {server_program(), {"--bogus"}, "--bogus"},
      {server_program(), {"--worker-port", "99999999"}, "--worker-port"},
      {server_program(), {"--listen", "0.0.0.0"}, "0.0.0.0"},
      {server_program(), {"--db", ""}, "--db"},
      {server_program(), {"--worker-port", "7700", "--client-port", "7700"}, "7700"},
      {worker_program(), {"--bogus"}, "--bogus"},
      {worker_program(), {"--server", "nowhere"}, "nowhere"},
  };
  for (const WrongUse& use : uses) {
    std::string line = use.program;
    for (const std::string& argument : use.arguments) {
      line += " " + argument;
    }
    Process process(folder, use.program, use.arguments);
    EXPECT_EQ(process.wait(), 2) << line;
    EXPECT_NE(process.err().find(use.named), std::string::npos)
        << line << "\nprinted: " << process.err();
    EXPECT_EQ(process.out(), "") << line;
  }
}

/// Returns the flags that take a value, from the help of `program`.
std::vector<std::string> flags_with_values(const TemporaryFolder& folder,
                                           const std::string& program) {
  Process help(folder, program, {"--help"});
  help.wait();
  std::istringstream lines(help.out());
  std::vector<std::string> flags;
  const std::regex flag(R"(^\s+(?:-\w,)?(--[a-z-]+) (?!Excludes)[A-Z]+.*)");
  std::smatch found;
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_match(line, found, flag)) {
      flags.push_back(found[1]);
    }
  }
  return flags;
}

void expect_refused(const TemporaryFolder& folder, const std::string& program,
                    const std::vector<std::string>& arguments) {
  Process process(folder, program, arguments);
  const std::string line = program + " " + testing::PrintToString(arguments);
  EXPECT_EQ(process.wait(), 2) << line << process.err();
  const std::string name = std::filesystem::path(program).filename().string() + ": ";
  EXPECT_TRUE(process.err().starts_with(name)) << line << process.err();
  const std::string flag = arguments.front().substr(0, arguments.front().find('='));
  EXPECT_NE(process.err().find(flag), std::string::npos) << line << process.err();
  EXPECT_EQ(process.out(), "") << line;
}

TEST(UsageTest, EveryFlagOfServerAndWorkerRefusesAnEmptyValue) {
  const TemporaryFolder folder;
  for (const std::string& program : {server_program(), worker_program()}) {
    const auto flags = flags_with_values(folder, program);
    EXPECT_GE(flags.size(), 3U) << program;
    for (const std::string& flag : flags) {
      expect_refused(folder, program, {flag, ""});
      expect_refused(folder, program, {flag + "=", "--print-config"});
    }
  }
}

TEST(UsageTest, ServerAndWorkerRefuseInvalidValues) {
  const TemporaryFolder folder;
  for (const char* value : {"nan", "-1", "1.5", "65536", "99999999999999999999", "x"}) {
    expect_refused(folder, server_program(), {"--worker-port", value});
    expect_refused(folder, server_program(), {"--client-port", value});
    expect_refused(folder, worker_program(), {"--threads", value});
  }
  for (const char* value : {"nan", "-2", "1.5", "1000000", "99999999999999999999", "x"}) {
    expect_refused(folder, server_program(), {"--ready-fd", value});
  }
  for (const char* value : {"nan", "127.0.0.1", "7602", "127.0.0.1:65536", "example.org:7602"}) {
    expect_refused(folder, server_program(), {"--http", value});
  }
  for (const char* value : {"a b", "oblique.lab:7602", "http://oblique.lab", "\x1b[2J"}) {
    expect_refused(folder, server_program(), {"--http-name", value});
  }
  for (const char* value : {"nan", "-2", "0", "1.5", "99999999999999999999", "x"}) {
    expect_refused(folder, worker_program(), {"--stop-with-parent", value});
  }
  for (const char* value : {"two\nlines", "\x1b[2J", "\xc2\x9b"}) {
    expect_refused(folder, worker_program(), {"--name", value});
  }
}

TEST(UsageTest, EveryProgramPrintsItsVersionAndCommit) {
  const TemporaryFolder folder;
  const auto version = [](const std::string& name) {
    return std::regex(name + R"( \d+\.\d+\.\d+ \(commit (unknown|[0-9a-f]{12}( with changes)?, )"
                             R"(\d{4}-\d\d-\d\d)\)\n)");
  };
  for (const std::string& program : {client_program(), server_program(), worker_program()}) {
    Process process(folder, program, {"--version"});
    EXPECT_EQ(process.wait(), 0) << program;
    const std::string name = std::filesystem::path(program).filename().string();
    EXPECT_TRUE(std::regex_match(process.out(), version(name))) << process.out();
    EXPECT_EQ(process.err(), "") << program;
  }
}

TEST(UsageTest, HelpExitsWithZero) {
  const TemporaryFolder folder;
  for (const std::string& program : {client_program(), server_program(), worker_program()}) {
    Process process(folder, program, {"--help"});
    EXPECT_EQ(process.wait(), 0) << program;
    EXPECT_NE(process.out(), "") << program;
  }
}

}  // namespace
}  // namespace oblique::test
