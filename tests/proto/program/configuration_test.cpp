#include "proto/program/configuration.h"

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proto/program/usage.h"
#include "tests/support/temporary_folder.h"

namespace oblique::protocol {
namespace {

/// Parses the options of a small program from file, environment and flags.
class ConfigurationTest : public testing::Test {
 protected:
  struct Options {
    std::string db = "default.db";
    int port = 7600;
    bool loud = false;
    int connections = 10;
    std::vector<std::string> listen;
    std::string keys;
    int ready_fd = -1;
    LogSettings log;
  };

  ~ConfigurationTest() override {
    for (const std::string& name : variables_) {
      unsetenv(name.c_str());
    }
  }

  std::string write(const std::string& text, const std::string& name = "a.toml") {
    std::ofstream(folder_.file(name)) << text;
    return folder_.file(name);
  }

  void set(const std::string& name, const std::string& value) {
    setenv(name.c_str(), value.c_str(), 1);
    variables_.push_back(name);
  }

  /// Parses `words` into `options_`. Stores errors in `errors_` and printed settings in `printed_`.
  std::optional<int> parse(std::vector<std::string> words) {
    options_ = Options();
    CLI::App app("A program under test", "program");
    app.option_defaults()->always_capture_default();
    Configuration configuration(app, "TEST_PROGRAM_", default_file_);
    app.add_option("--db", options_.db);
    app.add_option("--port", options_.port)->check(number_between(0, 65535));
    app.add_flag("--loud", options_.loud);
    app.add_option("--listen", options_.listen);
    app.add_option("--keys", options_.keys)->envname("TEST_KEYS");
    app.add_option("--limits-connections", options_.connections)->check(CLI::PositiveNumber);
    app.add_option("--ready-fd", options_.ready_fd)->configurable(false);
    configuration.add_log_options(options_.log);
    std::vector<const char*> arguments{"program"};
    for (const std::string& word : words) {
      arguments.push_back(word.c_str());
    }
    const std::ostringstream printed;
    auto* const before = std::cerr.rdbuf(printed.rdbuf());
    const auto exit_code =
        configuration.parse(static_cast<int>(arguments.size()), arguments.data());
    std::cerr.rdbuf(before);
    errors_ = printed.str();
    printed_ = exit_code ? "" : configuration.printed();
    return exit_code;
  }

  void expect_refused(const std::vector<std::string>& words, const std::string& sentence) {
    EXPECT_EQ(parse(words), 2) << sentence;
    EXPECT_NE(errors_.find(sentence), std::string::npos) << errors_;
  }

