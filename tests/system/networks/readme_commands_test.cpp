// The commands of README.md by which a second machine joins, as they stand there.
#include <fstream>
#include <iterator>
#include <memory>
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/programs.h"
#include "tests/system/networks/study_on_lan.h"

namespace oblique::test {
namespace {

using ::testing::HasSubstr;

std::string readme() {
  std::ifstream file(OBLIQUE_SOURCE_DIR "/README.md");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// What the first fenced block of that kind has after `place`.
std::string block_after(const std::string& text, const std::string& place,
                        const std::string& kind) {
  const std::string fence = "\n```" + kind + "\n";
  const auto begin = text.find(fence, text.find(place)) + fence.size();
  return text.substr(begin, text.find("\n```", begin) + 1 - begin);
}

/// A command and the machine on whose prompt it is typed.
struct Typed {
  std::string machine;
  std::string command;
};

std::vector<Typed> commands_of(const std::string& block) {
  std::vector<Typed> commands;
  const std::regex line("(\\w+)\\$ +(.*)\n");
  for (std::sregex_iterator found(block.begin(), block.end(), line), end; found != end; ++found) {
    commands.push_back({found->str(1), found->str(2)});
  }
  return commands;
}

class ReadmeCommands : public StudyOnLan {
 protected:
  void SetUp() override {
    StudyOnLan::SetUp();
    if (lan_) {
      lan_->set_addresses("coordinator", {server_host_->v4(), server_host_->v6()});
    }
  }

  /// Types it on its machine. scp, which needs a login there, is a cp of the machines' folders.
  std::unique_ptr<Process> type(const Typed& typed) const {
    const bool is_coordinator = typed.machine == "coordinator";
    const Inside inside(is_coordinator ? *server_host_ : *client_host_);
    std::string command = "exec " + typed.command;
    if (typed.command.starts_with("scp ")) {
      const std::regex login("coordinator:");
      command = "cp " + std::regex_replace(typed.command.substr(4), login,
                                           coordinator_.path().string() + "/");
    }
    const std::string programs = server_program().substr(0, server_program().rfind('/'));
    return std::make_unique<Process>(is_coordinator ? coordinator_ : elsewhere_, "/bin/sh",
                                     std::vector<std::string>{"-ec", command},
                                     Environment{{"PATH", programs + ":/usr/bin:/bin"}});
  }

  TemporaryFolder coordinator_;
  TemporaryFolder elsewhere_;
};

TEST_F(ReadmeCommands, AreFiveFromTheFirstKeyToTheFirstResultFromAnotherMachine) {
  const std::string text = readme();
  std::ofstream(elsewhere_.file("first.toml")) << block_after(text, "## A study", "toml");
  const auto commands = commands_of(block_after(text, "## More than one machine", ""));
  ASSERT_EQ(commands.size(), 5U);
  std::vector<std::unique_ptr<Process>> stay;
  Outcome last{};
  for (const Typed& typed : commands) {
    auto process = type(typed);
    if (typed.command.starts_with("oblique-")) {
      stay.push_back(std::move(process));
      continue;
    }
    last = process->outcome();
    ASSERT_EQ(last.exit_code, 0) << typed.command << "\n" << last.err;
  }
  EXPECT_EQ(stay.size(), 2U) << "a server and a worker";
  EXPECT_THAT(last.out, HasSubstr("fn_peak_N"));
  EXPECT_THAT(last.out, HasSubstr("solved"));
}

}  // namespace
}  // namespace oblique::test
