// Rows that another study takes over.
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/database/sqlite.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

/// Study 1 has solved points 0 to 9, of which study 2 wants all.
class ResultCopyTest : public testing::Test {
 protected:
  ResultCopyTest() {
    AddResults solved{1, table_of(10), 1, "1.0", "avx2", 1, "2024-01-01T00:00:01.000Z", {}};
    for (std::uint64_t point = 0; point < 10; ++point) {
      solved.results.push_back(solved_point(point));
    }
    store_.commit(std::vector<Change>{AddWorker{1, "host", 1, "1.0", "avx2", "then"},
                                      AddStudy{1, "a", table_of(10), "then"},
                                      AddStudy{2, "b", table_of(10), "then"}, solved});
  }

  /// As somebody with another tool does.
  void edit(const std::string& sql) {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file_.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(database);
    sqlite3_close(database);
  }
  /// The points that are taken.
  IntervalSet taken() {
    auto taken = std::make_shared<TakenResults>();
    store_.commit(std::vector<Change>{TakeResults{2, 1, {{0, 0, 10}}, "1.0", taken}});
    return taken->points;
  }
  static IntervalSet all_but_the_third() {
    IntervalSet points(0, 10);
    points.erase(3, 4);
    return points;
  }

  test::TemporaryFolder folder_;
  std::string file_ = folder_.file("copy.db");
  Store store_{file_};
};

TEST_F(ResultCopyTest, SoundRowsAreTaken) {
  EXPECT_EQ(taken(), IntervalSet(0, 10));
}

TEST_F(ResultCopyTest, ARowThatIsNotTheOneThatWasStoredIsNotTaken) {
  edit("UPDATE packed_results SET slide = slide + 1000000 WHERE study_id = 1 AND point = 3");
  EXPECT_EQ(taken(), all_but_the_third());
}

TEST_F(ResultCopyTest, ARowWithoutAChecksumIsNotTaken) {
  edit("UPDATE packed_results SET H = 0.75, checksum = NULL WHERE study_id = 1 AND point = 3");
  EXPECT_EQ(taken(), all_but_the_third());
}

TEST_F(ResultCopyTest, RowsWhoseWordsAreGoneOrOthersAreNotTaken) {
  edit("PRAGMA foreign_keys = OFF; UPDATE texts SET text = text || '?'");
  EXPECT_EQ(taken(), IntervalSet());
  edit("PRAGMA foreign_keys = OFF; DELETE FROM texts");
  EXPECT_EQ(taken(), IntervalSet());
}

TEST_F(ResultCopyTest, RowsOfAWorkerThatIsNotTheOneThatWasStoredAreNotTaken) {
  edit("UPDATE workers SET instruction_set = 'sse9'");
  EXPECT_EQ(taken(), IntervalSet());
}

}  // namespace
}  // namespace oblique::server
