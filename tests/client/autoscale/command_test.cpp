#include "client/autoscale/command.h"

#include <cstdlib>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/service/connection.h"

namespace oblique::client {
namespace {

CommandSettings command_line(const std::string& script) {
  return {.program = "sh", .arguments = {"-c", script}, .timeout_s = 600.0};
}

std::string error_of_running(const CommandSettings& command) {
  try {
    output_of(command);
    return "none";
  } catch (const CommandError& error) {
    return error.what();
  }
}

TEST(Command, GivesStandardOutputAlone) {
  EXPECT_EQ(output_of(command_line("echo words; echo noise >&2; echo more")), "words\nmore\n");
}

TEST(Command, AFailureSaysWhatTheProgramSaid) {
  EXPECT_EQ(error_of_running(command_line("echo out; echo invalid partition >&2; exit 3")),
            "sh ended with exit code 3: invalid partition");
}

TEST(Command, AProgramThatIsNotThereIsNamed) {
  EXPECT_THAT(error_of_running({.program = "oblique-no-such-program", .arguments = {}}),
              testing::HasSubstr("oblique-no-such-program"));
}

TEST(Command, AProgramThatHangsIsEnded) {
  auto command = command_line("exec sleep 600");
  command.timeout_s = 0.05;
  EXPECT_EQ(error_of_running(command), "sh took longer than 0.05 s");
}

TEST(Command, WaitingCanBeEnded) {
  auto command = command_line("exec sleep 600");
  command.keep_waiting = [looks = 0]() mutable { return ++looks < 3; };
  EXPECT_THROW(output_of(command), Interrupted);
}

TEST(Command, OutputWithoutEndIsRefused) {
  EXPECT_THAT(error_of_running(command_line("head -c 20000000 /dev/zero")),
              testing::HasSubstr("more than"));
}

TEST(Command, HidesVariables) {
  setenv("OBLIQUE_TEST_FILTER", "x", 1);
  auto command = command_line("echo \"<$OBLIQUE_TEST_FILTER>\"");
  EXPECT_EQ(output_of(command), "<x>\n");
  command.hidden_variables = "OBLIQUE_TEST_";
  EXPECT_EQ(output_of(command), "<>\n");
  unsetenv("OBLIQUE_TEST_FILTER");
}

}  // namespace
}  // namespace oblique::client
