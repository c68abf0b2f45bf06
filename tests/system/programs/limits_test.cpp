// Programs with closed streams, on full disks, and within limits of their shell.
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::test {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kPoint = " --H 1 --mu 0.4 --e 1 --preset paper ";

class LimitsTest : public testing::Test {
 protected:
  /// Runs a line of bash, which has more limits than sh.
  Outcome run(const std::string& line, const Environment& environment = {}) const {
    return Process(folder_, "/bin/bash", {"-c", "ulimit -c 0; " + line}, environment).outcome();
  }

  TemporaryFolder folder_;
  std::string client_ = client_program();
  std::string server_ = server_program();
  std::string worker_ = worker_program();
};

TEST_F(LimitsTest, AStudyIsSolvedWithoutStandardStreams) {
  for (const std::string closed : {"<&- >&- 2>&-", "<&-", ">&-", "2>&-", "<&- 2>&-"}) {
    const std::string file = folder_.file("of" + std::to_string(closed.size()) + ".db");
    const auto ended = run(client_ + " run" + kPoint + "--db " + file + " " + closed);
    EXPECT_EQ(ended.exit_code, 0) << closed << ended.err;
    const auto rows =
        run_oblique({"sql", "SELECT count(*) AS n FROM runs", "--db", file, "--format", "csv"});
    EXPECT_EQ(rows.out, "n\n1\n") << closed << rows.err;
  }
}

TEST_F(LimitsTest, MissingStandardStreamsBecomeTheNullDevice) {
  for (const std::string& program : {worker_ + " --server tcp://127.0.0.1:1",
                                     server_ + " --client-port 0 --worker-port 0 --http off"}) {
    const Process process(folder_, "/bin/bash", {"-c", "exec " + program + " <&- >&- 2>&-"});
    for (const char* number : {"0", "1", "2"}) {
      const std::string stream = "/proc/" + std::to_string(process.pid()) + "/fd/" + number;
      wait_until(program + " opens stream " + number, [&] {
        std::error_code closed;
        return std::filesystem::read_symlink(stream, closed) == "/dev/null";
      });
    }
  }
}

TEST_F(LimitsTest, OutputThatCannotBeWrittenGivesExitCodeOneAndTheReason) {
  for (const std::string& words : std::vector<std::string>{
           client_ + " --help", client_ + " --version", client_ + " completion bash",
           client_ + " run --help", client_ + " solve" + kPoint, client_ + " columns",
           client_ + " doctor", server_ + " --help", server_ + " --version",
           server_ + " --print-config", server_ + " completion zsh", worker_ + " --help",
           worker_ + " --version", worker_ + " --print-config", worker_ + " completion bash"}) {
    const auto full = run(words + " > /dev/full");
    EXPECT_EQ(full.exit_code, 1) << words;
    EXPECT_THAT(full.err,
                HasSubstr("standard output could not be written: No space left on device"))
        << words;
  }
}

TEST_F(LimitsTest, AFileSizeLimitIsNamed) {
  for (const std::string& words :
       {client_ + " columns > columns.txt", client_ + " solve" + kPoint + "--trace trace.csv"}) {
    const auto ended = run("ulimit -f 1; " + words);
    EXPECT_EQ(ended.exit_code, 1) << words;
    EXPECT_THAT(ended.err, HasSubstr("File too large")) << words;
  }
  const auto server =
      run("ulimit -f 8; " + server_ + " --client-port 0 --worker-port 0 --http off");
  EXPECT_EQ(server.exit_code, 1);
  EXPECT_THAT(server.err, HasSubstr("the limit on file sizes (ulimit -f) is reached"));
}

TEST_F(LimitsTest, TooFewOpenFilesAreRefusedWithTheLimit) {
  for (const std::string& program : {client_, server_, worker_}) {
    const auto ended = run("ulimit -n 16; " + program + " --version");
    EXPECT_EQ(ended.exit_code, 1) << program;
    EXPECT_THAT(ended.err, HasSubstr("the limit on open files (ulimit -n) is 16; 64 are needed"));
    EXPECT_EQ(run("ulimit -S -n 16; " + program + " --version").exit_code, 0)
        << program << " raises a soft limit";
  }
}

/// Expects that a program that lacked something said so and did not abort. The dynamic linker may
/// fail before the program starts.
void expect_no_abort(const Outcome& ended, const std::string& line) {
  EXPECT_THAT(ended.exit_code, AnyOf(0, 1, 127)) << line << "\n" << ended.err;
  EXPECT_THAT(ended.err, AllOf(Not(HasSubstr("terminate called")), Not(HasSubstr("thread.cpp"))))
      << line;
  EXPECT_TRUE(ended.exit_code == 0 || !ended.err.empty()) << line;
}

#ifndef __SANITIZE_ADDRESS__
TEST_F(LimitsTest, LittleAddressSpaceEndsAProgramWithASentence) {
  int failures = 0;
  // With less than about 25 MB memory may run out before main, where no program can handle it.
  for (const int space_kB : {35'000, 40'000, 45'000, 50'000, 61'440, 70'000}) {
    const std::string limit = "ulimit -v " + std::to_string(space_kB) + "; ";
    for (const std::string& words :
         {worker_ + " --server tcp://127.0.0.1:1 --idle-exit 0.05",
          client_ + " status --server tcp://127.0.0.1:1 --timeout 0.05",
          client_ + " solve" + kPoint, client_ + " run" + kPoint + "--quiet --db of_run.db"}) {
      const auto ended = run(limit + words);
      expect_no_abort(ended, limit + words);
      failures += ended.exit_code == 1 ? 1 : 0;
    }
  }
  EXPECT_GT(failures, 10) << "out of 24; status and the worker fail always";
}
#endif

TEST_F(LimitsTest, TooFewThreadsEndAProgramWithASentence) {
  if (geteuid() != 0) {
    GTEST_SKIP() << "only root can become a user without processes";
  }
  std::filesystem::permissions(folder_.path(), std::filesystem::perms::all);
  for (const std::string& words : {worker_ + " --server tcp://127.0.0.1:1 --idle-exit 0.05",
                                   client_ + " status --server tcp://127.0.0.1:1 --timeout 0.05",
                                   server_ + " --client-port 0 --worker-port 0 --http off"}) {
    for (const char* limit : {"1", "2"}) {
      const std::string line =
          std::string("setpriv --reuid=54321 --clear-groups bash -c 'ulimit -c 0; ulimit -u ") +
          limit + "; exec " + words + "'";
      const auto ended = run(line);
      expect_no_abort(ended, line);
      EXPECT_THAT(ended.err, HasSubstr("no further thread can be started")) << line;
    }
  }
}

TEST_F(LimitsTest, AMissingFolderForTemporaryFilesIsNamed) {
  const auto missing = run(client_ + " run" + kPoint, {{"TMPDIR", "/nowhere"}});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.err, HasSubstr("cannot create a folder for keys in /nowhere: No such file"));
  EXPECT_EQ(run(client_ + " run --quiet" + kPoint, {{"TMPDIR", ""}}).exit_code, 0);
}

