#include "server/store/store.h"

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using StoreTest = StoreFixture;

TEST_F(StoreTest, WhatWasCommittedIsThereAfterReopening) {
  const auto study = study_of(10);
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
  EXPECT_EQ(studies[0].settled, completed);
  EXPECT_EQ(studies[0].failures, IntervalSet(7, 8));
  EXPECT_EQ(studies[0].state, StudyState::kRunning);
  EXPECT_EQ(studies[0].solver_version, "0.1");
  EXPECT_EQ(store().last_study_id(), 1U);
  EXPECT_EQ(store().last_worker_id(), 1U);
  EXPECT_EQ(store().database_id(), identity);
}

TEST_F(StoreTest, AStatementThatNeverEndsCanBeInterrupted) {
  store();
  by_hand(
      "CREATE TRIGGER endless AFTER INSERT ON studies BEGIN"
      " SELECT count(*) FROM (WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
      " SELECT i FROM n); END;");
  std::thread writer([&] {
    EXPECT_THAT([&] { commit({study_of(1)}); },
                testing::ThrowsMessage<StorageError>(HasSubstr("interrupted")));
  });
  store().interrupt();
  writer.join();
}

TEST_F(StoreTest, AnEmptyDatabaseHasNoStudies) {
  EXPECT_THAT(store().studies(), IsEmpty());
  EXPECT_EQ(store().last_study_id(), 0U);
  EXPECT_EQ(store().last_worker_id(), 0U);
}

TEST_F(StoreTest, TwoDatabasesHaveDifferentIdentities) {
  EXPECT_NE(Store(path_).database_id(), Store(folder_.file("other.db")).database_id());
}

TEST_F(StoreTest, EachStartIsCounted) {
  EXPECT_EQ(store().count_start(), 1U);
  close();
  EXPECT_EQ(store().count_start(), 2U);
}

TEST_F(StoreTest, TheFirstResultOfAPointStays) {
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
  commit({study, solved(study, {0})});
  EXPECT_EQ(store().studies().at(0).settled.size(), 1U);
}

TEST_F(StoreTest, ModelsAreForgottenWithTheTransactionThatBroughtThem) {
  const auto study = study_of(3);
  commit({study, worker(1)});
  EXPECT_THROW(commit({solved(study, {0}), study_of(3, 2, "a")}), StorageError);
  commit({solved(study, {0})});
  EXPECT_THAT(rows("SELECT 1 FROM results JOIN models USING (model_id)"), ElementsAre("1"));
}

TEST_F(StoreTest, TheStateOfAStudyIsKept) {
  for (const StudyState state : {StudyState::kCancelled, StudyState::kPaused, StudyState::kDone}) {
    const auto id = static_cast<std::uint64_t>(state) + 1;
    commit({study_of(3, id, state_name(state)), SetStudyState{id, state, "later"}});
  }
  close();
  for (const auto& study : store().studies()) {
    EXPECT_EQ(study.name, state_name(study.state));
  }
  EXPECT_THAT(rows("SELECT DISTINCT changed_at FROM studies"), ElementsAre("later"));
}

TEST_F(StoreTest, AStudyWhoseNameIsNotUtf8IsLeftOutAndNamed) {
  commit({study_of(3), study_of(3, 2, "b")});
  close();
  by_hand("UPDATE studies SET name = CAST(x'61ff' AS TEXT) WHERE study_id = 1");
  const auto studies = store().studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].name, "b");
  EXPECT_THAT(store().left_out(), ElementsAre(HasSubstr("study 1 is left as it is")));
}

TEST_F(StoreTest, TheSubmitterOfAStudyIsKeptByTheNameOfTheKey) {
  auto with_key = study_of(10);
  with_key.submitted_by = "alice";
  commit({with_key, study_of(10, 2, "b")});
  close();
  const auto studies = store().studies();
  EXPECT_EQ(studies.at(0).submitted_by, "alice");
  EXPECT_EQ(studies.at(1).submitted_by, "");
  EXPECT_THAT(rows("SELECT submitted_by IS NULL FROM studies"), ElementsAre("0", "1"));
}

TEST_F(StoreTest, OneModelOfTwoStudiesIsOneRowAndEachKeyIsAColumn) {
  const auto first = study_of(3, 1, "a");
  const auto second = study_of(5, 2, "b");
  commit({first, second, worker(1), solved(first, {0}), solved(second, {0})});
  EXPECT_THAT(rows("SELECT lengths_m FROM models"), ElementsAre("[0.4,0.4,0.4]"));
  const solver::ModelParameters paper = solver::preset("paper");
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
  for (const auto& key : solver::model_keys()) {
    Statement value(database.get(), fmt::format("SELECT {} FROM models", key.name));
    ASSERT_TRUE(value.step()) << key.name;
    if (key.name == "integrator") {
      EXPECT_EQ(value.text(0), solver::integrator_name(paper.integrator));
    } else {
      EXPECT_EQ(value.real(0), key.get(paper)) << key.name;
    }
  }
}

