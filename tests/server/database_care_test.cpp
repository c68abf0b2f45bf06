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

/// A database as an earlier version of the schema had it.
class OldDatabaseTest : public testing::TestWithParam<int> {
 protected:
  OldDatabaseTest() {
    const std::string version = std::to_string(GetParam());
    std::ifstream schema(OBLIQUE_OLD_SCHEMAS "/schema_" + version + ".sql");
    const std::string sql(std::istreambuf_iterator<char>(schema), {});
    const DatabaseHandle database =
        open_database(path_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    execute(database.get(), sql);
    execute(database.get(), "PRAGMA application_id = " + std::to_string(kApplicationId));
    execute(database.get(), "PRAGMA user_version = " + version);
    execute(database.get(), "INSERT INTO about (database_id) VALUES ('old')");
    const bool has_share = GetParam() >= 2;
    Statement insert(database.get(),
                     "INSERT INTO studies (study_id, name, recipe, points, state, created_at,"
                     " changed_at" +
                         std::string(has_share ? ", priority, weight" : "") +
                         ") VALUES (3, 'old study', ?, 10, 'cancelled', 'then', 'later'" +
                         (has_share ? ", 0, 1)" : ")"));
    insert.bind_blob(1, table_of(10)->recipe().SerializeAsString());
    insert.run();
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.file("old.db");
};

TEST_P(OldDatabaseTest, IsBroughtToThePresentSchemaAndKeepsItsStudies) {
  Store store(path_);
  EXPECT_EQ(store.database_id(), "old");
  const auto studies = store.studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].name, "old study");
  EXPECT_EQ(studies[0].state, StudyState::kCancelled);
  EXPECT_EQ(studies[0].share, StudyShare{});
  store.commit(std::vector<Change>{SetStudyState{3, StudyState::kPaused, "now"}});
  EXPECT_EQ(store.studies()[0].state, StudyState::kPaused);
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

TEST_P(OldDatabaseTest, HasTheColumnsAndViewsOfANewOneAfterwards) {
  const std::string fresh = folder_.file("new.db");
  { const Store store(path_); }
  { const Store store(fresh); }
  const auto layout = [](const std::string& path) {
    const DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
    Statement columns(database.get(),
                      "SELECT t.name || ' ' || c.name || ' ' || c.type || c.\"notnull\" || c.pk"
                      " FROM sqlite_schema AS t, pragma_table_info(t.name) AS c"
                      " WHERE t.type IN ('table', 'view') ORDER BY t.name, c.cid");
    std::vector<std::string> found;
    while (columns.step()) {
      found.push_back(columns.text(0));
    }
    return found;
  };
  EXPECT_EQ(layout(path_), layout(fresh));
}

TEST_P(OldDatabaseTest, CanBeReadAsItIs) {
  Reader reader(path_);
  EXPECT_EQ(reader.query("SELECT name FROM studies", kNoLimits).rows_size(), 1);
  EXPECT_EQ(reader.study_status("old study").at(0).weight(), 1.0);
}

INSTANTIATE_TEST_SUITE_P(EveryEarlierSchema, OldDatabaseTest,
                         testing::Range(1, static_cast<int>(kSchemaVersion)));

TEST_F(DatabaseCareTest, StartsOfServersAreCountedSoThatNoLeaseNumberComesTwice) {
  EXPECT_EQ(store_->count_start(), 1U);
  store_.reset();
  EXPECT_EQ(Store(path_).count_start(), 2U);
}

}  // namespace
}  // namespace oblique::server
