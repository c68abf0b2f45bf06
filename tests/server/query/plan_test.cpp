#include "server/asking/plan.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/result_message.h"
#include "server/asking/lists/list_functions.h"
#include "server/asking/question.h"
#include "server/asking/sql/sql_functions.h"
#include "server/asking/statement.h"
#include "server/database/open_for_reading.h"
#include "server/reading/reader.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/recipes.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Study "a" has points 0, 1, 2 and 4 of 5 (mu from 0 to 1), the last of them failed; "it's" has
/// one of 2.
class PlanTest : public testing::Test {
 protected:
  PlanTest() {
    Store store(path_);
    const auto a = table_of(5);
    const auto other = table_of(2);
    const std::vector<Change> changes{AddStudy{1, "a", a, "2024-01-01T00:00:00.000Z"},
                                      AddStudy{2, "it's", other, "2024-01-02T00:00:00.000Z"},
                                      AddResults{1,
                                                 a,
                                                 0,
                                                 "",
                                                 "",
                                                 1,
                                                 "now",
                                                 {solved_point(2), solved_point(0), solved_point(1),
                                                  protocol::failed_point(4, "no")}},
                                      AddResults{2, other, 0, "", "", 1, "now", {solved_point(1)}}};
    store.commit(changes);
  }

  static protocol::StudyQuery question(const std::string& select, const std::string& where = {}) {
    protocol::StudyQuery question;
    question.set_study("a");
    question.add_select(select);
    question.set_where(where);
    return question;
  }

  Plan plan_of(const protocol::StudyQuery& question) const {
    const auto database = open_for_reading(path_).database;
    add_functions(database.get());
    add_list_functions(database.get());
    return plan(database.get(), question);
  }

  /// The first value of each row, as a number.
  std::vector<double> answer(const protocol::StudyQuery& question) const {
    std::vector<double> values;
    const auto reply = Reader(path_).query(plan_of(question).statement, {});
    for (const auto& row : reply.rows()) {
      const auto& value = row.values(0);
      values.push_back(value.has_real() ? value.real() : static_cast<double>(value.integer()));
    }
    return values;
  }

