// Tests of copies, salvage, checks, and changes of studies without a server.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/model_message.h"
#include "server/maintenance/backup.h"
#include "server/maintenance/check.h"
#include "server/maintenance/merge.h"
#include "server/maintenance/study_changes_offline.h"
#include "server/store/result_rows.h"
#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

constexpr std::int64_t kPageBytes = 8192;

/// Overwrites a page with bytes that SQLite cannot read.
void overwrite_page(const std::string& path, std::int64_t page) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp((page - 1) * kPageBytes);
  file << std::string(kPageBytes, '\x5a');
}

/// Provides a database with one study of ten points, of which five are solved.
class MaintenanceTest : public StoreFixture {
 protected:
  MaintenanceTest() { commit({study_, worker(1), solved(study_, numbers(0, 5))}); }

  /// Returns the number of a table's root page.
  static std::int64_t page_of(const std::string& path, const std::string& table) {
    return std::stoll(
        rows(path, "SELECT rootpage FROM sqlite_schema WHERE name = '" + table + "'").at(0));
  }

  std::string copy_ = folder_.file("copy.db");
  const AddStudy study_ = [] {
    AddStudy study = study_of(10);
    study.uid = "abc";
    return study;
  }();
};

TEST_F(MaintenanceTest, ACopyOfAnOpenDatabaseHasAllCommittedRows) {
  back_up(path_, copy_);
  commit({solved(study_, numbers(5, 10))});
  Store copy(copy_);
  const auto studies = copy.studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].completed, IntervalSet(0, 5));
  EXPECT_NE(copy.database_id(), store().database_id());
  EXPECT_EQ(studies[0].uid, study_.uid);
  EXPECT_EQ(std::filesystem::status(copy_).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write)
      << "only the owner may read and write a copy";
}

TEST_F(MaintenanceTest, OnlyObliqueDatabasesAreCopiedOrSalvagedAndNoFileIsReplaced) {
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
  /// Returns "STUDY/POINT CHECKSUM" of each row, in ascending order.
  static std::vector<std::string> rows_of(const std::string& file) {
    return rows(file,
                "SELECT printf('%02d/%06d %d', study_id, point, checksum) FROM results"
                " ORDER BY study_id, point");
  }
};

TEST_F(SalvageTest, ReadableRowsOfADamagedFileAreSavedAndTheOtherPointsAreOpen) {
  constexpr std::uint64_t kPoints = 1500;  // more points would split the root page of the B-tree
  const std::string whole = folder_.file("whole.db");
  const auto large = study_of(kPoints);
  Store(whole).commit(std::vector<Change>{large, worker(1), solved(large, numbers(0, kPoints)),
                                          SetStudyState{1, StudyState::kDone, "now"}});
  const auto stored = rows_of(whole);
  const auto size = std::filesystem::file_size(whole);
  const auto cut_to = [](std::uintmax_t bytes) {
    return [bytes](const std::string& file) { std::filesystem::resize_file(file, bytes); };
  };
  const struct {
    const char* what;
    std::function<void(const std::string&)> damage;
    double least_share;  ///< minimum share of saved rows
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
    EXPECT_THAT(faults(saved_file), IsEmpty()) << what;
    EXPECT_EQ(std::filesystem::file_size(damaged), damaged_size) << what;
    const auto study = Store(saved_file).studies().at(0);
    EXPECT_EQ(study.completed.size(), saved.results) << what;
    EXPECT_EQ(study.state, StudyState::kRunning) << what;
  }
}

TEST_F(SalvageTest, DamagedResultsAreSkippedButStudiesAndModelsWithADamagedValueAreSaved) {
  close();
  auto others = rows_of(path_);
  others.erase(others.begin() + 3);
  execute_sql(
      "UPDATE studies SET created_at = 'x'; UPDATE models SET E = E + 1;"
      "UPDATE results SET peaks = replace(peaks, '1', '2') WHERE point = 3");
  EXPECT_EQ(salvage(path_, copy_).unreadable_places, 1U);
  EXPECT_EQ(rows_of(copy_), others);
  EXPECT_THAT(faults(copy_), IsEmpty());
}

