#include "server/database_care.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/reader.h"
#include "server/salvage.h"
#include "server/store.h"
#include "tests/server/results.h"
#include "tests/server/scheduler_bench.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// A database with one study of ten points, five of them solved.
class DatabaseCareTest : public testing::Test {
 protected:
  DatabaseCareTest() { add_results(*store_, 0, 5, true); }

  void add_results(Store& store, std::uint64_t first, std::uint64_t end, bool with_study) {
    std::vector<Change> changes;
    if (with_study) {
      changes.emplace_back(AddStudy{1, "a", table_, "2024-01-01T00:00:00.000Z", {}});
      changes.emplace_back(AddWorker{1, "host", 1, "0.1", "avx2", "now"});
    }
    std::vector<protocol::PointResult> results;
    for (std::uint64_t point = first; point < end; ++point) {
      results.push_back(solved_point(point));
    }
    changes.emplace_back(
        AddResults{1, table_, 1, "0.1", "avx2", 1, "2024-01-01T00:00:01.000Z", results});
    store.commit(changes);
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  std::string copy_ = folder_.file("copy.db");
  std::shared_ptr<const protocol::PointTable> table_ = table_of(10);
  std::optional<Store> store_{path_};
};

TEST_F(DatabaseCareTest, ACopyMadeWhileTheDatabaseIsOpenHasAllThatWasCommitted) {
  back_up(path_, copy_);
  add_results(*store_, 5, 10, false);
  Store copy(copy_);
  const auto studies = copy.studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].settled, IntervalSet(0, 5));
  EXPECT_EQ(copy.database_id(), store_->database_id());
}

TEST_F(DatabaseCareTest, ACopyNeverReplacesAFile) {
  std::ofstream(copy_) << "mine";
  EXPECT_THROW(back_up(path_, copy_), StorageError);
  std::ifstream file(copy_);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "mine");
}

TEST_F(DatabaseCareTest, OnlyADatabaseOfOursIsCopied) {
  const std::string other = folder_.file("notes.txt");
  std::ofstream(other) << "not a database, and long enough to be sure of it";
  EXPECT_THROW(back_up(other, copy_), StorageError);
  EXPECT_THROW(back_up(folder_.file("nowhere.db"), copy_), StorageError);
  EXPECT_FALSE(std::filesystem::exists(copy_));
}

