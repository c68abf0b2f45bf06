#include "server/store/store.h"

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <sys/stat.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

using StoreTest = StoreFixture;

TEST_F(StoreTest, CommittedRowsSurviveReopening) {
  auto study = study_of(10);
  study.submitted_by = "alice";
  study.uid = "abc";
  commit({study, worker(1), solved(study, {0, 1, 5}), failed(study, {7})});
  const std::string identity = store().database_id();
  close();
  const auto studies = store().studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].name, "a");
  EXPECT_EQ(studies[0].table->recipe().SerializeAsString(),
            study.table->recipe().SerializeAsString());
  IntervalSet completed(0, 2);
  completed.insert(5);
  completed.insert(7);
  EXPECT_EQ(studies[0].completed, completed);
  EXPECT_EQ(studies[0].failures, IntervalSet(7, 8));
  EXPECT_EQ(studies[0].state, StudyState::kRunning);
  EXPECT_EQ(studies[0].solver_version, "0.1");
  EXPECT_EQ(studies[0].submitted_by, "alice");
  EXPECT_EQ(studies[0].uid, "abc");
  EXPECT_EQ(store().last_study_id(), 1U);
  EXPECT_EQ(store().last_worker_id(), 1U);
  EXPECT_EQ(store().database_id(), identity);
}

TEST_F(StoreTest, AnInterruptEndsALongStatement) {
  const auto study = study_of(100);
  commit({study, worker(1)});
  store().interrupt();
  EXPECT_THAT([&] { commit({solved(study, numbers(0, 100))}); },
              testing::ThrowsMessage<StorageError>(HasSubstr("interrupted")));
}

TEST_F(StoreTest, AnEmptyDatabaseHasAnIdAndCountsStarts) {
  EXPECT_THAT(store().studies(), IsEmpty());
  EXPECT_EQ(store().last_study_id(), 0U);
  EXPECT_EQ(store().last_worker_id(), 0U);
  EXPECT_EQ(store().count_start(), 1U);
  EXPECT_NE(store().database_id(), Store(folder_.file("other.db")).database_id());
  close();
  EXPECT_EQ(store().count_start(), 2U);
}

TEST_F(StoreTest, ASecondResultOfAPointDoesNotReplaceTheFirst) {
  const auto study = study_of(3);
  commit({study, worker(1), solved(study, {1})});
  auto other = solved_point(1);
  other.set_texts(0, "sC");
  commit({results_of(study, {other, protocol::failed_point(1, "late")})});
  EXPECT_THAT(rows("SELECT mode, status FROM results"), ElementsAre("SC SR sR|solved"));
}

TEST_F(StoreTest, AFailedTransactionKeepsNothing) {
  const auto study = study_of(3);
  EXPECT_THROW(commit({study, study_of(3, 2, "a")}), StorageError);
  EXPECT_THAT(store().studies(), IsEmpty());
  commit({study, worker(1)});
  EXPECT_THROW(commit({solved(study, {0}), study_of(3, 2, "a")}), StorageError);
  commit({solved(study, {0})});
  EXPECT_EQ(store().studies().at(0).completed.size(), 1U);
  EXPECT_THAT(rows("SELECT 1 FROM results JOIN models USING (model_id)"), ElementsAre("1"))
      << "the model was rolled back and is stored again";
}

TEST_F(StoreTest, TheStateOfAStudyIsKept) {
  for (const StudyState state : {StudyState::kCancelled, StudyState::kPaused, StudyState::kDone}) {
    const auto id = static_cast<std::uint64_t>(state) + 1;
    commit({study_of(3, id, state_name(state)), SetStudyState{id, state, "later"}});
  }
  close();
  const auto studies = store().studies();
  EXPECT_EQ(studies.size(), 3U);
  for (const auto& study : studies) {
    EXPECT_EQ(study.name, state_name(study.state));
  }
  EXPECT_THAT(rows("SELECT DISTINCT changed_at FROM studies"), ElementsAre("later"));
}