TEST_F(SalvageTest, AStudyWhoseRecipeModelOrWorkerIsDamagedIsKeptUnderAnotherNameAndPaused) {
  const auto other =
      table(protocol::recipe_of({{protocol::listed("k", {3e7}), protocol::listed("H", {1.0}),
                                  protocol::listed("mu", {0.5}), protocol::listed("e", {1.0})}}));
  commit({study_of(other, 2, "b"), worker(2), solved(study_of(other, 2), {0}, 2)});
  close();
  const std::string sound = folder_.file("sound.db");
  std::filesystem::copy_file(path_, sound);
  for (const char* damage : {"UPDATE studies SET recipe = CAST(substr(recipe, 1, 3) || x'01' AS "
                             "BLOB) WHERE study_id = 2",
                             "UPDATE models SET E = E + 1 WHERE model_id = 2",
                             "UPDATE workers SET solver_version = '0.3' WHERE worker_id = 2"}) {
    execute_sql(damage);
    EXPECT_THAT(faults(), Not(IsEmpty())) << damage;
    EXPECT_THAT(salvage(path_, copy_).losses,
                Contains(HasSubstr("study 2, b: its recipe, a model or a worker was changed")))
        << damage;
    EXPECT_NO_THROW(Store(copy_).studies()) << damage;  // a server starts
    EXPECT_THAT(rows(copy_, "SELECT name || ' ' || state FROM studies"),
                ElementsAre("a running", testing::StartsWith("damaged study 2 ")));
    EXPECT_EQ(rows_of(copy_), rows_of(path_)) << damage;
    std::filesystem::remove(copy_);
    std::filesystem::copy_file(sound, path_, std::filesystem::copy_options::overwrite_existing);
  }
}

TEST_F(SalvageTest, ResultsThatAreLostWithTheirStudyOrModelAreNamed) {
  close();
  execute_sql("UPDATE models SET model_id = 7");
  EXPECT_THAT(salvage(path_, copy_).losses,
              Contains(testing::EndsWith("results are lost, because their model is")));
  std::filesystem::remove(copy_);
  execute_sql("DELETE FROM studies");
  EXPECT_THAT(salvage(path_, copy_).losses,
              Contains(HasSubstr("study 1 is lost, with all its results")));
}

TEST_F(SalvageTest, AnUnknownVersionOfTheFormatIsAFault) {
  close();
  std::fstream(path_, std::ios::in | std::ios::out | std::ios::binary).seekp(18).put(18);
  EXPECT_THAT(faults(), ElementsAre(HasSubstr("bytes 18 and 19")));
}

TEST_F(SalvageTest, DamagedDefinitionsCostNoRowAndMixUpNoColumn) {
  close();
  const std::string sound = folder_.file("sound.db");
  std::filesystem::copy_file(path_, sound);
  const std::string values = "SELECT major_peak_3_N || slide_m || closure FROM results";
  const auto expected = rows(values);
  for (const auto& [name, from, to] :
       {std::tuple{"results", "major_peak_3_N", "major_peak_3_M"},  // another name
        {"results", "slide_m REAL", "slide_n REAL"},
        {"results", "wall_s REAL", "wall_s REAM"},
        {"results", "CREATE TABLE", "CREATE TABLG"},
        {"results", "TABLE results", "TABLE resultr"},
        {"studies", "name  ", "nime  "},
        {"runs", "SELECT", "SELEBT"},
        {"failed_points", "WHERE", "WHESE"},
        {"row_deleted", "UPDATE", "UPDATD"}}) {
    execute_sql(
        fmt::format("PRAGMA writable_schema = ON; UPDATE sqlite_schema SET"
                    " sql = replace(sql, '{1}', '{2}') WHERE name = '{0}'",
                    name, from, to));
    const Salvaged saved = salvage(path_, copy_);
    EXPECT_EQ(saved.results, 5U) << to;
    EXPECT_THAT(saved.losses, IsEmpty()) << to;
    EXPECT_EQ(rows(copy_, values), expected) << to;
    EXPECT_EQ(rows(copy_, "SELECT name FROM studies").at(0), "a") << to;
    EXPECT_THAT(faults(copy_), IsEmpty()) << to;
    std::filesystem::remove(copy_);
    std::filesystem::copy_file(sound, path_, std::filesystem::copy_options::overwrite_existing);
  }
}

