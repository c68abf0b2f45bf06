#include "server/store/store.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
#include "server/query/reader.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using protocol::QueryReply;
using testing::HasSubstr;

AddStudy study_of(std::uint64_t points, std::uint64_t id = 1, const std::string& name = "a") {
  return {id, name, table_of(points), "2024-01-01T00:00:00.000Z", {}};
}

AddResults results_of(const AddStudy& study, std::vector<protocol::PointResult> results) {
  return {study.study_id,    study.table.get(), 1, "0.1", "avx2", 1, "2024-01-01T00:00:01.000Z",
          std::move(results)};
}

QueryReply ask(const std::string& path, const std::string& sql) {
  return Reader(path).query(sql, kNoLimits);
}

std::string message_of_opening(const std::string& path) {
  try {
    const Store store(path);
  } catch (const StorageError& error) {
    return error.what();
  }
  return "it opened";
}

class StoreTest : public testing::Test {
 protected:
  void commit(Store& store, std::vector<Change> changes) { store.commit(changes); }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
};

TEST_F(StoreTest, WhatWasCommittedIsThereAfterReopening) {
  const auto study = study_of(10);
  std::string identity;
  {
    Store store(path_);
    identity = store.database_id();
    commit(store, {study, AddWorker{1, "host", 2, "0.1", "avx2", "now"},
                   results_of(study, {solved_point(0), solved_point(1), solved_point(5),
                                      protocol::failed_point(7, "it did not end")})});
  }
  Store store(path_);
  const auto studies = store.studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].name, "a");
  EXPECT_EQ(studies[0].table->recipe().SerializeAsString(),
            study.table->recipe().SerializeAsString());
  IntervalSet settled(0, 2);
  settled.insert(5);
  settled.insert(7);
  EXPECT_TRUE(studies[0].settled == settled);
  EXPECT_EQ(studies[0].failures.size(), 1U);
  EXPECT_EQ(studies[0].state, StudyState::kRunning);
  EXPECT_EQ(store.last_study_id(), 1U);
  EXPECT_EQ(store.last_worker_id(), 1U);
  EXPECT_EQ(store.database_id(), identity);
}

TEST_F(StoreTest, AStatementThatNeverEndsCanBeInterrupted) {
  Store store(path_);
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "CREATE TRIGGER endless AFTER INSERT ON studies BEGIN"
          " SELECT count(*) FROM (WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
          " SELECT i FROM n); END;");
  std::thread writer([&] {
    EXPECT_THAT([&] { commit(store, {study_of(1)}); },
                testing::ThrowsMessage<StorageError>(HasSubstr("interrupted")));
  });
  store.interrupt();
  writer.join();
}

TEST_F(StoreTest, AnEmptyDatabaseHasNoStudies) {
  Store store(path_);
  EXPECT_TRUE(store.studies().empty());
  EXPECT_EQ(store.last_study_id(), 0U);
  EXPECT_EQ(store.last_worker_id(), 0U);
}

TEST_F(StoreTest, TwoDatabasesHaveDifferentIdentities) {
  EXPECT_NE(Store(path_).database_id(), Store(folder_.file("other.db")).database_id());
}

TEST_F(StoreTest, TheFirstResultOfAPointStays) {
  Store store(path_);
  const auto study = study_of(3);
  commit(store, {study, results_of(study, {solved_point(1)})});
  auto other = solved_point(1);
  other.set_texts(0, "sC");
  commit(store, {results_of(study, {other, protocol::failed_point(1, "late")})});
  const auto reply = ask(path_, "SELECT mode, status, (SELECT count(*) FROM results) FROM results");
  ASSERT_EQ(reply.rows_size(), 1);
  EXPECT_EQ(reply.rows(0).values(0).text(), "SC SR sR");
  EXPECT_EQ(reply.rows(0).values(1).text(), "solved");
  EXPECT_EQ(reply.rows(0).values(2).integer(), 1);
}

TEST_F(StoreTest, AFailedTransactionKeepsNothing) {
  Store store(path_);
  const auto study = study_of(3);
  EXPECT_THROW(commit(store, {study, study_of(3, 2, "a")}), StorageError);
  EXPECT_TRUE(store.studies().empty());
  commit(store, {study, results_of(study, {solved_point(0)})});
  EXPECT_EQ(store.studies().at(0).settled.size(), 1U);
}

TEST_F(StoreTest, ModelsAreForgottenWithTheTransactionThatBroughtThem) {
  Store store(path_);
  const auto study = study_of(3);
  commit(store, {study});
  EXPECT_THROW(commit(store, {results_of(study, {solved_point(0)}), study_of(3, 2, "a")}),
               StorageError);
  commit(store, {results_of(study, {solved_point(0)})});
  EXPECT_EQ(ask(path_, "SELECT 1 FROM results JOIN models USING (model_id)").rows_size(), 1);
}

