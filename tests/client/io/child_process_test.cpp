#include "client/io/child_process.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

ChildSettings shell(const std::string& script) {
  return {.program = "/bin/sh", .arguments = {"-c", script}};
}

TEST(ChildProcess, KeepsTheLastOutputOfAFailedChild) {
  ChildProcess child(shell("for i in $(seq 100); do echo line $i >&2; done; exit 3"));
  child.wait();
  EXPECT_EQ(child.ending(), "ended with exit code 3");
  const auto words = child.last_output();
  EXPECT_TRUE(words.ends_with("line 99\nline 100")) << words;
  EXPECT_EQ(words.find("line 50\n"), std::string::npos);
}

TEST(ChildProcess, NamesTheSignalThatEndedAChild) {
  ChildProcess child(shell("exec sleep 600"));
  EXPECT_TRUE(child.is_running());
  child.send(SIGKILL);
  child.wait();
  EXPECT_EQ(child.ending(), "was killed by signal 9 (Killed)");
}

TEST(ChildProcess, IsKilledAndReapedByTheDestructor) {
  pid_t pid = 0;
  {
    const ChildProcess child(shell("exec sleep 600"));
    pid = child.pid();
  }
  EXPECT_EQ(kill(pid, 0), -1);
  EXPECT_EQ(errno, ESRCH);
}

TEST(ChildProcess, RunsInAProcessGroupOfItsOwnWithNoSignalBlocked) {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  ChildProcess child(shell("grep SigBlk /proc/self/status >&2; exec sleep 600"));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_EQ(getpgid(child.pid()), child.pid());
  while (child.last_output().empty()) {
    std::this_thread::yield();
  }
  EXPECT_EQ(child.last_output(), "SigBlk:\t0000000000000000");
}

TEST(ChildProcess, InheritsTheGivenDescriptors) {
  Pipe pipe;
  Pipe input;
  auto settings = shell("cat >&3");
  settings.handed_over = pipe.write.number();
  settings.input_from = input.read.number();
  ChildProcess child(settings);
  pipe.write.close();
  ASSERT_EQ(::write(input.write.number(), "hello\n", 6), 6);
  input.write.close();
  child.wait();
  std::array<char, 16> bytes{};
  const auto length = read(pipe.read.number(), bytes.data(), bytes.size());
  EXPECT_EQ(std::string(bytes.data(), static_cast<std::size_t>(length)), "hello\n");
}

TEST(ChildProcess, ReadsItsInputAndEndsWithTheProcessGroupOfItsParent) {
  auto settings = shell("cat");
  const std::string long_text(1'000'000, 'x');
  settings.input = long_text + "end";
  settings.keep_output = true;
  settings.stays_in_our_group = true;
  ChildProcess child(settings);
  EXPECT_EQ(getpgid(child.pid()), getpgrp());
  child.wait();
  EXPECT_EQ(child.output(2'000'000), long_text + "end");
}

TEST(ChildProcess, StartingAMissingProgramIsAnError) {
  EXPECT_THROW(ChildProcess({.program = "/nowhere/program", .arguments = {}}), ProgramNotFound);
}

TEST(OutputOf, ReturnsStandardOutputOrTheLastErrorsOfAFailedProgram) {
  EXPECT_EQ(output_of(shell("echo words; echo noise >&2; echo more")), "words\nmore\n");
  const auto error_of = [](const std::string& script, int calls) {
    try {
      return output_of(shell(script), [&calls] { return --calls > 0; });
    } catch (const ProcessError& error) {
      return std::string(error.what());
    }
  };
  constexpr int kManyCalls = 1'000'000;
  EXPECT_EQ(error_of("echo out; echo one >&2; echo two >&2; exit 3", kManyCalls),
            "/bin/sh ended with exit code 3: one two");
  EXPECT_EQ(error_of("exec sleep 600", 3), "stopped waiting for /bin/sh");
  EXPECT_NE(error_of("head -c 20000000 /dev/zero", kManyCalls).find("at most"), std::string::npos);
}

}  // namespace
}  // namespace oblique::client
