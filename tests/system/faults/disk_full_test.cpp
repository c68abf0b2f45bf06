#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"

namespace oblique::test {
namespace {

/// No file of that process may grow beyond `bytes`, as on a full disk.
void limit_files(pid_t pid, rlim_t bytes) {
  const rlimit limit{bytes, RLIM_INFINITY};
  ASSERT_EQ(prlimit(pid, RLIMIT_FSIZE, &limit, nullptr), 0);
}

std::string status_of(const TemporaryFolder& folder, const Server& server) {
  return run_oblique(folder, {"status", "full", "--server", server.client_url(), "--format", "csv"})
      .out;
}

TEST(DiskFullTest, AStudyWaitsForRoomOnTheDiskSaysSoAndLosesNothing) {
  const TemporaryFolder folder;
  const std::string file = folder.file("full.db");
  const Database database(file);
  Server server(folder, file);
  constexpr rlim_t kRoom = 600'000;
  limit_files(server.process().pid(), kRoom);
  const Outcome submitted =
      run_oblique(folder, {"submit", "--preset", "paper", "--H", "1", "--mu", "0.1:2.0:50", "--e",
                           "0.5:1.0:40", "--name", "full", "--server", server.client_url()});
  ASSERT_EQ(submitted.exit_code, 0) << submitted.err;
  Worker worker(folder, server.worker_url());
  wait_until("the study waits for the disk", [&] {
    return status_of(folder, server).find("takes no results") != std::string::npos;
  });
  const double rows = database.rows();
  EXPECT_GT(rows, 0);
  EXPECT_LT(rows, 2000);
  const Outcome refused =
      run_oblique(folder, {"submit", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1",
                           "--name", "another", "--server", server.client_url()});
  // So little may still have fitted.
  EXPECT_TRUE(refused.exit_code == 0 || refused.err.find("was not stored") != std::string::npos)
      << refused.err;
  EXPECT_TRUE(is_running(server.process().pid()));
  EXPECT_TRUE(is_running(worker.pid()));
  limit_files(server.process().pid(), RLIM_INFINITY);
  const std::string rows_of_study = " FROM results WHERE study_id = 1";
  wait_until("the study is done",
             [&] { return database.number("SELECT count(*)" + rows_of_study) == 2000; });
  EXPECT_EQ(database.number("SELECT count(DISTINCT point)" + rows_of_study), 2000);
  EXPECT_EQ(status_of(folder, server).find("takes no results"), std::string::npos);
  EXPECT_EQ(run_oblique(folder, {"check", "--db", file}).exit_code, 0);
}

TEST(FailedSyncTest, AServerEndsWithOneAndTheNextOneRecovers) {
  const TemporaryFolder folder;
  const std::string file = folder.file("failing.db");
  // LD_PRELOAD ends a path at a space or colon, which that of the build folder may have.
  const std::string library = folder.file("failing_sync.so");
  std::filesystem::create_symlink(OBLIQUE_FAILING_SYNC, library);
  const std::string mark = folder.file("fails");
  const auto submit = [&](const Server& server, const std::string& name) {
    return run_oblique(folder, {"submit", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e",
                                "1", "--name", name, "--server", server.client_url()});
  };
  {
    Server server(folder, file, {{"LD_PRELOAD", library}, {"OBLIQUE_FAIL_SYNC", mark}});
    ASSERT_EQ(submit(server, "before").exit_code, 0);
    std::ofstream(mark).put('x');
    EXPECT_NE(submit(server, "lost").exit_code, 0) << "it is not durable";
    EXPECT_EQ(server.process().wait(), 1);
    EXPECT_NE(server.process().err().find("the disk failed to store"), std::string::npos)
        << server.process().err();
  }
  Server next(folder, file);
  EXPECT_EQ(submit(next, "after").exit_code, 0);
  Worker worker(folder, next.worker_url());
  for (const char* study : {"before", "after"}) {
    EXPECT_EQ(run_oblique(folder, {"watch", study, "--server", next.client_url()}).exit_code, 0);
  }
  EXPECT_EQ(run_oblique(folder, {"check", "--db", file}).exit_code, 0);
}

}  // namespace
}  // namespace oblique::test