  std::string objection(const protocol::StudyQuery& question) const {
    try {
      plan_of(question);
    } catch (const solver::InputError& error) {
      return error.what();
    }
    return {};
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
};

TEST_F(PlanTest, AStudyIsAnsweredInTheOrderOfItsPoints) {
  EXPECT_THAT(answer(question("point")), ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(answer(question("mu", "status = 'solved' AND mu > 0")), ElementsAre(0.25, 0.5));
}

TEST_F(PlanTest, WithoutColumnsTheAxesThatVaryAndTheMainOutputsAreAnswered) {
  protocol::StudyQuery all;
  all.set_study("a");
  std::vector<std::string> names;
  for (const PlannedColumn& column : plan_of(all).columns) {
    names.push_back(column.name);
  }
  EXPECT_THAT(names, ElementsAre("point", "mu", "status", "fn_peak_N", "ft_peak_N", "duration_s",
                                 "slide_m", "stick_total_s", "major_mode"));
  EXPECT_EQ(names, usual_columns(asked_study(open_for_reading(path_).database.get(), "a").recipe));
}

/// The axes among the usual columns.
std::vector<std::string> usual_axes(const protocol::Recipe& recipe) {
  auto columns = usual_columns(recipe);
  columns.erase(std::find(columns.begin(), columns.end(), "status"), columns.end());
  columns.erase(columns.begin());  // point
  return columns;
}

TEST(UsualColumns, HaveEveryKeyWithSeveralValuesInTheStudyAndNoOther) {
  using protocol::listed;
  using protocol::recipe_of;
  const auto H = listed("H", {1});
  const auto mu = listed("mu", {0.4});
  const auto e = listed("e", {1});
  EXPECT_THAT(usual_axes(recipe_of({{H, mu, e}})), IsEmpty());
  EXPECT_THAT(usual_axes(recipe_of({{listed("E", {7e10, 8e10}), listed("k", {1e7}), H,
                                     protocol::range("mu", 0, 1, 3), e}})),
              ElementsAre("mu", "E_Pa"));
  EXPECT_THAT(usual_axes(recipe_of({{H, mu, e}, {listed("H", {0.9}), mu, e}})), ElementsAre("H"))
      << "from block to block";
  EXPECT_THAT(usual_axes(recipe_of({{H, mu, e}, {listed("k", {1e7}), H, mu, e}})), ElementsAre("k"))
      << "in one of the blocks";
  EXPECT_THAT(usual_axes(recipe_of(
                  {{protocol::following("I", "A^2"), listed("length2", {0.3, 0.4}), H, mu, e}})),
              ElementsAre("I", "lengths_m"));
  EXPECT_THAT(usual_axes(protocol::recipe_of_blocks({protocol::sampled(
                  {protocol::uniform("rho", 2000, 3000), H, mu, protocol::uniform("e", 0.5, 1)},
                  protocol::SAMPLE_LATIN_HYPERCUBE, 10)})),
              ElementsAre("e", "rho"));
  EXPECT_THAT(usual_axes({}), ElementsAre("H", "mu", "e")) << "of a recipe that cannot be read";
}

TEST_F(PlanTest, AConditionCannotReachOtherStudies) {
  EXPECT_THAT(answer(question("point", "mu = 7 OR 1")), ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(answer(question("point", "study = 'it''s'")), IsEmpty());
  auto other = question("study_id");
  other.set_study("it's");
  EXPECT_THAT(answer(other), ElementsAre(2));
}

TEST_F(PlanTest, AnAnswerInTheOrderOfPointsGoesOnAfterOne) {
  auto first = question("mu");
  first.set_limit(2);
  const auto planned = plan_of(first);
  EXPECT_TRUE(planned.goes_on_by_point);
  EXPECT_THAT(planned.columns, ElementsAre(PlannedColumn{"mu", planned.columns[0].unit}));
  const auto rows = Reader(path_).query(planned.statement, {});
  ASSERT_EQ(rows.columns_size(), 2);
  ASSERT_EQ(rows.rows_size(), 2);
  EXPECT_EQ(rows.rows(1).values(1).integer(), 1);
  auto rest = question("point");
  rest.set_after_point(1);
  EXPECT_THAT(answer(rest), ElementsAre(2, 4));
}

TEST_F(PlanTest, AnAnswerGoesOnAfterAPointWhateverIsKnownOfTheRecipe) {
  {
    Store store(path_);
    const auto table = table_of(5);
    // As a damaged file has it: the recipe tells nothing of the points.
    const std::vector<Change> changes{
        AddStudy{3, "unread", StudyTable(std::string("\xff"), 5), "2024-01-03T00:00:00.000Z"},
        AddResults{
            3, table, 0, "", "", 1, "now", {solved_point(0), solved_point(1), solved_point(4)}}};
    store.commit(changes);
  }
  auto rest = question("point");
  rest.set_study("unread");
  EXPECT_THAT(answer(rest), ElementsAre(0, 1, 4));
  rest.set_after_point(0);
  EXPECT_THAT(answer(rest), ElementsAre(1, 4));
  rest.set_where("mu >= 0");
  EXPECT_THAT(answer(rest), ElementsAre(1, 4));
  rest.set_where("mu >= 0 OR 1");
  rest.set_after_point(4);
  EXPECT_THAT(answer(rest), IsEmpty());
}

TEST_F(PlanTest, WhatGathersOrSortsDoesNotGoOn) {
  for (const char* select : {"count(*)", "DISTINCT mode", "max(mu)", "avg ( mu )",
                             "row_number() OVER (ORDER BY mu)", "(SELECT max(mu) FROM runs)"}) {
    EXPECT_FALSE(plan_of(question(select)).goes_on_by_point) << select;
  }
  auto sorted = question("point");
  sorted.set_order("mu DESC");
  EXPECT_FALSE(plan_of(sorted).goes_on_by_point);
  EXPECT_THAT(answer(sorted), ElementsAre(4, 2, 1, 0));
}

TEST_F(PlanTest, AGroupIsARow) {
  auto grouped = question("status, count(*)");
  grouped.set_group("status");
  const auto planned = plan_of(grouped);
  EXPECT_FALSE(planned.goes_on_by_point);
  const auto reply = Reader(path_).query(planned.statement, {});
  const auto& rows = reply.rows();
  ASSERT_EQ(rows.size(), 2);
  EXPECT_EQ(rows[0].values(0).text(), "failed");
  EXPECT_EQ(rows[0].values(1).integer(), 1);
  EXPECT_EQ(rows[1].values(1).integer(), 3);
}

TEST_F(PlanTest, WhatIsWrongIsNamed) {
  EXPECT_THAT(objection(question("mu FROM runs --")), HasSubstr("--select"));
  EXPECT_THAT(objection(question("mu", "mu > 0.5 --")), HasSubstr("--where"));
  EXPECT_THAT(objection(question("mu", "E > 1")), HasSubstr("E_Pa"));
  EXPECT_THAT(objection(question("fn_peak")),
              AllOf(HasSubstr("no such column: fn_peak"), HasSubstr("fn_peak_N")));
  auto wrong = question("mu");
  wrong.set_group("mu ORDER BY 1");
  EXPECT_THAT(objection(wrong), HasSubstr("--group"));
  wrong.clear_group();
  wrong.set_order("mu LIMIT 1");
  EXPECT_THAT(objection(wrong), HasSubstr("--order"));
  wrong = question("mu");
  wrong.set_study("b");
  EXPECT_THAT(objection(wrong), HasSubstr("no study called \"b\""));
}

}  // namespace
}  // namespace oblique::server