TEST_F(DatabaseCareTest, ASoundDatabaseHasNoFaults) {
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

TEST_F(DatabaseCareTest, ADamagedPageIsFoundAndNotCopied) {
  store_.reset();  // all is in the one file now
  {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    const auto size = std::filesystem::file_size(path_);
    const std::string rubbish(4096, '\x5a');
    // Every page but the first, which tells what the file is.
    for (std::uintmax_t at = 4096; at < size; at += 4096) {
      file.seekp(static_cast<std::streamoff>(at));
      file << rubbish;
    }
  }
  bool found = false;
  try {
    found = !find_faults(path_).empty();
  } catch (const StorageError&) {
    found = true;
  }
  EXPECT_TRUE(found);
  EXPECT_THROW(back_up(path_, copy_), StorageError);
  EXPECT_FALSE(std::filesystem::exists(copy_));
}

TEST_F(DatabaseCareTest, WhatCanBeReadOfADamagedDatabaseIsSavedAndTheRestIsPendingAgain) {
  constexpr std::uint64_t kPoints = 400;
  const std::string damaged = folder_.file("damaged.db");
  table_ = table_of(kPoints);
  {
    Store store(damaged);
    add_results(store, 0, kPoints, true);
    store.commit(std::vector<Change>{SetStudyState{1, StudyState::kDone, "now"}});
  }
  {
    // One page in the middle, where nearly all pages are rows of results.
    std::fstream file(damaged, std::ios::in | std::ios::out | std::ios::binary);
    constexpr std::uintmax_t kPage = 4096;
    file.seekp(
        static_cast<std::streamoff>(std::filesystem::file_size(damaged) / 2 / kPage * kPage));
    file << std::string(kPage, '\x5a');
  }
  EXPECT_FALSE(find_faults(damaged).empty());
  const auto saved = salvage(damaged, copy_);
  EXPECT_EQ(saved.studies, 1U);
  EXPECT_GE(saved.unreadable_places, 1U);
  EXPECT_LT(saved.results, kPoints);
  EXPECT_GT(saved.results, kPoints - 40);
  EXPECT_THAT(find_faults(copy_), IsEmpty());
  Store copy(copy_);
  const auto studies = copy.studies();
  EXPECT_EQ(studies.at(0).settled.size(), saved.results);
  EXPECT_EQ(studies.at(0).state, StudyState::kRunning);
}

TEST_F(DatabaseCareTest, SalvagingEndsAlsoWhenTheFirstPagesOfATableAreGone) {
  constexpr std::uint64_t kPoints = 400;
  for (const std::string damage : {"root of results", "first rows", "root of models"}) {
    const std::string damaged = folder_.file(damage + ".db");
    table_ = table_of(kPoints);
    {
      Store store(damaged);
      add_results(store, 0, kPoints, true);
    }
    std::int64_t page = 0;
    {
      const DatabaseHandle database = open_database(damaged, SQLITE_OPEN_READONLY);
      const std::string table = damage == "root of models" ? "models" : "results";
      Statement root(database.get(), "SELECT rootpage FROM sqlite_schema WHERE name = ?");
      root.bind(1, std::string_view(table));
      ASSERT_TRUE(root.step());
      page = root.integer(0);
    }
    std::fstream file(damaged, std::ios::in | std::ios::out | std::ios::binary);
    if (damage == "first rows") {
      // The first child that the root names, behind its header of twelve bytes and pointers.
      std::array<unsigned char, 4096> root{};
      file.seekg((page - 1) * 4096);
      file.read(reinterpret_cast<char*>(root.data()), root.size());
      const std::size_t cell = root[12] * 256U + root[13];
      page = root[cell] * 16777216 + root[cell + 1] * 65536 + root[cell + 2] * 256 + root[cell + 3];
    }
    file.seekp((page - 1) * 4096);
    file << std::string(4096, '\x5a');
    file.close();
    const std::string saved_file = folder_.file(damage + " saved.db");
    const auto saved = salvage(damaged, saved_file);
    EXPECT_GE(saved.unreadable_places, 1U) << damage;
    EXPECT_EQ(saved.results > kPoints - 40, damage == "first rows") << damage << saved.results;
    EXPECT_THAT(find_faults(saved_file), IsEmpty()) << damage;
  }
}

TEST_F(DatabaseCareTest, AFlippedByteInAnyValueOfARowIsFoundAndTheRowIsNotSalvaged) {
  store_.reset();
  std::string bytes;
  {
    std::ifstream file(path_, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(file), {});
  }
  // The row of point 3 begins with the numbers that its columns do, near the end of the file; its
  // texts are found by what they say.
  const auto text_of = [&](const std::string& column) {
    return Reader(path_)
        .query("SELECT " + column + " FROM results WHERE point = 3", kNoLimits)
        .rows(0)
        .values(0)
        .text();
  };
  for (const std::string column : {"peaks", "ft_peaks", "phases", "reaction_peaks"}) {
    const std::string text = text_of(column);
    const auto at = bytes.find(text);
    ASSERT_NE(at, std::string::npos) << column;
    std::string damaged = bytes;
    auto& digit = damaged[at + text.find_first_of("123456789")];
    digit = digit == '1' ? '2' : '1';
    const std::string file = folder_.file(column + ".db");
    std::ofstream(file, std::ios::binary) << damaged;
    EXPECT_THAT(find_faults(file), testing::Contains(HasSubstr("point 3"))) << column;
    const auto saved = salvage(file, folder_.file(column + " saved.db"));
    EXPECT_EQ(saved.results, 4U) << column;
    EXPECT_EQ(saved.unreadable_places, 1U) << column;
  }
}

TEST_F(DatabaseCareTest, EveryColumnOfAResultIsUnderItsChecksum) {
  store_.reset();
  std::vector<std::string> columns;
  {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement names(database.get(),
                    "SELECT name FROM pragma_table_info('results') WHERE name <> 'checksum'");
    while (names.step()) {
      columns.push_back(names.text(0));
    }
  }
  EXPECT_GT(columns.size(), 40U);
  for (const std::string& column : columns) {
    const std::string copy = folder_.file(column + ".db");
    std::filesystem::copy_file(path_, copy);
    {
      const DatabaseHandle database = open_database(copy, SQLITE_OPEN_READWRITE);
      execute(database.get(), "PRAGMA ignore_check_constraints = ON");
      execute(database.get(), "UPDATE results SET " + column + " = CASE typeof(" + column +
                                  ") WHEN 'text' THEN " + column + " || ' ' WHEN 'null' THEN 1" +
                                  " ELSE " + column + " + 1 END WHERE point = 4");
    }
    EXPECT_THAT(find_faults(copy), testing::Contains(HasSubstr("not the one that was stored")))
        << column;
  }
}

TEST_F(DatabaseCareTest, AStudyThatWasChangedIsFound) {
  store_.reset();
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), "UPDATE studies SET name = 'b'");
  EXPECT_THAT(find_faults(path_), testing::Contains(HasSubstr("study 1, b")));
}

TEST_F(DatabaseCareTest, ADatabaseWithoutStudiesOrTablesIsNotSalvaged) {
  std::ofstream(folder_.file("empty.db"));
  EXPECT_THROW(salvage(folder_.file("empty.db"), copy_), StorageError);
  EXPECT_THROW(salvage(folder_.file("nowhere.db"), copy_), StorageError);
  EXPECT_FALSE(std::filesystem::exists(copy_));
}

TEST_F(DatabaseCareTest, ASoundDatabaseIsSalvagedWhole) {
  store_.reset();
  const auto saved = salvage(path_, copy_);
  EXPECT_EQ(saved.results, 5U);
  EXPECT_EQ(saved.unreadable_places, 0U);
  EXPECT_THROW(salvage(path_, copy_), StorageError) << "it exists";
}

TEST_F(DatabaseCareTest, ADamagedDatabaseIsRefusedWithTheWayOut) {
  store_.reset();
  const auto page_of = [&](const std::string& name) {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement root(database.get(), "SELECT rootpage FROM sqlite_schema WHERE name = ?");
    root.bind(1, std::string_view(name));
    root.step();
    return root.integer(0);
  };
  const std::int64_t page = page_of("studies");
  {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp((page - 1) * 4096);
    file << std::string(4096, '\x5a');
  }
  try {
    Store store(path_);
    (void)store.studies();
    FAIL() << "a damaged database was opened";
  } catch (const StorageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--salvage"));
  }
}

TEST_F(DatabaseCareTest, ARowOfAPointThatTheStudyDoesNotHaveIsNamed) {
  store_.reset();
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
  execute(database.get(), "UPDATE results SET point = 77 WHERE point = 4");
  EXPECT_THAT(find_faults(path_), testing::Contains(HasSubstr("study a")));
}

TEST_F(DatabaseCareTest, StartsOfServersAreCountedSoThatNoLeaseNumberComesTwice) {
  EXPECT_EQ(store_->count_start(), 1U);
  store_.reset();
  EXPECT_EQ(Store(path_).count_start(), 2U);
}

}  // namespace
}  // namespace oblique::server