TEST_F(StoreTest, TheStateOfAStudyIsKept) {
  const auto study = study_of(3);
  {
    Store store(path_);
    commit(store, {study, SetStudyState{1, StudyState::kCancelled, "later"}});
  }
  EXPECT_EQ(Store(path_).studies().at(0).state, StudyState::kCancelled);
}

TEST_F(StoreTest, AStudyWhoseNameIsNoUtf8IsLeftAsItIsAndSaid) {
  {
    Store store(path_);
    commit(store, {study_of(3), study_of(3, 2, "b")});
  }
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "UPDATE studies SET name = CAST(x'61ff' AS TEXT) WHERE study_id = 1");
  Store store(path_);
  ASSERT_EQ(store.studies().size(), 1U);
  EXPECT_EQ(store.studies().at(0).name, "b");
  EXPECT_THAT(store.left_out().front(), HasSubstr("study 1 is left as it is"));
}

TEST_F(StoreTest, WhoSubmittedAStudyIsKeptByTheNameOfTheKey) {
  auto with_key = study_of(10);
  with_key.submitted_by = "alice";
  {
    Store store(path_);
    commit(store, {with_key, study_of(10, 2, "b")});
  }
  const auto studies = Store(path_).studies();
  EXPECT_EQ(studies.at(0).submitted_by, "alice");
  EXPECT_EQ(studies.at(1).submitted_by, "");
  EXPECT_EQ(Reader(path_).study_status("a").at(0).submitted_by(), "alice");
  const auto unknown = ask(path_, "SELECT submitted_by IS NULL FROM studies WHERE name = 'b'");
  EXPECT_EQ(unknown.rows(0).values(0).integer(), 1);
}

TEST_F(StoreTest, AFailedPointHasAReasonAndNoOutputs) {
  Store store(path_);
  const auto study = study_of(3);
  commit(store, {study, results_of(study, {protocol::failed_point(2, "it never fell")})});
  const auto row = ask(path_, "SELECT status, error, duration_s IS NULL, peaks IS NULL FROM runs");
  ASSERT_EQ(row.rows_size(), 1);
  EXPECT_EQ(row.rows(0).values(0).text(), "failed");
  EXPECT_EQ(row.rows(0).values(1).text(), "it never fell");
  EXPECT_EQ(row.rows(0).values(2).integer(), 1);
  EXPECT_EQ(row.rows(0).values(3).integer(), 1);
  EXPECT_EQ(ask(path_, "SELECT * FROM peaks").rows_size(), 0);
}

TEST_F(StoreTest, OneModelOfTwoStudiesIsOneRowAndEachKeyIsAColumn) {
  Store store(path_);
  const auto first = study_of(3, 1, "a");
  const auto second = study_of(5, 2, "b");
  commit(store, {first, second, results_of(first, {solved_point(0)}),
                 results_of(second, {solved_point(0)})});
  std::string columns = "lengths_m";
  for (const auto& key : solver::model_keys()) {
    columns += ", " + std::string(key.name);
  }
  const auto reply = ask(path_, "SELECT " + columns + " FROM models");
  ASSERT_EQ(reply.rows_size(), 1);
  EXPECT_EQ(reply.rows(0).values(0).text(), "[0.4,0.4,0.4]");
  const solver::ModelParameters paper = solver::preset("paper");
  int column = 1;
  for (const auto& key : solver::model_keys()) {
    const auto& value = reply.rows(0).values(column++);
    const double number = value.has_integer() ? static_cast<double>(value.integer()) : value.real();
    if (key.name == "integrator") {
      EXPECT_EQ(value.text(), solver::integrator_name(paper.integrator));
    } else {
      EXPECT_EQ(number, key.get(paper)) << key.name;
    }
  }
}