  test::TemporaryFolder folder_;
  std::string default_file_ = folder_.file("default.toml");
  Options options_;
  std::string errors_;
  std::string printed_;
  std::vector<std::string> variables_;
};

TEST_F(ConfigurationTest, FlagsOverrideTheEnvironmentWhichOverridesTheFile) {
  const std::string file = write(
      "db = \"file.db\"\nport = 1\nloud = true\n"
      "listen = [\"127.0.0.1\", \"::1\"]\n[limits]\nconnections = 3\n");
  set("TEST_PROGRAM_PORT", "2");
  set("TEST_PROGRAM_LIMITS_CONNECTIONS", "4");
  set("TEST_PROGRAM_LOUD", "false");
  set("TEST_KEYS", "shared.key");
  EXPECT_EQ(parse({"--config", file, "--limits-connections", "5"}), std::nullopt) << errors_;
  EXPECT_EQ(options_.db, "file.db");
  EXPECT_EQ(options_.port, 2);
  EXPECT_EQ(options_.connections, 5);
  EXPECT_FALSE(options_.loud);
  EXPECT_EQ(options_.listen, (std::vector<std::string>{"127.0.0.1", "::1"}));
  EXPECT_EQ(options_.keys, "shared.key")
      << "the value comes from the section shared by several programs";
  set("TEST_PROGRAM_KEYS", "own.key");
  set("TEST_PROGRAM_PORT", "");
  set("TEST_PROGRAM_SERVICE_HOST", "10.0.0.1");
  EXPECT_EQ(parse({"--config", file, "--listen", "::2"}), std::nullopt) << errors_;
  EXPECT_EQ(options_.keys, "own.key");
  EXPECT_EQ(options_.port, 1) << "empty variables and variables of unknown settings are ignored";
  EXPECT_EQ(options_.listen, std::vector<std::string>{"::2"}) << "a flag replaces the list";
}

TEST_F(ConfigurationTest, TheFileComesFromTheFlagOrTheEnvironmentOrIsTheDefault) {
  write("port = 1\n", "default.toml");
  EXPECT_EQ(parse({}), std::nullopt);
  EXPECT_EQ(options_.port, 1);
  set("TEST_PROGRAM_CONFIG", write("port = 2\n", "b.toml"));
  EXPECT_EQ(parse({}), std::nullopt);
  EXPECT_EQ(options_.port, 2);
  EXPECT_EQ(parse({"--config", write("port = 3\n")}), std::nullopt);
  EXPECT_EQ(options_.port, 3);
  expect_refused({"--config", folder_.path().string()}, "cannot be read");
  set("TEST_PROGRAM_CONFIG", folder_.file("gone.toml"));
  expect_refused({}, "gone.toml");
}

TEST_F(ConfigurationTest, NoConfigIgnoresFilesAndEnvironment) {
  write("port = 1\n", "default.toml");
  set("TEST_PROGRAM_DB", "environment.db");
  set("TEST_KEYS", "a.key");
  EXPECT_EQ(parse({"--no-config"}), std::nullopt);
  EXPECT_EQ(options_.port, 7600);
  EXPECT_EQ(options_.db, "default.db");
  EXPECT_EQ(options_.keys, "");
  expect_refused({"--no-config", "--config", folder_.file("default.toml")},
                 "--config excludes --no-config");
}

TEST_F(ConfigurationTest, ReadingThePrintedSettingsGivesTheSameSettings) {
  EXPECT_EQ(parse({}), std::nullopt);
  EXPECT_EQ(parse({"--config", write(printed_)}), std::nullopt) << errors_ << printed_;
  EXPECT_EQ(options_.db, "default.db");
  EXPECT_TRUE(options_.listen.empty());
  const std::string odd = "a \"b\" \\ 'c' \x1b\xc3\xa4.db";
  EXPECT_EQ(parse({"--db", "3", "--keys", "true"}), std::nullopt);
  EXPECT_EQ(parse({"--config", write(printed_)}), std::nullopt) << errors_ << printed_;
  EXPECT_EQ(options_.db + options_.keys, "3true");
  EXPECT_EQ(parse({"--db", odd, "--port", "9", "--loud", "--listen", "::1", "--quiet",
                   "--limits-connections", "6"}),
            std::nullopt)
      << errors_;
  const std::string file = write(printed_);
  EXPECT_EQ(parse({"--config", file}), std::nullopt) << errors_ << printed_;
  EXPECT_EQ(options_.db, odd);
  EXPECT_EQ(options_.port, 9);
  EXPECT_TRUE(options_.loud);
  EXPECT_EQ(options_.listen, std::vector<std::string>{"::1"});
  EXPECT_EQ(options_.log.level, "warning");
  EXPECT_EQ(options_.connections, 6);
}

TEST_F(ConfigurationTest, ErrorsInTheFileHaveTheirLine) {
  const auto refuse = [this](const std::string& text, const std::string& sentence) {
    const std::string file = write(text);
    expect_refused({"--config", file}, sentence);
    EXPECT_NE(errors_.find(file + ":"), std::string::npos) << errors_;
  };
  refuse("\nprot = 5\n", "a.toml:2:1: there is no setting prot (did you mean `port`?)");
  refuse("[limits]\nconections = 5\n", "did you mean `limits_connections`?");
  refuse("port = 99999\n", R"(a.toml:1:1: --port: "99999" is not a number)");
  refuse("port = true\n", "a.toml:1:8: port = true is not allowed: it must be a number");
  refuse("port = \"80\"\n", "a.toml:1:8: port = '80' is not allowed: it must be a number");
  refuse("port = []\n", "a.toml:1:8: port = [] is not allowed: it must be a number");
  refuse("db = 3\n", "a.toml:1:6: db = 3 is not allowed: it must be a string");
  refuse("db = true\n", "a.toml:1:6: db = true is not allowed: it must be a string");
  refuse("\nlisten = [\"::1\", 5]\n", "a.toml:2:18: listen = 5 is not allowed");
  refuse("[log]\nlevel = 1\n", "a.toml:2:9: log_level = 1 is not allowed: it must be a string");
  refuse("loud = 1\n", "a.toml:1:8: loud = 1 is not allowed: it must be a boolean");
  refuse("port = [1, 2]\n", "a.toml:1:1: --port was given more than once");
  refuse("port = 1979-05-27\n", "a.toml:1:8: port = 1979-05-27 is not allowed");
  refuse("loud = \"perhaps\"\n", "a.toml:1:8: loud = 'perhaps' is not allowed");
  refuse("loud = \n", "a.toml:1:");
  refuse("db = \"\"\n", "a.toml:1:6: db = ");
  refuse("ready_fd = 1\n", "there is no setting ready_fd");
  refuse("[log]\nlevel = \"shrill\"\n", "a.toml:2:1: --log-level: ");
  refuse("[no]\nkey = 1\n", "a.toml:2:1: there is no setting no_key");
  refuse("[limits.deep]\nkey = 1\n", "there is no setting limits_deep");
  refuse("limits = 5\n", "a.toml:1:1: there is no setting limits");
}

TEST_F(ConfigurationTest, AWrongValueIsNamedWithItsPlace) {
  set("TEST_PROGRAM_PORT", "70000");
  expect_refused({}, "environment variable TEST_PROGRAM_PORT: --port: \"70000\"");
  expect_refused({"--port", "80000"}, "program: --port: \"80000\"");
}

TEST_F(ConfigurationTest, QuietIsShortForALogLevel) {
  const std::string file = write("[log]\nlevel = \"debug\"\n");
  EXPECT_EQ(parse({"--config", file}), std::nullopt);
  EXPECT_EQ(options_.log.level, "debug");
  EXPECT_EQ(parse({"--config", file, "--quiet"}), std::nullopt);
  EXPECT_EQ(options_.log.level, "warning");
  EXPECT_NE(printed_.find("log_level = \"warning\""), std::string::npos) << printed_;
  set("TEST_PROGRAM_LOG_LEVEL", "error");
  EXPECT_EQ(parse({"--quiet"}), std::nullopt) << errors_;
  EXPECT_EQ(options_.log.level, "warning");
  expect_refused({"--quiet", "--log-level", "info"}, "excludes");
}

}  // namespace
}  // namespace oblique::protocol