/// Returns `points` points for each of `models` values of k.
StudyTable table_of_models(std::uint64_t models, std::uint64_t points) {
  return table(protocol::recipe_of(
      {{protocol::range("k", 1e7, 2e7, models), protocol::listed("H", {1.0}),
        protocol::range("mu", 0.0, 1.0, points), protocol::listed("e", {1.0})}}));
}

TEST_F(StoreTest, EachResultHasItsOwnModelInWhateverMessageOrStudyItComes) {
  const AddStudy first{1, "a", table_of_models(11, 2), "now"};
  // Study 2 has 101 models, of which 11 also occur in study 1.
  const AddStudy second{2, "b", table_of_models(101, 2), "now"};
  commit({first, second, worker(1)});
  commit({solved(first, {8, 0, 2, 4, 6, 10})});
  commit({solved(second, {1, 20, 21, 40, 60, 200, 201})});
  commit({solved(first, {1, 3, 12, 20})});
  std::size_t compared = 0;
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
  for (const auto& key : solver::model_keys()) {
    Statement row(database.get(),
                  fmt::format("SELECT study_id, point, models.{} FROM results JOIN models"
                              " USING (model_id)",
                              key.name));
    for (; row.step(); ++compared) {
      const auto& points = *(row.number(0) == 1 ? first : second).table.get();
      const solver::ModelParameters model = points.model(points.point(row.number(1)).model);
      if (key.name == "integrator") {
        EXPECT_EQ(row.text(2), solver::integrator_name(model.integrator));
      } else {
        EXPECT_EQ(row.real(2), key.get(model)) << key.name;
      }
    }
  }
  EXPECT_EQ(compared, 17 * solver::model_keys().size());
  EXPECT_THAT(rows("SELECT count(*), count(DISTINCT definition), min(lengths_m) FROM models"),
              ElementsAre("8|8|[0.4,0.4,0.4]"));
}

TEST_F(StoreTest, TheViewRunsShowsTheStudyItsModelAndTheWorker) {
  const auto study = study_of(3);
  commit({study, worker(1), solved(study, {1})});
  EXPECT_THAT(rows("SELECT study, mu, e, E_Pa, elements_per_link, worker_id, worker_name,"
                   " solver_version, instruction_set FROM runs"),
              ElementsAre("a|0.5|1.0|70000000000.0|4|1|host|0.1|avx2"));
}

TEST_F(StoreTest, ADatabaseInUseIsNotOpenedTwice) {
  store();
  EXPECT_THAT(refusal(), HasSubstr("already uses the database"));
}

TEST_F(StoreTest, OtherKindsOfFilesAreRefused) {
  std::ofstream(path_) << std::string(5000, 'x');
  EXPECT_THAT(refusal(), HasSubstr("is not a database"));
  EXPECT_EQ(std::filesystem::file_size(path_), 5000U);
  path_ = folder_.file("");
  EXPECT_THAT(refusal(), HasSubstr("is a directory"));
  path_ = folder_.file("none/studies.db");
  EXPECT_THAT(refusal(), HasSubstr("No such file"));
}

TEST_F(StoreTest, ADatabaseOfAnotherProgramIsRefusedByName) {
  execute(open_database(path_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE).get(),
          "CREATE TABLE recipes (name TEXT)");
  EXPECT_THAT(refusal(), HasSubstr("another program (application id 0)"));
}

TEST_F(StoreTest, AStudyThatThisVersionRefusesIsSkippedAndNamed) {
  commit({study_of(10, 1, "too elastic"), study_of(10, 2, "b"), study_of(3, 3, "c")});
  close();
  // Another version may have accepted an e that this version refuses.
  const protocol::Recipe recipe =
      protocol::recipe_of({{protocol::listed("H", {1.0}), protocol::range("mu", 0.0, 1.0, 10),
                            protocol::listed("e", {1e-4})}});
  execute_with(open_database(path_, SQLITE_OPEN_READWRITE).get(),
               "UPDATE studies SET recipe = ?, checksum = NULL WHERE study_id = 1",
               Blob{recipe.SerializeAsString()});
  execute_sql("UPDATE studies SET name = CAST(x'61ff' AS TEXT) WHERE study_id = 3");
  const auto studies = store().studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].name, "b");
  EXPECT_THAT(store().skipped(),
              ElementsAre(AllOf(HasSubstr("too elastic"), HasSubstr("e = 0.0001")),
                          HasSubstr("its name is not UTF-8")));
}