TEST_F(StoreTest, EachResultHasItsOwnModelInWhateverMessageOrStudyItComes) {
  // Two points for each of `models` values of k.
  const auto study_of_models = [](std::uint64_t id, std::uint64_t models) {
    return AddStudy{id, "study " + std::to_string(id),
                    std::make_shared<const protocol::PointTable>(protocol::recipe_of(
                        {{protocol::range("k", 1e7, 2e7, models), protocol::listed("H", {1.0}),
                          protocol::listed("mu", {0.4, 0.8}), protocol::listed("e", {1.0})}})),
                    "now"};
  };
  const auto first = study_of_models(1, 11);
  const auto second = study_of_models(2, 101);  // of which eleven are the same
  commit({first, second, worker(1)});
  commit({solved(first, {8, 0, 2, 4, 6, 10})});
  commit({solved(second, {1, 20, 21, 40, 60, 200, 201})});
  commit({solved(first, {1, 3, 12, 20})});
  std::size_t compared = 0;
  for (const AddStudy& study : {first, second}) {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement row(database.get(),
                  "SELECT point, k FROM results JOIN models USING (model_id) WHERE study_id = ?");
    row.bind(1, study.study_id);
    for (; row.step(); ++compared) {
      const auto& table = *study.table.get();
      const auto point = table.point(static_cast<std::uint64_t>(row.integer(0)));
      EXPECT_EQ(table.model(point.model).k_N_m, row.real(1));
    }
  }
  EXPECT_EQ(compared, 17U);
  EXPECT_THAT(rows("SELECT count(*), count(DISTINCT definition) FROM models"), ElementsAre("8|8"));
}

TEST_F(StoreTest, AttemptsOfFailuresAreKnownAfterARestartAlsoWhenTheFailuresAreForgotten) {
  const auto study = study_of(10);
  const auto failed_in = [&](std::uint32_t attempt, const std::vector<std::uint64_t>& points) {
    AddResults change = failed(study, points);
    change.attempt = attempt;
    return change;
  };
  IntervalSet retried(2, 6);
  retried.insert(8);
  commit({study, worker(1), failed_in(1, {2, 3, 5}), failed_in(2, {4, 8, 9})});
  commit({ForgetFailures{1, retried, "later"}});
  commit({failed_in(3, {4})});
  close();
  std::map<std::uint64_t, std::uint32_t> attempts;
  store().studies().at(0).attempts.for_each([&](const Interval& interval, std::uint32_t number) {
    for (std::uint64_t point = interval.begin; point < interval.end; ++point) {
      attempts[point] = number;
    }
  });
  EXPECT_EQ(attempts, (std::map<std::uint64_t, std::uint32_t>{
                          {2, 1}, {3, 1}, {4, 3}, {5, 1}, {8, 2}, {9, 2}}));
  EXPECT_THAT(rows("SELECT count(*) FROM retries"), ElementsAre("4")) << "neighbours share a row";
}

TEST_F(StoreTest, RunsNamesTheStudyItsModelAndTheWorker) {
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

TEST_F(StoreTest, OtherFilesAreRefusedByTheirKind) {
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
  EXPECT_THAT(refusal(), AllOf(HasSubstr("another program"), HasSubstr("recipes")));
}

TEST_F(StoreTest, AStudyThatThisVersionDoesNotTakeIsLeftOutAndNamedAndTheOthersAreThere) {
  commit({study_of(10, 1, "too elastic"), study_of(10, 2, "b")});
  close();
  // Other versions may take an e that this one cannot solve.
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
  const auto studies = store().studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].name, "b");
  EXPECT_THAT(store().left_out(),
              ElementsAre(AllOf(HasSubstr("too elastic"), HasSubstr("e = 0.0001"))));
}

TEST_F(StoreTest, ARecipeThatCannotBeReadIsAnErrorThatNamesTheStudy) {
  commit({study_of(3)});
  close();
  by_hand("UPDATE studies SET recipe = x'ff'");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("recipe of study a"), HasSubstr("`oblique check`")));
}