TEST_F(MaintenanceTest, ACopyOfDamagedContentsIsMadeAndItsFaultsAreReturned) {
  EXPECT_THAT(back_up(path_, copy_), IsEmpty());
  close();
  execute_sql("UPDATE results SET mu = mu + 0.1 WHERE point = 2; UPDATE workers SET threads = 7");
  const auto expected = faults();
  ASSERT_THAT(expected, SizeIs(2));
  EXPECT_EQ(back_up(path_, folder_.file("second.db")), expected);
  execute_sql(
      "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET"
      " sql = replace(sql, 'm.E AS', 'm.A AS') WHERE name = 'runs'");
  EXPECT_THROW(back_up(path_, folder_.file("third.db")), StorageError);
  EXPECT_FALSE(std::filesystem::exists(folder_.file("third.db")));
}

TEST_F(SalvageTest, ASoundDatabaseIsSalvagedCompletelyAndNotChanged) {
  const std::string crashed = folder_.file("crashed.db");
  std::filesystem::copy_file(path_, crashed);
  std::filesystem::copy_file(path_ + "-wal", crashed + "-wal");
  const auto log = std::filesystem::file_size(crashed + "-wal");
  ASSERT_GT(log, 0U);
  const auto saved = salvage(crashed, copy_);
  EXPECT_EQ(saved.results, 5U);
  EXPECT_EQ(saved.unreadable_places, 0U);
  EXPECT_EQ(rows_of(copy_), rows_of(path_));
  EXPECT_EQ(std::filesystem::file_size(crashed + "-wal"), log);
}

TEST_F(SalvageTest, ATableThatLostAColumnIsSavedWithoutItUnlessItsRowsNeedTheColumn) {
  close();
  execute_sql(
      "ALTER TABLE studies DROP COLUMN reuses; DROP VIEW runs;"
      "ALTER TABLE results DROP COLUMN margin");
  const auto without_columns = salvage(path_, copy_);
  EXPECT_EQ(without_columns.results, 5U);
  EXPECT_THAT(without_columns.losses, ElementsAre("the table results has lost the columns margin",
                                                  "the table studies has lost the columns reuses"));
  EXPECT_THAT(faults(copy_), IsEmpty());
  std::filesystem::remove(copy_);
  execute_sql("ALTER TABLE results DROP COLUMN slide_m");
  const auto saved = salvage(path_, copy_);
  EXPECT_EQ(saved.studies, 1U);
  EXPECT_EQ(saved.unreadable_places, 5U) << "a solved point has a slide";
  EXPECT_THAT(faults(copy_), IsEmpty());
}

TEST_F(SalvageTest, ReusedResultsAreCountedAgainAndPointsThatAFilterLeavesOutAreExaminedAgain) {
  const auto filtered = filtered_table("mu < 0.4");  // keeps points 0 to 3
  const auto outcome = std::make_shared<ReusedResults>();
  commit({study_of(filtered, 2, "b"), ReuseResults{2, filtered, 0, "0.1", outcome},
          AddResults{2, filtered, 1, "0.1", "avx2", 1, "now", {}, IntervalSet(4, 10)},
          SetStudyState{2, StudyState::kDone, "now"}});
  close();
  execute_sql("DELETE FROM reused_points");
  salvage(path_, copy_);
  EXPECT_THAT(faults(copy_), testing::IsEmpty());
  Store saved(copy_);
  const auto study = saved.studies().at(1);
  EXPECT_EQ(study.state, StudyState::kRunning);
  EXPECT_EQ(study.completed, IntervalSet(0, 4));
  EXPECT_EQ(study.left_out, 0U);
  EXPECT_EQ(study.reused, (std::map<std::string, std::uint64_t>{{"a", 4}}));
}

// ---- Checks -------------------------------------------------------------------------------------

TEST_F(MaintenanceTest, InputsThatDifferInTheLastBitsAreNoFault) {
  protocol::PointResult result = solved_point(5, *study_.table.get());
  result.set_mu(std::nextafter(result.mu(), 1.0));
  commit({results_of(study_, {result})});
  EXPECT_THAT(faults(), IsEmpty());
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
  Statement row(database.get(), "SELECT mu FROM results WHERE point = 5");
  ASSERT_TRUE(row.step());
  EXPECT_EQ(row.real(0), result.mu()) << "the row keeps the value that was solved";
}