TEST_F(StoreTest, ARecipeThatCannotBeReadIsAnErrorThatNamesTheStudy) {
  commit({study_of(3)});
  close();
  execute_sql("UPDATE studies SET recipe = x'ff', checksum = NULL");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("recipe of study a"), HasSubstr("`oblique check")));
}

TEST_F(StoreTest, AStudyNumberIsNeverReused) {
  const auto study = study_of(5, 2);
  commit({study, solved(study, {0}), study_of(5, 3, "b")});
  close();
  execute_sql("DELETE FROM studies");
  EXPECT_EQ(store().last_study_id(), 3U);
  execute_sql("UPDATE results SET study_id = 7");
  EXPECT_EQ(store().last_study_id(), 7U)
      << "rows of study 7 would belong to a new study of this number";
}

TEST_F(StoreTest, AStudyThatWasChangedByHandIsRefusedWithTheRemedy) {
  commit({study_of(2, 1, "first"), study_of(5, 2, "second")});
  close();
  for (const char* change :
       {"study_id = 3", "points = 6", "recipe = x'ff'", "errors = 1", "created_at = ''"}) {
    const std::string where = " WHERE name = 'second'";
    execute_sql("CREATE TABLE before AS SELECT * FROM studies" + where);
    execute_sql(std::string("UPDATE studies SET ") + change + where);
    EXPECT_THAT(refusal(), AllOf(HasSubstr("(\"second\")"), HasSubstr("SET checksum = NULL")))
        << change;
    execute_sql("DELETE FROM studies" + where +
                "; INSERT INTO studies SELECT * FROM before; DROP TABLE before");
    EXPECT_EQ(refusal(), "it opened");
  }
  EXPECT_THROW(execute_sql("UPDATE studies SET study_id = 0"), StorageError);
  EXPECT_THROW(execute_sql("UPDATE studies SET study_id = 9223372036854775807"), StorageError);
}

// ---- Studies that grow, are renamed or deleted --------------------------------------------------

class StudyDeletionTest : public StoreFixture {
 protected:
  void reopen() {
    close();
    store();
  }
  /// Adds study "study ID", whose points are all solved by worker ID.
  void add_solved(std::uint64_t id, const Table& points) {
    const AddStudy study = study_of(points, id, "study " + std::to_string(id));
    commit({study, worker(id), solved(study, numbers(0, points->size()), id)});
  }
  static Table table_with_k(double k, std::uint64_t points) {
    return table(protocol::recipe_of(
        {{protocol::listed("k", {k}), protocol::listed("H", {1.0}),
          protocol::range("mu", 0.0, 1.0, points), protocol::listed("e", {1.0})}}));
  }
  std::int64_t rows_in(const std::string& from) const {
    return number("SELECT count(*) FROM " + from);
  }
  /// Deletes all rows of deleted studies, at most `most` per step; returns the number of steps.
  int clear_all(std::size_t most) {
    int steps = 1;
    while (store().clear_away(most) != ClearedAway::kAll) {
      ++steps;
    }
    return steps;
  }
};