TEST_F(LimitsTest, ALoopbackInterfaceThatIsDownIsTheReasonOfAFailedStart) {
  if (run("unshare --map-root-user --net true").exit_code != 0) {
    GTEST_SKIP() << "this machine lets us make no networks";
  }
  const auto ended = run("unshare --map-root-user --net " + client_ + " run" + kPoint);
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_THAT(ended.err, AllOf(HasSubstr("cannot connect to 127.0.0.1: Network is unreachable"),
                               Not(HasSubstr("damaged"))));
}

TEST_F(LimitsTest, TheAffinityMaskDeterminesTheDefaultNumberOfThreads) {
  const auto settings = run("taskset -c $(taskset -cp $$ | sed 's/.*[ ]//; s/[,-].*//') " +
                            worker_ + " --print-config");
  EXPECT_THAT(settings.out, HasSubstr("threads = 1\n")) << settings.err;
  const auto doctor =
      run("taskset -c $(taskset -cp $$ | sed 's/.*[ ]//; s/[,-].*//') " + client_ + " doctor");
  EXPECT_THAT(doctor.out, HasSubstr("1 of "));
  if (sysconf(_SC_NPROCESSORS_ONLN) > 1) {
    EXPECT_THAT(doctor.out, HasSubstr("threads may be used: the affinity mask"));
  }
}

}  // namespace
}  // namespace oblique::test