TEST_F(MaintenanceTest, ADamagedPageIsFoundAndNotCopiedAndTheErrorHasTheRemedy) {
  close();  // moves all rows from the log to the database file
  overwrite_page(path_, page_of(path_, "studies"));
  EXPECT_FALSE(faults().empty());
  EXPECT_THROW(back_up(path_, copy_), StorageError);
  EXPECT_FALSE(std::filesystem::exists(copy_));
  EXPECT_THAT(refusal(), HasSubstr("--salvage"));
}

TEST_F(MaintenanceTest, TheChecksumCoversEveryColumnOfAResult) {
  close();
  std::filesystem::copy_file(path_, copy_);
  for (const std::string_view column : result_columns()) {
    execute_sql(
        fmt::format("UPDATE results SET {0} = CASE typeof({0}) WHEN 'text' THEN {0} || ' '"
                    " WHEN 'null' THEN 1 ELSE {0} + 1 END WHERE point = 4",
                    column));
    EXPECT_THAT(faults(), Contains(HasSubstr(column == "study_id" ? "refers to study number 2"
                                                                  : "changed after it was stored")))
        << column;
    std::filesystem::copy_file(copy_, path_, std::filesystem::copy_options::overwrite_existing);
  }
}

TEST_F(MaintenanceTest, ChangedStudiesAndModelsAndDanglingReferencesAreFound) {
  close();
  execute_sql(
      "UPDATE studies SET created_at = 'b'; UPDATE models SET E = E + 1;"
      "INSERT INTO reused_points VALUES (7, 'b', 1)");
  EXPECT_THAT(faults(),
              ElementsAre("table reused_points: refers to study number 7, which does not exist",
                          "model 1: it was changed after it was stored", HasSubstr("study 1, a")));
}

TEST_F(MaintenanceTest, UnfinishedStudiesOfASoundDatabaseAreNamed) {
  const auto found = diagnose(path_);
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_THAT(found.remarks, ElementsAre("study a is running: 5 of 10 points have a result"));
  commit({solved(study_, numbers(5, 10))});
  EXPECT_THAT(diagnose(path_).remarks, IsEmpty());
}

TEST_F(MaintenanceTest, EveryTableThatIsMissingOrHasOtherColumnsOrIsAViewIsNamed) {
  close();
  for (const std::string table : {"about", "studies", "models", "workers", "results",
                                  "completed_ranges", "reused_points", "deletions"}) {
    for (const char* change :
         {"DROP TABLE {0}", "ALTER TABLE {0} ADD COLUMN note BLOB AS (zeroblob(1000000))",
          "DROP TABLE {0}; CREATE VIEW {0} AS WITH RECURSIVE n(i) AS"
          " (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS study_id FROM n WHERE i < 0"}) {
      std::filesystem::copy_file(path_, copy_, std::filesystem::copy_options::overwrite_existing);
      execute_sql(copy_, fmt::format(fmt::runtime(change), table));
      EXPECT_THAT(faults(copy_), ElementsAre(HasSubstr("the table " + table + " is")));
      EXPECT_THROW(Store{copy_}, StorageError) << change << " of " << table;
    }
  }
}

TEST_F(MaintenanceTest, CompletedPointsThatDifferFromTheRowsAreNamedWithTheRemedy) {
  close();
  for (const char* change :
       {"UPDATE completed_ranges SET points = 6", "UPDATE completed_ranges SET points = 4",
        "UPDATE completed_ranges SET first_point = 1"}) {
    execute_sql(change);
    EXPECT_THAT(faults(), Contains(HasSubstr("UPDATE studies SET counted = 0"))) << change;
  }
  execute_sql("UPDATE completed_ranges SET first_point = 0, points = 5");
  execute_sql("UPDATE studies SET state = 'done'");
  EXPECT_THAT(faults(), ElementsAre("study a is done: 5 of 10 points have a result"));
}

TEST_F(MaintenanceTest, ADoneStudyWithRowsDeletedByHandIsSound) {
  commit({solved(study_, numbers(5, 10))});
  close();
  execute_sql("UPDATE studies SET state = 'done'; DELETE FROM results WHERE point > 6");
  EXPECT_THAT(faults(), IsEmpty());
  EXPECT_THAT(diagnose(path_).remarks, Contains("study a is done: 7 of 10 points have a result"));
}