TEST_F(StudyDeletionTest, AStudyThatGrowsOrIsRenamedKeepsItsRowsAndAValidChecksum) {
  add_solved(1, table_of(10));
  commit({SetStudyState{1, StudyState::kDone, "then"}});
  commit({GrowStudy{1, grown_table(), 2, "now"}, RenameStudy{1, "another name"}});
  reopen();
  const auto study = store().studies().at(0);
  EXPECT_EQ(study.name, "another name");
  EXPECT_EQ(study.table.size(), 20U);
  EXPECT_EQ(study.state, StudyState::kRunning);
  EXPECT_EQ(study.completed, IntervalSet(0, 10));
  EXPECT_EQ(study.priority, 2);
  EXPECT_EQ(study.created_at, "2024-01-01T00:00:00.000Z");
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StudyDeletionTest, ADeletedStudyIsGoneAtOnceAndItsRowsAreDeletedInParts) {
  add_solved(1, table_of(100));
  add_solved(2, table_of(50));
  commit({DeleteStudy{1}});
  EXPECT_THAT(store().studies(), SizeIs(1));
  EXPECT_EQ(rows_in("runs"), 50);
  commit({study_of(4, 3, "study 1")});  // the name is free again
  EXPECT_EQ(store().clear_away(10), ClearedAway::kPart);
  EXPECT_EQ(rows_in("results WHERE study_id = 1"), 90);
  EXPECT_GT(clear_all(10), 9);
  EXPECT_EQ(rows_in("results WHERE study_id = 1"), 0);
  EXPECT_EQ(rows_in("results WHERE study_id = 2"), 50);
  EXPECT_EQ(rows_in("completed_ranges WHERE study_id = 1"), 0);
  EXPECT_EQ(store().cleared_rows(), 100U);
  EXPECT_EQ(store().clear_away(10), ClearedAway::kAll);
}

TEST_F(StudyDeletionTest, AfterAKillTheNextProcessContinuesTheDeletion) {
  for (int steps = 0; steps < 8; ++steps) {
    const std::uint64_t id = static_cast<std::uint64_t>(2 * steps + 1);
    add_solved(id, table_of(20));
    add_solved(id + 1, table_with_k(1e7 + steps, 20));
    commit({DeleteStudy{id + 1}});
    for (int step = 0; step < steps; ++step) {
      (void)store().clear_away(4);
    }
    reopen();
    EXPECT_THAT(faults(), IsEmpty()) << "after step " << steps;
    clear_all(4);
    EXPECT_EQ(rows_in("results"), 20 * (steps + 1));
    reopen();
    EXPECT_EQ(rows_in("models"), 1);
    EXPECT_EQ(rows_in("workers"), steps + 1);
    EXPECT_EQ(rows_in("deletions"), 0);
    EXPECT_EQ(store().last_study_id(), id + 1);
  }
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StudyDeletionTest, LateChangesOfADeletedStudyAreDropped) {
  add_solved(1, table_of(5));
  const AddResults late = solved(study_of(5), numbers(0, 5));
  commit({DeleteStudy{1}, late});
  clear_all(100);
  commit({late, SetStudyState{1, StudyState::kDone, "now"},
          ForgetFailures{1, IntervalSet(0, 5), "now"}});
  EXPECT_EQ(rows_in("results"), 0);
  EXPECT_THAT(store().studies(), IsEmpty());
}

TEST_F(StudyDeletionTest, ADeletionThatIsRolledBackDeletesNothing) {
  add_solved(1, table_of(5));
  EXPECT_THROW(commit({DeleteStudy{1}, study_of(1, 2, "b"), study_of(1, 3, "b")}), StorageError);
  clear_all(100);
  EXPECT_THAT(store().studies(), SizeIs(1));
  commit({GrowStudy{1, table_of(6), {}, "now"}, solved(study_of(6), numbers(0, 6))});
  EXPECT_EQ(rows_in("results"), 6) << "later results are stored";
}

TEST_F(StudyDeletionTest, OrphanedModelsAndWorkersAreDeletedAtAStartAfterTheRows) {
  add_solved(1, table_with_k(1e7, 20));
  add_solved(2, table_with_k(2e7, 20));
  add_solved(3, table_with_k(2e7, 20));
  commit({DeleteStudy{1}, DeleteStudy{2}});
  reopen();
  EXPECT_EQ(rows_in("models"), 2) << "models of remaining rows are kept";
  clear_all(7);
  EXPECT_EQ(rows_in("models"), 2) << "unused models are deleted only at a start";
  reopen();
  EXPECT_EQ(rows_in("models"), 1);
  EXPECT_EQ(rows_in("workers"), 1);
  EXPECT_EQ(rows_in("results JOIN models USING (model_id)"), 20);
  EXPECT_EQ(number("SELECT has_orphans FROM about"), 0);
  add_solved(4, table_with_k(1e7, 3));
  EXPECT_EQ(rows_in("results JOIN models USING (model_id) WHERE k = 1e7"), 3)
      << "a deleted model is stored again";
}

