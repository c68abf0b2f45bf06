#include "server/maintenance/backup.h"
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/maintenance/check.h"
#include "server/store/store.h"
#include "tests/server/maintenance/maintenance_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
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

TEST_F(MaintenanceTest, ACopyNeverReplacesAFile) {
  std::ofstream(copy_) << "mine";
  EXPECT_THROW(back_up(path_, copy_), StorageError);
  std::ifstream file(copy_);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "mine");
}

TEST_F(MaintenanceTest, OnlyADatabaseOfOursIsCopied) {
  const std::string other = folder_.file("notes.txt");
  std::ofstream(other) << "not a database, and long enough to be sure of it";
  EXPECT_THROW(back_up(other, copy_), StorageError);
  EXPECT_THROW(back_up(folder_.file("nowhere.db"), copy_), StorageError);
  EXPECT_FALSE(std::filesystem::exists(copy_));
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

  /// Follows the first child of each page, whose number is where the first of the pointers behind
  /// the header of twelve bytes says.
  static std::int64_t first_leaf(const std::string& path, std::int64_t page) {
    constexpr unsigned char kLeaf = 0x0a;
    std::ifstream file(path, std::ios::binary);
    for (std::vector<unsigned char> bytes(kPageBytes);;) {
      file.seekg((page - 1) * kPageBytes);
      file.read(reinterpret_cast<char*>(bytes.data()), kPageBytes);
      if (bytes[0] == kLeaf) {
        return page;
      }
      const std::size_t cell = bytes[12] * 256U + bytes[13];
      page = bytes[cell] * 16777216 + bytes[cell + 1] * 65536 + bytes[cell + 2] * 256 +
             bytes[cell + 3];
    }
  }
};

TEST_F(SalvageTest, WhatCanBeReadOfADamagedDatabaseIsSavedAndTheRestIsPendingAgain) {
  constexpr std::uint64_t kPoints = 400;
  const std::string damaged = folder_.file("damaged.db");
  table_ = table_of(kPoints);
  {
    Store store(damaged);
    add_results(store, 0, kPoints, true);
    store.commit(std::vector<Change>{SetStudyState{1, StudyState::kDone, "now"}});
  }
  const auto stored = rows_of(damaged);
  // One page in the middle, where nearly all pages are rows of results.
  overwrite_page(
      damaged, static_cast<std::int64_t>(std::filesystem::file_size(damaged)) / 2 / kPageBytes + 1);
  EXPECT_FALSE(find_faults(damaged).empty());
  const auto saved = salvage(damaged, copy_);
  EXPECT_EQ(saved.studies, 1U);
  EXPECT_GE(saved.unreadable_places, 1U);
  EXPECT_LT(saved.results, kPoints);
  EXPECT_GT(saved.results, kPoints - 40);
  EXPECT_THAT(find_faults(copy_), IsEmpty());
  EXPECT_THAT(rows_of(copy_), SizeIs(saved.results));
  EXPECT_TRUE(std::ranges::includes(stored, rows_of(copy_)));
  Store copy(copy_);
  const auto studies = copy.studies();
  EXPECT_EQ(studies.at(0).completed.size(), saved.results);
  EXPECT_EQ(studies.at(0).state, StudyState::kRunning);
}

TEST_F(SalvageTest, SalvagingEndsAlsoWhenTheFirstPagesOfATableAreGone) {
  constexpr std::uint64_t kPoints = 400;
  for (const std::string damage : {"root of results", "first rows", "root of models"}) {
    const std::string damaged = folder_.file(damage + ".db");
    table_ = table_of(kPoints);
    {
      Store store(damaged);
      add_results(store, 0, kPoints, true);
    }
    const auto stored = rows_of(damaged);
    std::int64_t page = page_of(damaged, damage == "root of models" ? "models" : "results");
    if (damage == "first rows") {
      page = first_leaf(damaged, page);
    }
    overwrite_page(damaged, page);
    const std::string saved_file = folder_.file(damage + " saved.db");
    const auto saved = salvage(damaged, saved_file);
    EXPECT_GE(saved.unreadable_places, 1U) << damage;
    EXPECT_EQ(saved.results > kPoints - 40, damage == "first rows") << damage << saved.results;
    EXPECT_TRUE(std::ranges::includes(stored, rows_of(saved_file))) << damage;
    EXPECT_THAT(find_faults(saved_file), IsEmpty()) << damage;
  }
}