TEST_F(StoreTest, AttemptsOfFailuresAreKnownAfterARestartAlsoWhenTheFailuresAreForgotten) {
  const auto study = study_of(10);
  const auto failed_in = [&](std::uint32_t attempt, std::vector<std::uint64_t> points) {
    std::vector<protocol::PointResult> results;
    for (const std::uint64_t point : points) {
      results.push_back(protocol::failed_point(point, "it never fell"));
    }
    auto change = results_of(study, std::move(results));
    change.attempt = attempt;
    return change;
  };
  IntervalSet retried(2, 6);
  retried.insert(8);
  {
    Store store(path_);
    commit(store, {study, failed_in(1, {2, 3, 5}), failed_in(2, {4, 8, 9})});
    commit(store, {ForgetFailures{1, retried, "later"}});
    commit(store, {failed_in(3, {4})});
  }
  std::map<std::uint64_t, std::uint32_t> attempts;
  Store(path_).studies().at(0).attempts.for_each(
      [&](const Interval& interval, std::uint32_t number) {
        for (std::uint64_t point = interval.begin; point < interval.end; ++point) {
          attempts[point] = number;
        }
      });
  EXPECT_EQ(attempts, (std::map<std::uint64_t, std::uint32_t>{
                          {2, 1}, {3, 1}, {4, 3}, {5, 1}, {8, 2}, {9, 2}}));
  EXPECT_EQ(ask(path_, "SELECT * FROM retries").rows_size(), 4) << "neighbours share a row";
}

TEST_F(StoreTest, RunsNamesTheStudyItsModelAndTheWorker) {
  Store store(path_);
  const auto study = study_of(3);
  commit(store, {study, AddWorker{1, "host", 2, "0.1", "avx2", "now"},
                 results_of(study, {solved_point(1)})});
  const auto reply =
      ask(path_, "SELECT study, mu, e, E_Pa, elements_per_link, worker_name FROM runs");
  ASSERT_EQ(reply.rows_size(), 1);
  EXPECT_EQ(reply.rows(0).values(0).text(), "a");
  EXPECT_EQ(reply.rows(0).values(1).real(), 0.5);
  EXPECT_EQ(reply.rows(0).values(2).real(), 1.0);
  EXPECT_EQ(reply.rows(0).values(3).real(), 70e9);
  EXPECT_EQ(reply.rows(0).values(5).text(), "host");
}

TEST_F(StoreTest, ADatabaseInUseIsNotOpenedTwice) {
  const Store store(path_);
  EXPECT_THAT(message_of_opening(path_), HasSubstr("already uses the database"));
}

TEST_F(StoreTest, OtherFilesAreRefusedByTheirKind) {
  EXPECT_THAT(message_of_opening(folder_.file("")), HasSubstr("is a directory"));
  EXPECT_THAT(message_of_opening(folder_.file("none/studies.db")), HasSubstr("No such file"));
  std::ofstream(path_) << std::string(5000, 'x');
  EXPECT_THAT(message_of_opening(path_), HasSubstr("is not a database"));
  EXPECT_EQ(std::filesystem::file_size(path_), 5000U);
}

TEST_F(StoreTest, ADatabaseOfAnotherProgramIsRefusedByName) {
  execute(open_database(path_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE).get(),
          "CREATE TABLE recipes (name TEXT)");
  EXPECT_THAT(message_of_opening(path_), HasSubstr("another program"));
  EXPECT_THAT(message_of_opening(path_), HasSubstr("recipes"));
}

TEST_F(StoreTest, AStudyThatThisVersionDoesNotTakeIsLeftOutAndNamedAndTheOthersAreThere) {
  {
    Store store(path_);
    commit(store, {study_of(10, 1, "too elastic"), study_of(10, 2, "b")});
  }
  // Earlier versions took an e that no version can solve.
  auto recipe = table_of(10)->recipe();
  auto& e = *recipe.mutable_blocks(0)->mutable_axes(recipe.blocks(0).axes_size() - 1);
  ASSERT_EQ(e.key(), "e");
  e.clear_values();
  e.add_values(1e-4);
  {
    const auto database = open_database(path_, SQLITE_OPEN_READWRITE);
    Statement update(database.get(), "UPDATE studies SET recipe = ? WHERE study_id = 1");
    const std::string bytes = recipe.SerializeAsString();
    update.bind_blob(1, bytes);
    update.run();
  }
  Store store(path_);
  const auto studies = store.studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].name, "b");
  ASSERT_EQ(store.left_out().size(), 1U);
  EXPECT_THAT(store.left_out().front(),
              testing::AllOf(HasSubstr("too elastic"), HasSubstr("e = 0.0001")));
}

TEST_F(StoreTest, ARecipeThatCannotBeReadIsAnErrorThatNamesTheStudy) {
  {
    Store store(path_);
    commit(store, {study_of(3)});
  }
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), "UPDATE studies SET recipe = x'ff'");
  Store store(path_);
  try {
    store.studies();
    FAIL() << "a damaged recipe was read";
  } catch (const StorageError& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(HasSubstr("recipe of study a"), HasSubstr("`oblique check`")));
  }
}