TEST_F(StudyDeletionTest, DeletionWaitsWhileAReaderKeepsTheLogLong) {
  add_solved(1, table_of(2000));
  add_solved(2, table_of(2000));
  store().checkpoint_at(1);
  const DatabaseHandle reader = open_database(path_, SQLITE_OPEN_READONLY);
  execute(reader.get(), "BEGIN");
  Statement first(reader.get(), "SELECT count(*) FROM results");
  ASSERT_TRUE(first.step());
  commit({DeleteStudy{1}});
  ClearedAway cleared = ClearedAway::kPart;
  for (int step = 0; step < 1000 && cleared == ClearedAway::kPart; ++step) {
    cleared = store().clear_away(50);
  }
  EXPECT_EQ(cleared, ClearedAway::kMustWait);
  first.reset();
  execute(reader.get(), "COMMIT");
  clear_all(500);
  EXPECT_EQ(rows_in("results WHERE study_id = 1"), 0);
}

// ---- Tables, views and triggers -----------------------------------------------------------------

/// Provides a database with three solved points. The tests change it as another program would.
class SchemaTest : public StoreFixture {
 protected:
  SchemaTest() {
    const auto study = study_of(3);
    commit({study, worker(1), solved(study, {0, 1, 2})});
    close();
  }
  std::vector<std::string> objects() const {
    return rows(
        "SELECT type || ' ' || name || ' ' || sql FROM sqlite_schema"
        " WHERE type <> 'table' AND sql IS NOT NULL ORDER BY name");
  }
};

TEST_F(SchemaTest, EachStartRestoresDroppedObjectsAndKeepsOtherViews) {
  execute_sql("CREATE VIEW large AS SELECT * FROM runs WHERE fn_peak_N > 1e3");
  const auto before = objects();
  ASSERT_EQ(before.size(), 9U);
  for (const std::string change :
       {"DROP VIEW runs", "DROP VIEW peaks", "DROP VIEW phases", "DROP VIEW stick_intervals",
        "DROP VIEW reaction_peaks", "DROP VIEW peaks; CREATE VIEW peaks AS SELECT 7 AS mine",
        "DROP TRIGGER row_deleted", "DROP INDEX failed_points", "DROP INDEX solved_points"}) {
    execute_sql(change);
    EXPECT_EQ(refusal(), "it opened");
    EXPECT_EQ(objects(), before) << change;
  }
  EXPECT_THAT(rows("SELECT count(*) FROM large"), ElementsAre("3"));
}

TEST_F(SchemaTest, AStartRestoresDefinitionsThatWereChangedAndRefusesChangedTables) {
  const auto before = objects();
  const auto rewrite = [&](const std::string& name, const std::string& from,
                           const std::string& to) {
    execute_sql(
        fmt::format("PRAGMA writable_schema = ON;"
                    "UPDATE sqlite_schema SET sql = replace(sql, '{1}', '{2}') WHERE name = '{0}'",
                    name, from, to));
  };
  rewrite("runs", "m.E AS E_Pa", "m.A AS E_Pa");
  rewrite("failed_points", "IS NOT NULL", "IS NULL");
  rewrite("row_deleted", "counted = 0", "counted = 1");
  EXPECT_THAT(faults(), testing::Not(IsEmpty()));
  EXPECT_EQ(refusal(), "it opened");
  EXPECT_EQ(objects(), before);
  EXPECT_THAT(faults(), IsEmpty());
  rewrite("results", "wall_s REAL", "wall_s INTEGER");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("table results"), HasSubstr("--salvage")));
}