/// Provides a database with three completed points, of which point 2 has failed. The rows have no
/// checksums.
class RowFaultsTest : public StoreFixture {
 protected:
  RowFaultsTest() {
    const auto study = study_of(5);
    commit({study, worker(1), solved(study, {0, 1}), failed(study, {2})});
    close();
    execute_sql("UPDATE results SET checksum = NULL; UPDATE studies SET checksum = NULL");
  }
};

TEST_F(RowFaultsTest, ARowWithoutAChecksumIsComparedWithTheRecipe) {
  const std::vector<std::pair<std::string, std::string>> damages{
      {"point = 77", "point 77: the study has no such point"},
      {"H = 1.000000000002", "H is 1.000000000002"},
      {"mu = mu + 0.125", "mu is"},
      {"e = 0.5", "e is"},
      {"peaks = replace(peaks, ']', '')", "one of its lists cannot be read"},
      {"phases = '[inf]'", "one of its lists cannot be read"},
      {"impulse_n_Ns = NULL", "outputs are missing"},
      {"error = 'none'", "point 1: it failed, but has outputs"},
      {"model_id = 7", "point 1: its model does not exist"},
      {"worker_id = 7", "point 1: its worker does not exist"}};
  const std::string columns = fmt::format("{}", fmt::join(result_columns(), ", "));
  EXPECT_THAT(faults(), IsEmpty());
  EXPECT_THAT(diagnose(path_).remarks, Contains(HasSubstr("3 of 3 results have no checksum")));
  for (const auto& [change, expected] : damages) {
    execute_sql("CREATE TABLE before AS SELECT " + columns + " FROM results WHERE point = 1");
    execute_sql("UPDATE results SET " + change + " WHERE point = 1");
    EXPECT_THAT(faults(), Contains(HasSubstr(expected))) << change;
    execute_sql("DELETE FROM results WHERE point IN (1, 77); INSERT INTO results (" + columns +
                ") SELECT * FROM before; DROP TABLE before");
  }
}

TEST_F(RowFaultsTest, AModelThatDiffersFromTheRecipeIsNamed) {
  solver::ModelParameters other = solver::preset("paper");
  other.E_Pa += 1.0;
  execute_with(open_database(path_, SQLITE_OPEN_READWRITE).get(),
               "UPDATE models SET definition = ?, checksum = NULL",
               protocol::canonical_model(other));
  EXPECT_THAT(faults(), Contains(HasSubstr("point 0: its model differs")));
}

TEST_F(RowFaultsTest, ARecipeThatCannotBeReadOrHasOtherPointsIsNamed) {
  execute_sql("UPDATE studies SET points = 6");
  EXPECT_THAT(faults(), Contains(HasSubstr("it has 5 points, and the study 6")));
  execute_sql("UPDATE studies SET points = 5, recipe = x'ff'");
  EXPECT_THAT(faults(), Contains(HasSubstr("its recipe cannot be read")));
}

TEST_F(RowFaultsTest, AStudyThatWouldPreventAStartIsNamed) {
  execute_sql("CREATE TABLE before AS SELECT * FROM studies");
  for (const char* change : {"points = 1000000000000000000", "points = -1",
                             "priority = 9223372036854775807", "name = ''", "name = char(27)",
                             "name = hex(zeroblob(1000))", "created_at = hex(zeroblob(1000))"}) {
    execute_sql(std::string("PRAGMA ignore_check_constraints = ON; UPDATE studies SET ") + change);
    EXPECT_THAT(faults(), Contains(HasSubstr("study 1, "))) << change;
    execute_sql("DELETE FROM studies; INSERT INTO studies SELECT * FROM before");
  }
}

// ---- Changes without a server -------------------------------------------------------------------

class OfflineStudyTest : public MaintenanceTest {
 protected:
  std::string refusal_of_renaming(std::uint64_t study, const std::string& name) {
    try {
      rename_study(path_, study, name);
    } catch (const StudyRefused& error) {
      return error.what();
    }
    return "it was renamed";
  }
};

