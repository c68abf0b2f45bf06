#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/system/processes.h"

namespace oblique::test {
namespace {

struct WrongUse {
  std::string program;
  std::vector<std::string> arguments;
  std::string named;  ///< what the sentence must name
};

TEST(UsageTest, WrongFlagsEndWithTwoAndASentenceThatNamesThem) {
  const Folder folder;
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
    EXPECT_NE(process.errors().find(use.named), std::string::npos)
        << line << "\nsaid: " << process.errors();
    EXPECT_EQ(process.output(), "") << line;
  }
}

TEST(UsageTest, HelpIsNoError) {
  const Folder folder;
  for (const std::string& program : {client_program(), server_program(), worker_program()}) {
    Process process(folder, program, {"--help"});
    EXPECT_EQ(process.wait(), 0) << program;
    EXPECT_NE(process.output(), "") << program;
  }
}

}  // namespace
}  // namespace oblique::test