TEST_F(SchemaTest, TextsOfResultsAreBounded) {
  for (const char* column : {"mode", "major_mode", "margin_event", "error"}) {
    EXPECT_THROW(execute_sql(fmt::format("UPDATE results SET {} = hex(zeroblob(500000))", column)),
                 StorageError)
        << column;
  }
}

TEST_F(SchemaTest, ElementsOfOtherProgramsAreNoFaultButNamed) {
  execute_sql(
      "CREATE TABLE notes (text TEXT UNIQUE); CREATE INDEX by_force ON results (fn_peak_N);"
      "CREATE VIEW large AS SELECT * FROM runs WHERE fn_peak_N > 1e3");
  EXPECT_EQ(refusal(), "it opened");
  const Diagnosis found = diagnose(path_);
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_THAT(found.remarks, AllOf(testing::Contains(HasSubstr("the table notes is of another")),
                                   testing::Contains(HasSubstr("the index by_force is of another")),
                                   testing::Contains(HasSubstr("the view large is of another"))));
}

TEST_F(SchemaTest, TriggersOfTheFileDoNotRunWithTheChangesOfAServer) {
  execute_sql(
      "CREATE TRIGGER other AFTER UPDATE ON studies BEGIN SELECT RAISE(ABORT, 'it ran'); END");
  EXPECT_THROW(execute_sql("UPDATE studies SET priority = 1"), StorageError);
  commit({SetPriority{1, 7}});
  EXPECT_THAT(rows("SELECT priority FROM studies"), ElementsAre("7"));
}

TEST_F(SchemaTest, AFileWithATableNamedLikeAViewIsRefusedUnchanged) {
  execute_sql("DROP VIEW runs; CREATE TABLE runs (mine)");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("runs"), HasSubstr("rename the table")));
  EXPECT_THAT(rows("SELECT type FROM sqlite_schema WHERE name = 'runs'"), ElementsAre("table"));
}

// ---- Damage -------------------------------------------------------------------------------------

TEST_F(StoreTest, DamageEndsTheWriterWithTheRemedy) {
  const auto study = study_of(1000);
  commit({study, worker(1), solved(study, numbers(0, 1000)), DeleteStudy{1}});
  while (store().clear_away(1000) != ClearedAway::kAll) {
  }
  close();
  {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(35).put('\x01');  // the first free page is page 1 now
  }
  EXPECT_THAT(faults(), testing::Contains(HasSubstr("freelist")));
  const auto other = study_of(1000, 2, "b");
  EXPECT_THAT(
      [&] {
        commit({other, worker(2), solved(other, numbers(0, 1000), 2)});
      },
      testing::ThrowsMessage<StorageGone>(HasSubstr("--salvage")));
}

TEST_F(StoreTest, AChangeThatContradictsTheFileIsNoReasonToWait) {
  commit({study_of(3)});
  EXPECT_THROW(commit({study_of(3, 2, "a")}), ChangeRefused);
  execute_sql("CREATE UNIQUE INDEX of_another_program ON results (e)");
  EXPECT_THROW(commit({solved(study_of(3), numbers(0, 3), 0)}), ChangeRefused);
}

// ---- Files --------------------------------------------------------------------------------------

class StoreFilesTest : public StoreFixture {
 protected:
  StoreFilesTest() {
    fs::create_directory(folder_.file("lab"));
    path_ = folder_.file("lab/studies.db");
    make_databases();
  }
  void make_databases() {
    commit({study_});
    Store other(other_);
    other.commit(std::vector<Change>{study_of(10, 1, "other")});
  }
  void add_result(std::uint64_t point) { commit({solved(study_, {point}, 0)}); }
  static std::int64_t rows_of(const std::string& path) {
    return std::stoll(rows(path, "SELECT count(*) FROM results").at(0));
  }
  /// Returns the number of rows in a copy of the database file without its log.
  std::int64_t rows_of_copy(const std::string& name) {
    fs::copy_file(path_, folder_.file(name));
    return rows_of(folder_.file(name));
  }

