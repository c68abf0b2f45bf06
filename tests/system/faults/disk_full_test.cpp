#include <sys/resource.h>

#include <csignal>
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

}  // namespace
}  // namespace oblique::test