TEST_F(OfflineStudyTest, AStudyIsRenamedUnlessTheNameIsInUseOrInvalid) {
  commit({study_of(10, 2, "b")});
  EXPECT_THROW(rename_study(path_, 1, "c"), StorageError) << "a server uses the database";
  EXPECT_THROW(delete_study(path_, 1), StorageError);
  EXPECT_THROW(rename_study(copy_, 1, "c"), StorageError) << "the database does not exist";
  EXPECT_FALSE(std::filesystem::exists(copy_));
  close();
  rename_study(path_, 1, "friction");
  EXPECT_EQ(Store(path_).studies().at(0).name, "friction");
  EXPECT_THAT(refusal_of_renaming(1, "b"), HasSubstr("already has a study called \"b\""));
  EXPECT_THAT(refusal_of_renaming(1, ""), HasSubstr("name"));
  EXPECT_THAT(refusal_of_renaming(7, "c"), HasSubstr("is not in"));
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(OfflineStudyTest, ADeletedStudyLeavesNothingBehind) {
  commit({solved(study_, numbers(5, 10))});
  close();
  EXPECT_TRUE(delete_study(path_, 1));
  { const Store next(path_); }  // opening the database deletes rows of deleted studies
  for (const char* table :
       {"studies", "models", "workers", "results", "completed_ranges", "deletions"}) {
    EXPECT_EQ(number(std::string("SELECT count(*) FROM ") + table), 0) << table;
  }
  EXPECT_THROW(delete_study(path_, 1), StudyRefused);
}

TEST_F(OfflineStudyTest, TheStoredRecipeCanBeReadWhileAServerWorks) {
  EXPECT_EQ(stored_recipe(path_, 1).SerializeAsString(),
            study_.table->recipe().SerializeAsString());
  EXPECT_THROW(stored_recipe(path_, 2), StudyRefused);
}

TEST_F(OfflineStudyTest, ATooLongRecipeIsNotParsed) {
  close();
  const std::string block =
      study_.table->recipe().SerializeAsString();  // copies in a row are also a valid recipe
  std::string bytes;
  while (bytes.size() <= protocol::kMaxFrameBytes) {
    bytes += block;
  }
  {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    execute_with(database.get(), "UPDATE studies SET recipe = ?", Blob{bytes});
  }
  EXPECT_THROW(stored_recipe(path_, 1), StorageError);
  EXPECT_THAT(faults(), testing::Contains(HasSubstr("damaged or too many")));
}

TEST_F(OfflineStudyTest, RemainingRowsOfADeletedStudyAreNeitherFaultsNorMerged) {
  commit({study_of(10, 2, "b"), DeleteStudy{1}});
  close();
  const Diagnosis found = diagnose(path_);
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_THAT(found.remarks.at(0), HasSubstr("5 results of deleted studies are left"));
  Merger merger(copy_);
  const Merged merged = merger.merge(path_);
  EXPECT_EQ(merged.studies_added, 1U);
  EXPECT_EQ(merged.results_added, 0U);
}

// ---- Files written by another version of the program --------------------------------------------

TEST_F(MaintenanceTest, AFileOfAnotherSchemaIsRefusedWithBothNumbersAndTheRemedy) {
  const std::vector<std::pair<std::string, std::function<void()>>> openers{
      {"server", [&] { const Store store(path_); }},
      {"backup", [&] { back_up(path_, copy_); }},
      {"salvage", [&] { salvage(path_, copy_); }},
      {"check", [&] { diagnose(path_); }},
      {"merge from it", [&] { Merger(copy_).merge(path_); }},
      {"merge into it", [&] { const Merger merger(path_); }},
      {"describe", [&] { stored_recipe(path_, 1); }},
      {"rename", [&] { rename_study(path_, 1, "b"); }}};
  const auto contents = [&] {
    std::ifstream file(path_, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  close();
  for (const auto& [schema, written_by] :
       {std::pair{kSchemaVersion - 1, "older"}, std::pair{kSchemaVersion + 1, "newer"}}) {
    execute_sql(fmt::format("PRAGMA user_version = {}; PRAGMA journal_mode = DELETE", schema));
    const std::string before = contents();
    for (const auto& [name, open] : openers) {
      EXPECT_THAT(open, testing::ThrowsMessage<StorageError>(fmt::format(
                            "{} has schema {}, and this version of oblique has schema {}: export "
                            "its results with the {} version that wrote it (oblique query STUDY "
                            "--db FILE --format csv), or solve its studies again into a new file",
                            path_, schema, kSchemaVersion, written_by)))
          << name;
      std::filesystem::remove(copy_);
    }
    EXPECT_EQ(contents(), before);
  }
}

}  // namespace
}  // namespace oblique::server
