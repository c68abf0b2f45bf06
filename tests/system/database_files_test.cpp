// Databases that are deleted or replaced while their server runs, or that another program reads
// while the server ends.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/many_points.h"

namespace oblique::test {
namespace {

namespace fs = std::filesystem;

/// Reads a database as another program does.
class OtherReader {
 public:
  explicit OtherReader(const std::string& file) {
    sqlite3_open_v2(file.c_str(), &database_, SQLITE_OPEN_READONLY, nullptr);
    sqlite3_prepare_v2(database_, "SELECT point FROM results", -1, &statement_, nullptr);
  }
  ~OtherReader() {
    sqlite3_finalize(statement_);
    sqlite3_close(database_);
  }
  OtherReader(const OtherReader&) = delete;
  OtherReader& operator=(const OtherReader&) = delete;

  /// Starts a query and leaves it unfinished. Returns false if the query has no row.
  bool read_one() { return sqlite3_step(statement_) == SQLITE_ROW; }
  void finish_query() { sqlite3_reset(statement_); }

 private:
  sqlite3* database_ = nullptr;
  sqlite3_stmt* statement_ = nullptr;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class DatabaseFilesTest : public ::testing::Test {
 protected:
  std::vector<std::string> run_arguments() const {
    return many_points("some", {"run", "--workers", "1", "--db", file_});
  }
  void submit_to(const Server& server) const {
    const Outcome ran =
        run_oblique(folder_, many_points("some", {"submit", "--server", server.client_url()}));
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
  }

  TemporaryFolder folder_;
  std::string file_ = folder_.file("some.db");
  Database database_{file_};
};

TEST_F(DatabaseFilesTest, AServerWhoseDatabaseIsDeletedReportsThisAndExitsWith1) {
  Server server(folder_, file_);
  Worker worker(folder_, server.worker_url());
  submit_to(server);
  wait_until("rows in the database", [&] { return database_.rows() > 0; });
  fs::remove(file_);
  EXPECT_EQ(server.process().wait(), 1);
  EXPECT_TRUE(contains(server.process().err(), file_ + " was deleted")) << server.process().err();
  EXPECT_TRUE(is_running(worker.pid())) << "a worker keeps unacknowledged results";
}

TEST_F(DatabaseFilesTest, ARunWhoseDatabaseIsReplacedFailsWithThatReason) {
  const std::string other = folder_.file("other.db");
  ASSERT_EQ(run_oblique(folder_, {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1",
                                  "--db", other})
                .exit_code,
            0);
  Process run(folder_, client_program(), run_arguments());
  wait_until("rows in the database", [&] { return database_.rows() > 0; });
  fs::rename(other, file_);
  EXPECT_EQ(run.wait(), 1);
  EXPECT_TRUE(contains(run.err(), file_ + " was replaced")) << run.err();
  EXPECT_EQ(database_.rows(), 1) << "the other database is unchanged";
}

TEST_F(DatabaseFilesTest, AServerStoppedInTheMiddleOfAStudyCompletesItWhenItIsStartedAgain) {
  Server server(folder_, file_);
  Worker worker(folder_, server.worker_url());
  submit_to(server);
  wait_until("rows in the database", [&] { return database_.rows() > 0; });
  server.process().send(SIGTERM);
  EXPECT_EQ(server.process().wait(), 0) << server.process().err();
  ASSERT_LT(database_.rows(), kManyPoints)
      << "the study was complete before the server was stopped";
  const Server next(folder_, file_, server);
  wait_until("all rows", [&] { return database_.rows() == kManyPoints; });
  EXPECT_EQ(database_.number("SELECT count(DISTINCT point) FROM results WHERE status = 'solved'"),
            kManyPoints);
}

TEST_F(DatabaseFilesTest, AfterARunTheFileAloneContainsAllRowsEvenIfAnotherProgramHasItOpen) {
  ASSERT_EQ(run_oblique(folder_, {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1",
                                  "--db", file_})
                .exit_code,
            0);
  OtherReader reader(file_);
  ASSERT_TRUE(reader.read_one());
  reader.finish_query();
  const Outcome ran = run_oblique(folder_, run_arguments());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_FALSE(contains(ran.err, "-wal")) << ran.err;
  fs::copy_file(file_, folder_.file("copy.db"));
  EXPECT_EQ(Database(folder_.file("copy.db")).rows(), kManyPoints + 1);
}

TEST_F(DatabaseFilesTest, WhenAStudyIsDoneTheFileAloneContainsAllRowsAlthoughTheServerRuns) {
  Server server(folder_, file_);
  const Worker worker(folder_, server.worker_url());
  submit_to(server);
  wait_until("all rows", [&] { return database_.rows() == kManyPoints; });
  wait_until("an empty log", [&] { return fs::file_size(file_ + "-wal") == 0; });
  fs::copy_file(file_, folder_.file("copy.db"));
  EXPECT_EQ(Database(folder_.file("copy.db")).rows(), kManyPoints);
}

TEST_F(DatabaseFilesTest, AServerThatEndsDuringALongQueryReportsThatRowsAreInTheWriteAheadLog) {
  Server server(folder_, file_);
  Worker worker(folder_, server.worker_url());
  submit_to(server);
  wait_until("rows in the database", [&] { return database_.rows() > 0; });
  OtherReader reader(file_);
  ASSERT_TRUE(reader.read_one());
  const double seen = database_.rows();
  wait_until("more rows", [&] { return database_.rows() > seen; });
  server.process().send(SIGTERM);
  EXPECT_EQ(server.process().wait(), 0);
  EXPECT_TRUE(contains(server.process().err(), "oblique backup")) << server.process().err();
}

TEST_F(DatabaseFilesTest, ADatabaseInUseMayBeASourceButNotTheTargetOfAMerge) {
  const Server server(folder_, file_);
  submit_to(server);
  const Outcome from = run_oblique(folder_, {"merge", file_, "--db", folder_.file("all.db")});
  EXPECT_EQ(from.exit_code, 0) << from.err;
  EXPECT_TRUE(contains(from.err, "added 1 study")) << from.err;
  EXPECT_TRUE(contains(from.err, "A server uses")) << from.err;
  const Outcome into = run_oblique(folder_, {"merge", folder_.file("all.db"), "--db", file_});
  EXPECT_EQ(into.exit_code, 1);
  EXPECT_TRUE(contains(into.err, "another server")) << into.err;
}

TEST_F(DatabaseFilesTest, ADatabaseIsNotMergedIntoItselfUnderAnyName) {
  { const Server server(folder_, file_); }
  fs::create_hard_link(file_, folder_.file("other name.db"));
  const Outcome ran = run_oblique(folder_, {"merge", folder_.file("other name.db"), "--db", file_});
  EXPECT_EQ(ran.exit_code, 2) << ran.err;
}

}  // namespace
}  // namespace oblique::test