  const AddStudy study_ = study_of(10);
  std::string other_ = folder_.file("other.db");
};

TEST_F(StoreFilesTest, ACommitDuringWhichTheFileIsDeletedIsNotAcknowledged) {
  sqlite3_commit_hook(
      store().connection(),
      [](void* path) {
        fs::remove(*static_cast<const std::string*>(path));
        return 0;
      },
      &path_);
  EXPECT_THROW(add_result(0), StorageGone);
}

TEST_F(StoreFilesTest, NothingIsAcknowledgedAfterTheFileIsDeletedRenamedOrReplaced) {
  const std::map<std::string, std::function<void()>> changes{
      {"the database is deleted", [&] { fs::remove(path_); }},
      {"it is renamed", [&] { fs::rename(path_, folder_.file("elsewhere.db")); }},
      {"its folder is renamed",
       [&] { fs::rename(folder_.file("lab"), folder_.file("laboratory")); }},
      {"another database takes its name", [&] { fs::rename(other_, path_); }}};
  for (const auto& [what, change] : changes) {
    close();
    for (const char* name : {"lab", "laboratory", "other.db", "elsewhere.db"}) {
      fs::remove_all(folder_.file(name));
    }
    fs::create_directory(folder_.file("lab"));
    make_databases();
    add_result(0);
    EXPECT_NO_THROW(store().check()) << what;
    change();
    EXPECT_THROW(store().check(), StorageGone) << what;
    EXPECT_THROW(add_result(1), StorageGone) << what;
    EXPECT_THROW(store().merge_log(), StorageGone) << what;
  }
}

TEST_F(StoreFilesTest, ARenamedDatabaseGetsAllAcknowledgedChangesWhenItsServerEnds) {
  add_result(0);
  add_result(1);
  const std::string elsewhere = folder_.file("elsewhere.db");
  fs::rename(path_, elsewhere);
  EXPECT_THROW(add_result(2), StorageGone);
  close();
  EXPECT_GE(rows_of(elsewhere), 2);
  path_ = elsewhere;
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StoreFilesTest, ARunningQueryKeepsTheLogAndAnIdleReaderDoesNot) {
  add_result(0);
  EXPECT_EQ(rows_of_copy("before.db"), 0) << "the row is still in the log";
  const DatabaseHandle waits = open_database(path_, SQLITE_OPEN_READONLY);
  EXPECT_THAT(rows(waits.get(), "SELECT count(*) FROM results"), ElementsAre("1"));
  const DatabaseHandle reads = open_database(path_, SQLITE_OPEN_READONLY);
  {
    Statement rows(reads.get(), "SELECT point FROM results");
    ASSERT_TRUE(rows.step());
    add_result(1);
    EXPECT_FALSE(store().merge_log());
    EXPECT_GT(fs::file_size(path_ + "-wal"), 0U);
    add_result(2);  // the server continues
  }
  EXPECT_TRUE(store().merge_log());
  EXPECT_EQ(fs::file_size(path_ + "-wal"), 0U);
  EXPECT_EQ(rows_of_copy("after.db"), 3);
}

TEST_F(StoreFilesTest, OnlyItsOwnerMayReadANewDatabaseAndAnOldOneKeepsItsMode) {
  const auto mode_of = [](const std::string& path) {
    struct stat found {};
    EXPECT_EQ(::stat(path.c_str(), &found), 0) << path;
    return found.st_mode & 0777U;
  };
  const mode_t before = ::umask(0);
  const std::string path = folder_.file("private.db");
  { const Store store(path); }
  EXPECT_EQ(mode_of(path), 0600U);
  ASSERT_EQ(::chmod(path.c_str(), 0640), 0);
  {
    const Store store(path);
    EXPECT_EQ(mode_of(path + "-wal"), 0640U);
  }
  EXPECT_EQ(mode_of(path), 0640U);
  ::umask(before);
}

}  // namespace
}  // namespace oblique::server