TEST_F(SalvageTest, AFlippedByteInAListOfARowIsFoundAndTheRowIsNotSalvaged) {
  store_.reset();
  std::ifstream file(path_, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  auto others = rows_of(path_);
  others.erase(others.begin() + 3);
  for (const std::string column : {"peaks", "ft_peaks", "phases", "reaction_peaks"}) {
    std::string text;
    {
      const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
      Statement row(database.get(), "SELECT " + column + " FROM results WHERE point = 3");
      ASSERT_TRUE(row.step());
      text = row.text(0);
    }
    const auto at = bytes.find(text);
    ASSERT_NE(at, std::string::npos) << column;
    std::string damaged = bytes;
    auto& digit = damaged[at + text.find_first_of("123456789")];
    digit = digit == '1' ? '2' : '1';
    const std::string damaged_file = folder_.file(column + ".db");
    std::ofstream(damaged_file, std::ios::binary) << damaged;
    EXPECT_THAT(find_faults(damaged_file), testing::Contains(HasSubstr("point 3"))) << column;
    const std::string saved_file = folder_.file(column + " saved.db");
    EXPECT_EQ(salvage(damaged_file, saved_file).unreadable_places, 1U) << column;
    EXPECT_EQ(rows_of(saved_file), others) << column;
  }
}

TEST_F(SalvageTest, AStudyOrModelWithAFlippedByteIsSavedWithItsRows) {
  store_.reset();
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "UPDATE studies SET created_at = 'x'; UPDATE models SET E = E + 1");
  EXPECT_EQ(salvage(path_, copy_).results, 5U);
  EXPECT_THAT(find_faults(copy_), IsEmpty());
  EXPECT_EQ(Store(copy_).studies().at(0).completed, IntervalSet(0, 5));
}

TEST_F(SalvageTest, ADatabaseWithoutStudiesOrTablesIsNotSalvaged) {
  std::ofstream(folder_.file("empty.db"));
  EXPECT_THROW(salvage(folder_.file("empty.db"), copy_), StorageError);
  EXPECT_THROW(salvage(folder_.file("nowhere.db"), copy_), StorageError);
  EXPECT_FALSE(std::filesystem::exists(copy_));
}

TEST_F(SalvageTest, ASoundDatabaseIsSalvagedWholeAndNothingIsReplaced) {
  store_.reset();
  const auto saved = salvage(path_, copy_);
  EXPECT_EQ(saved.results, 5U);
  EXPECT_EQ(saved.unreadable_places, 0U);
  EXPECT_EQ(rows_of(copy_), rows_of(path_));
  EXPECT_THROW(salvage(path_, copy_), StorageError) << "it exists";
}

TEST_F(SalvageTest, OfATruncatedFileEveryRowThatIsLeftIsSavedAndTheFileStaysAsItIs) {
  constexpr std::uint64_t kPoints = 1500;  // with some more the root of their tree splits
  const std::string whole = folder_.file("whole.db");
  table_ = table_of(kPoints);
  {
    Store store(whole);
    for (std::uint64_t first = 0; first < kPoints; first += 100) {
      add_results(store, first, first + 100, first == 0);
    }
  }
  const auto stored = rows_of(whole);
  const auto size = std::filesystem::file_size(whole);
  // In the middle of a page, at its end, and so that little more than the tables' heads is left.
  for (const std::uintmax_t cut :
       {size / 100 * 99 + 7, size / kPageBytes * 3 / 4 * kPageBytes, size / 6}) {
    const std::string name = std::to_string(cut);
    const std::string truncated = folder_.file(name + ".db");
    const std::string saved_file = folder_.file(name + " saved.db");
    std::filesystem::copy_file(whole, truncated);
    std::filesystem::resize_file(truncated, cut);
    const auto saved = salvage(truncated, saved_file);
    const double share = static_cast<double>(cut) / static_cast<double>(size);
    // Upper pages of the rows' tree lie behind lower ones, which cannot be found without them.
    EXPECT_GE(static_cast<double>(saved.results), (share - 0.2) * kPoints) << cut;
    EXPECT_LT(saved.results, kPoints) << cut;
    EXPECT_GE(saved.unreadable_places, 1U) << cut;
    EXPECT_THAT(rows_of(saved_file), SizeIs(saved.results)) << cut;
    EXPECT_TRUE(std::ranges::includes(stored, rows_of(saved_file))) << cut;
    EXPECT_THAT(find_faults(saved_file), IsEmpty()) << cut;
    EXPECT_EQ(std::filesystem::file_size(truncated), cut);
  }
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