TEST_F(StoreTest, CompletedPointsOfAStudyWithAConditionMayLackRows) {
  protocol::Recipe recipe = table_of(5)->recipe();
  recipe.mutable_blocks(0)->set_where("mu > 0.3");
  const AddStudy study{1, "a", std::make_shared<const protocol::PointTable>(recipe), "now"};
  commit({study, worker(1), solved(study, {2, 3, 4})});
  close();
  by_hand("UPDATE completed_ranges SET first_point = 0, points = 5");
  EXPECT_EQ(store().studies().at(0).settled, IntervalSet(0, 5));
}

/// Two studies, both done; the second has other points.
class NumbersByHandTest : public StoreFixture {
 protected:
  NumbersByHandTest() {
    const auto first = study_of(2, 1, "first");
    const auto second = study_of(5, 2, "second");
    commit({first, second, worker(1), solved(first, {0, 1}), solved(second, {0, 1, 2, 3, 4})});
    close();
  }
  std::uint64_t last_study_id() const { return Store(path_).last_study_id(); }
};

TEST_F(NumbersByHandTest, ANumberThatAnyTableNamesIsNotGivenToAnotherStudy) {
  by_hand("DELETE FROM studies WHERE study_id = 2");
  EXPECT_EQ(last_study_id(), 2U) << "its results are there";
  by_hand("DELETE FROM results WHERE study_id = 2");
  EXPECT_EQ(last_study_id(), 2U) << "completed_ranges names it";
  by_hand("DELETE FROM completed_ranges WHERE study_id = 2");
  EXPECT_EQ(last_study_id(), 1U);
  by_hand("INSERT INTO retries VALUES (3, 0, 1, 1, 'now')");
  EXPECT_EQ(last_study_id(), 3U);
  by_hand("INSERT INTO reused_points VALUES (4, 'gone', 1)");
  EXPECT_EQ(last_study_id(), 4U);
  by_hand("INSERT INTO deletions VALUES (5)");
  EXPECT_EQ(last_study_id(), 5U);
  by_hand("UPDATE about SET last_study_id = 6");
  EXPECT_EQ(last_study_id(), 6U);
}

TEST_F(NumbersByHandTest, AStudyWithTheResultsOfAnotherIsRefusedByNameAndWithTheWayOut) {
  EXPECT_EQ(refusal(), "it opened");
  by_hand("DELETE FROM studies WHERE study_id = 1; UPDATE studies SET study_id = 1");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("study \"second\""), HasSubstr("`oblique check")))
      << "the rows of the first one, which was deleted";
}

TEST_F(NumbersByHandTest, AStudyWithTheResultsOfALongerOneIsRefused) {
  commit({study_of(1, 3, "third")});  // its point is the first one of the second study
  close();
  by_hand(
      "DELETE FROM studies WHERE study_id = 2; UPDATE studies SET study_id = 2 WHERE study_id = 3");
  EXPECT_THAT(refusal(), HasSubstr("point 1: the study has no such point"));
}

TEST_F(NumbersByHandTest, AStudyWithTheResultsOfAnotherModelIsRefused) {
  solver::ModelParameters other = solver::preset("paper");
  other.E_Pa *= 2.0;
  protocol::Recipe recipe = table_of(5)->recipe();
  *recipe.mutable_model() = protocol::to_message(other);
  commit({AddStudy{3, "third", std::make_shared<const protocol::PointTable>(recipe), "now"}});
  close();
  by_hand(
      "DELETE FROM studies WHERE study_id = 2; UPDATE studies SET study_id = 2 WHERE study_id = 3");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("study \"third\""), HasSubstr("model")));
}

TEST_F(NumbersByHandTest, AStudyWhoseRowsMovedToAnotherNumberIsRefused) {
  by_hand("UPDATE results SET study_id = 7 WHERE study_id = 2");
  EXPECT_THAT(refusal(), HasSubstr("its row is gone"));
}

TEST_F(NumbersByHandTest, ANumberBelow1IsRefusedByTheNameOfItsStudy) {
  for (const char* number : {"0", "-1"}) {
    by_hand(std::string("UPDATE studies SET study_id = ") + number + " WHERE name = 'second'");
    EXPECT_THAT(refusal(),
                AllOf(HasSubstr(std::string("study \"second\" has the number ") + number),
                      HasSubstr("`oblique check`")));
  }
}

TEST_F(NumbersByHandTest, TheHighestNumberThatThereIsLeavesNoneForAnotherStudy) {
  by_hand("UPDATE studies SET study_id = 9223372036854775807 WHERE name = 'second'");
  EXPECT_THAT(refusal(), HasSubstr("no number is left"));
}

}  // namespace
}  // namespace oblique::server
