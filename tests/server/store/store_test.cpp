#include "server/store/store.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using StoreTest = StoreFixture;

TEST_F(StoreTest, WhatWasCommittedIsThereAfterReopening) {
  auto study = study_of(10);
  study.submitted_by = "alice";
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
  EXPECT_EQ(store().last_study_id(), 1U);
  EXPECT_EQ(store().last_worker_id(), 1U);
  EXPECT_EQ(store().database_id(), identity);
}

TEST_F(StoreTest, AnInterruptEndsALongStatement) {
  const auto study = study_of(100);
  commit({study, worker(1)});
  AddResults change = results_of(study, {});
  for (std::uint64_t point = 0; point < 100; ++point) {
    change.results.push_back(solved_point(point));
  }
  store().interrupt();
  EXPECT_THAT([&] { commit({change}); },
              testing::ThrowsMessage<StorageError>(HasSubstr("interrupted")));
}

TEST_F(StoreTest, AnEmptyDatabaseHasAnIdentityAndCountsStarts) {
  EXPECT_THAT(store().studies(), IsEmpty());
  EXPECT_EQ(store().last_study_id(), 0U);
  EXPECT_EQ(store().last_worker_id(), 0U);
  EXPECT_EQ(store().count_start(), 1U);
  EXPECT_NE(store().database_id(), Store(folder_.file("other.db")).database_id());
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
  commit({study, worker(1)});
  EXPECT_THROW(commit({solved(study, {0}), study_of(3, 2, "a")}), StorageError);
  commit({solved(study, {0})});
  EXPECT_EQ(store().studies().at(0).completed.size(), 1U);
  EXPECT_THAT(rows("SELECT 1 FROM results JOIN models USING (model_id)"), ElementsAre("1"))
      << "the model was rolled back, too";
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
  EXPECT_THAT(refusal(), HasSubstr("another program (application id 0)"));
}

TEST_F(StoreTest, AStudyThatThisVersionDoesNotAcceptIsSkippedAndNamed) {
  commit({study_of(10, 1, "too elastic"), study_of(10, 2, "b"), study_of(3, 3, "c")});
  close();
  // Other versions may take an e that this one cannot solve.
  auto recipe = table_of(10)->recipe();
  auto& e = *recipe.mutable_blocks(0)->mutable_axes(recipe.blocks(0).axes_size() - 1);
  ASSERT_EQ(e.key(), "e");
  e.clear_values();
  e.add_values(1e-4);
  {
    const auto database = open_database(path_, SQLITE_OPEN_READWRITE);
    execute_with(database.get(),
                 "UPDATE studies SET recipe = ?, checksum = NULL WHERE study_id = 1",
                 Blob{recipe.SerializeAsString()});
    execute(database.get(), "UPDATE studies SET name = CAST(x'61ff' AS TEXT) WHERE study_id = 3");
  }
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
  by_hand("UPDATE studies SET recipe = x'ff', checksum = NULL");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("recipe of study a"), HasSubstr("`oblique check")));
}

TEST_F(StoreTest, ANumberIsNeverGivenToAnotherStudy) {
  const auto study = study_of(5, 2);
  commit({study, solved(study, {0}), study_of(5, 3, "b")});
  close();
  by_hand("DELETE FROM studies");
  EXPECT_EQ(store().last_study_id(), 3U);
  by_hand("UPDATE results SET study_id = 7");
  EXPECT_EQ(store().last_study_id(), 7U) << "its rows would become those of the new study";
}

TEST_F(StoreTest, AStudyThatWasChangedByHandIsRefusedWithTheRemedy) {
  commit({study_of(2, 1, "first"), study_of(5, 2, "second")});
  close();
  for (const char* change :
       {"study_id = 3", "points = 6", "recipe = x'ff'", "errors = 1", "created_at = ''"}) {
    const std::string where = " WHERE name = 'second'";
    by_hand("CREATE TABLE before AS SELECT * FROM studies" + where);
    by_hand(std::string("UPDATE studies SET ") + change + where);
    EXPECT_THAT(refusal(), AllOf(HasSubstr("(\"second\")"), HasSubstr("SET checksum = NULL")))
        << change;
    by_hand("DELETE FROM studies" + where +
            "; INSERT INTO studies SELECT * FROM before; DROP TABLE before");
    EXPECT_EQ(refusal(), "it opened");
  }
  EXPECT_THROW(by_hand("UPDATE studies SET study_id = 0"), StorageError);
  EXPECT_THROW(by_hand("UPDATE studies SET study_id = 9223372036854775807"), StorageError);
}

}  // namespace
}  // namespace oblique::server