/// Two studies, both done; the second has other points.
class NumbersByHandTest : public StoreTest {
 protected:
  NumbersByHandTest() {
    Store store(path_);
    const auto first = study_of(2, 1, "first");
    const auto second = study_of(5, 2, "second");
    commit(store, {first, second, results_of(first, {solved_point(0), solved_point(1)}),
                   results_of(second, {solved_point(0), solved_point(1), solved_point(2),
                                       solved_point(3), solved_point(4)})});
  }
  void run(const std::string& sql) {
    execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), sql);
  }
  std::string message_of_start() {
    try {
      Store store(path_);
      (void)store.last_study_id();
      (void)store.studies();
    } catch (const StorageError& error) {
      return error.what();
    }
    return "it started";
  }
};

TEST_F(NumbersByHandTest, ANumberThatAnyTableNamesIsNotGivenToAnotherStudy) {
  run("DELETE FROM studies WHERE study_id = 2");
  EXPECT_EQ(Store(path_).last_study_id(), 2U) << "its results are there";
  run("DELETE FROM packed_results WHERE study_id = 2");
  EXPECT_EQ(Store(path_).last_study_id(), 2U) << "settled_points names it";
  run("DELETE FROM settled_points WHERE study_id = 2");
  EXPECT_EQ(Store(path_).last_study_id(), 1U);
  run("INSERT INTO retries VALUES (3, 0, 1, 1, 'now')");
  EXPECT_EQ(Store(path_).last_study_id(), 3U);
  run("INSERT INTO origins VALUES (4, 'gone (deleted)')");
  EXPECT_EQ(Store(path_).last_study_id(), 4U);
  run("INSERT INTO taken_points VALUES (5, 4, 1)");
  EXPECT_EQ(Store(path_).last_study_id(), 5U);
  run("UPDATE about SET last_study_id = 6");
  EXPECT_EQ(Store(path_).last_study_id(), 6U);
}

TEST_F(NumbersByHandTest, AStudyWithTheResultsOfAnotherIsRefusedByNameAndWithTheWayOut) {
  EXPECT_EQ(message_of_start(), "it started");
  run("DELETE FROM studies WHERE study_id = 1; UPDATE studies SET study_id = 1");
  EXPECT_THAT(message_of_start(),
              testing::AllOf(HasSubstr("study \"second\""), HasSubstr("`oblique check")))
      << "the rows of the first one, which was deleted";
}

TEST_F(NumbersByHandTest, AStudyWithTheResultsOfALongerOneIsRefused) {
  {
    Store store(path_);
    commit(store, {study_of(1, 3, "third")});  // its point is the first one of the second study
  }
  run("DELETE FROM studies WHERE study_id = 2; UPDATE studies SET study_id = 2 WHERE study_id = 3");
  EXPECT_THAT(message_of_start(), HasSubstr("point 1: the study has no such point"));
}

TEST_F(NumbersByHandTest, AStudyWithTheResultsOfAnotherModelIsRefused) {
  solver::ModelParameters other = solver::preset("paper");
  other.E_Pa *= 2.0;
  protocol::Recipe recipe = table_of(5)->recipe();
  *recipe.mutable_model() = protocol::to_message(other);
  {
    Store store(path_);
    commit(store, {AddStudy{3, "third", std::make_shared<const protocol::PointTable>(recipe),
                            "2024-01-01T00:00:00.000Z"}});
  }
  run("DELETE FROM studies WHERE study_id = 2; UPDATE studies SET study_id = 2 WHERE study_id = 3");
  EXPECT_THAT(message_of_start(), testing::AllOf(HasSubstr("study \"third\""), HasSubstr("model")));
}

TEST_F(NumbersByHandTest, AStudyWhoseRowsMovedToAnotherNumberIsRefused) {
  run("UPDATE packed_results SET study_id = 7 WHERE study_id = 2");
  EXPECT_THAT(message_of_start(), HasSubstr("its row is gone"));
}

TEST_F(NumbersByHandTest, ANumberBelow1IsRefusedByTheNameOfItsStudy) {
  for (const char* number : {"0", "-1"}) {
    run(std::string("UPDATE studies SET study_id = ") + number + " WHERE name = 'second'");
    EXPECT_THAT(message_of_start(),
                testing::AllOf(HasSubstr(std::string("study \"second\" has the number ") + number),
                               HasSubstr("`oblique check`")));
  }
}

TEST_F(NumbersByHandTest, TheHighestNumberThatThereIsLeavesNoneForAnotherStudy) {
  run("UPDATE studies SET study_id = 9223372036854775807 WHERE name = 'second'");
  EXPECT_THAT(message_of_start(), HasSubstr("no number is left"));
}

}  // namespace
}  // namespace oblique::server
