#include "server/maintenance/backup.h"
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/maintenance/check.h"
#include "server/store/store.h"
#include "tests/server/maintenance/maintenance_fixture.h"

namespace oblique::server {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

TEST_F(MaintenanceTest, ACopyMadeWhileTheDatabaseIsOpenHasAllThatWasCommitted) {
  back_up(path_, copy_);
  add_results(*store_, 5, 10, false);
  Store copy(copy_);
  const auto studies = copy.studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].completed, IntervalSet(0, 5));
  EXPECT_EQ(copy.database_id(), store_->database_id());
  EXPECT_EQ(std::filesystem::status(copy_).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write)
      << "a copy is its owner's alone";
}

TEST_F(MaintenanceTest, OnlyADatabaseOfOursIsCopiedOrSalvagedAndNoFileIsReplaced) {
  const std::string notes = folder_.file("notes.txt");
  std::ofstream(notes) << "not a database, and long enough to be sure of it";
  std::ofstream(folder_.file("empty.db"));
  for (const std::string& other : {notes, folder_.file("nowhere.db"), folder_.file("empty.db")}) {
    EXPECT_THROW(back_up(other, copy_), StorageError) << other;
    EXPECT_THROW(salvage(other, copy_), StorageError) << other;
    EXPECT_FALSE(std::filesystem::exists(copy_)) << other;
  }
  EXPECT_THROW(back_up(path_, notes), StorageError);
  EXPECT_THROW(salvage(path_, notes), StorageError);
  EXPECT_GT(std::filesystem::file_size(notes), 0U);
}

class SalvageTest : public MaintenanceTest {
 protected:
  /// Study, point and, by its checksum, all else of each row, in the order of the texts.
  static std::vector<std::string> rows_of(const std::string& file) {
    const DatabaseHandle database = open_database(file, SQLITE_OPEN_READONLY);
    Statement rows(database.get(),
                   "SELECT printf('%02d/%06d %d', study_id, point, checksum) FROM results"
                   " ORDER BY study_id, point");
    std::vector<std::string> found;
    while (rows.step()) {
      found.push_back(rows.text(0));
    }
    return found;
  }
};

TEST_F(SalvageTest, WhatCanBeReadOfADamagedFileIsSavedAndTheRestIsPendingAgain) {
  constexpr std::uint64_t kPoints = 1500;  // with some more the root of their tree splits
  const std::string whole = folder_.file("whole.db");
  table_ = table_of(kPoints);
  {
    Store store(whole);
    for (std::uint64_t first = 0; first < kPoints; first += 100) {
      add_results(store, first, first + 100, first == 0);
    }
    store.commit(std::vector<Change>{SetStudyState{1, StudyState::kDone, "now"}});
  }
  const auto stored = rows_of(whole);
  const auto size = std::filesystem::file_size(whole);
  const auto cut_to = [](std::uintmax_t bytes) {
    return [bytes](const std::string& file) { std::filesystem::resize_file(file, bytes); };
  };
  const struct {
    const char* what;
    std::function<void(const std::string&)> damage;
    double least_share;  ///< of the rows. Upper pages of a tree are behind lower ones.
  } cases[] = {{"one page of rows",
                [&](const auto& file) {
                  overwrite_page(file, static_cast<std::int64_t>(size) / 2 / kPageBytes + 1);
                },
                0.95},
               {"root of results",
                [](const auto& file) { overwrite_page(file, page_of(file, "results")); }, 0.0},
               {"root of models",
                [](const auto& file) { overwrite_page(file, page_of(file, "models")); }, 0.0},
               {"cut in a page", cut_to(size / 100 * 99 + 7), 0.79},
               {"cut at a page", cut_to(size / kPageBytes * 3 / 4 * kPageBytes), 0.55},
               {"cut to a sixth", cut_to(size / 6), 0.0}};
  for (const auto& [what, damage, least_share] : cases) {
    const std::string damaged = folder_.file(std::string(what) + ".db");
    const std::string saved_file = folder_.file(std::string(what) + " saved.db");
    std::filesystem::copy_file(whole, damaged);
    damage(damaged);
    const auto damaged_size = std::filesystem::file_size(damaged);
    const auto saved = salvage(damaged, saved_file);
    EXPECT_EQ(saved.studies, 1U) << what;
    EXPECT_GE(saved.unreadable_places, 1U) << what;
    EXPECT_GE(static_cast<double>(saved.results), least_share * kPoints) << what;
    EXPECT_LT(saved.results, kPoints) << what;
    EXPECT_THAT(rows_of(saved_file), SizeIs(saved.results)) << what;
    EXPECT_TRUE(std::ranges::includes(stored, rows_of(saved_file))) << what;
    EXPECT_THAT(find_faults(saved_file), IsEmpty()) << what;
    EXPECT_EQ(std::filesystem::file_size(damaged), damaged_size) << what;
    const auto study = Store(saved_file).studies().at(0);
    EXPECT_EQ(study.completed.size(), saved.results) << what;
    EXPECT_EQ(study.state, StudyState::kRunning) << what;
  }
}

