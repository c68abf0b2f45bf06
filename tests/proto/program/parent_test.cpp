#include "proto/program/process.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

namespace oblique::protocol {
namespace {

/// What `begin` gives in a process of its own, started with these words; −1 when the words are
/// wrong.
int began(std::vector<std::string> words) {
  const pid_t child = fork();
  if (child == 0) {
    StopWithParent parent;
    CLI::App app;
    app.option_defaults()->always_capture_default();
    parent.add_to(app);
    try {
      app.parse(std::move(words));
      int signal = 0;
      const bool begins = parent.begin();
      const bool watches = prctl(PR_GET_PDEATHSIG, &signal) == 0 && signal == SIGTERM;
      _exit((begins ? 1 : 0) + (watches ? 2 : 0));
    } catch (const CLI::ParseError&) {
      _exit(100);
    }
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return WIFEXITED(status) && WEXITSTATUS(status) != 100 ? WEXITSTATUS(status) : -1;
}

constexpr int kBegins = 1;
constexpr int kWatches = 2;

TEST(StopWithParent, WithoutTheOptionNobodyIsWatched) {
  EXPECT_EQ(began({}), kBegins);
}

TEST(StopWithParent, TheSystemIsAskedForSigtermWhenTheParentEnds) {
  EXPECT_EQ(began({"--stop-with-parent"}), kBegins + kWatches);
  EXPECT_EQ(began({std::to_string(getpid()), "--stop-with-parent"}), kBegins + kWatches);
}

TEST(StopWithParent, AParentThatNamedItselfAndIsGoneIsMissed) {
  EXPECT_EQ(began({std::to_string(getppid()), "--stop-with-parent"}), kWatches);
}

TEST(StopWithParent, WhatIsNoProcessIsRefused) {
  for (const char* const text : {"-1", "0", "1.5", "me"}) {
    EXPECT_EQ(began({text, "--stop-with-parent"}), -1) << text;
  }
}

}  // namespace
}  // namespace oblique::protocol