TEST_F(SalvageTest, ADamagedRowIsNotSavedButAStudyOrModelWithADamagedValueIsWithItsRows) {
  store_.reset();
  auto others = rows_of(path_);
  others.erase(others.begin() + 3);
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "UPDATE studies SET created_at = 'x'; UPDATE models SET E = E + 1;"
          "UPDATE results SET peaks = replace(peaks, '1', '2') WHERE point = 3");
  EXPECT_EQ(salvage(path_, copy_).unreadable_places, 1U);
  EXPECT_EQ(rows_of(copy_), others);
  EXPECT_THAT(find_faults(copy_), IsEmpty());
}

TEST_F(SalvageTest, ASoundDatabaseIsSalvagedWhole) {
  store_.reset();
  const auto saved = salvage(path_, copy_);
  EXPECT_EQ(saved.results, 5U);
  EXPECT_EQ(saved.unreadable_places, 0U);
  EXPECT_EQ(rows_of(copy_), rows_of(path_));
}

TEST_F(SalvageTest, RowsThatAreOnlyInTheLogAreSavedTooAndTheLogStaysAsItIs) {
  const std::string crashed = folder_.file("crashed.db");
  std::filesystem::copy_file(path_, crashed);
  std::filesystem::copy_file(path_ + "-wal", crashed + "-wal");
  const auto log = std::filesystem::file_size(crashed + "-wal");
  ASSERT_GT(log, 0U);
  EXPECT_EQ(salvage(crashed, copy_).results, 5U);
  EXPECT_EQ(std::filesystem::file_size(crashed + "-wal"), log);
}

TEST_F(SalvageTest, ReusedResultsAreCountedAgainAndPointsThatAFilterLeavesOutAreExaminedAgain) {
  const auto filtered = filtered_table("mu < 0.4");  // points 0 to 3
  const auto outcome = std::make_shared<ReusedResults>();
  store_->commit(std::vector<Change>{
      AddStudy{2, "b", filtered, "now"}, ReuseResults{2, filtered, 0, "0.1", outcome},
      AddResults{2, filtered, 1, "0.1", "avx2", 1, "now", {}, IntervalSet(4, 10)},
      SetStudyState{2, StudyState::kDone, "now"}});
  store_.reset();
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), "DELETE FROM reused_points");
  salvage(path_, copy_);
  EXPECT_THAT(find_faults(copy_), testing::IsEmpty());
  Store saved(copy_);
  const auto study = saved.studies().at(1);
  EXPECT_EQ(study.state, StudyState::kRunning);
  EXPECT_EQ(study.completed, IntervalSet(0, 4));
  EXPECT_EQ(study.left_out, 0U);
  EXPECT_EQ(study.reused, (std::map<std::string, std::uint64_t>{{"a", 4}}));
}

}  // namespace
}  // namespace oblique::server
