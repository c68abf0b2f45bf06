#include "server/query/plan.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "server/database/database_file.h"
#include "server/query/columns.h"
#include "server/query/reader.h"
#include "server/query/sql_text.h"
#include "tests/server/store/store_fixture.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Provides two studies. Study "a" has ten solved points with e = 1, H = 1 and mu from 0 to 1.
/// Study "it's" has five points, of which 0, 1 and 2 are solved and 4 has failed.
class PlanTest : public StoreFixture {
 protected:
  PlanTest() {
    const auto all = study_of(10);
    const auto some = study_of(5, 2, "it's");
    commit({all, some, worker(1), solved(all, numbers(0, 10)), solved(some, {2, 0, 1}),
            failed(some, {4})});
    open();
  }
  void open() {
    database_ = open_for_reading(path_);
    restrict_to_reading(database_.get());
  }
  void edit(const std::string& sql) {
    database_.reset();
    execute_sql(sql);
    open();
  }

  static protocol::StudyQuery question(const std::string& select, const std::string& where = {},
                                       const std::string& group = {},
                                       const std::string& order = {}) {
    protocol::StudyQuery question;
    question.set_study("a");
    if (!select.empty()) {
      question.add_select(select);
    }
    question.set_where(where);
    question.set_group(group);
    question.set_order(order);
    return question;
  }
  static protocol::StudyQuery of_other(protocol::StudyQuery question) {
    question.set_study("it's");
    return question;
  }

  /// Returns the first value of each row as text, and an empty text for NULL.
  std::vector<std::string> texts(const std::string& sql) const {
    auto values = rows(database_.get(), sql);
    for (std::string& value : values) {
      value.resize(std::min(value.find('|'), value.size()));
    }
    return values;
  }
  std::vector<std::string> texts(const protocol::StudyQuery& query) const {
    return texts(plan(database_.get(), query).sql);
  }
  /// Returns the output of EXPLAIN QUERY PLAN for a study query.
  std::string steps_of(const protocol::StudyQuery& query) const {
    return fmt::format("{}", fmt::join(rows(database_.get(), "EXPLAIN QUERY PLAN " +
                                                                 plan(database_.get(), query).sql),
                                       "; "));
  }
  double number(const protocol::StudyQuery& query) const {
    Statement statement(database_.get(), plan(database_.get(), query).sql);
    return statement.step() ? statement.real(0) : -1.0;
  }
  double number(const std::string& select, const std::string& where = {}) const {
    return number(question(select, where));
  }
  PlannedColumn column(const std::string& select) const {
    return plan(database_.get(), question(select)).columns.at(0);
  }
  /// Returns the error message, or an empty text if the query is valid.
  std::string error(const protocol::StudyQuery& query) const {
    try {
      plan(database_.get(), query);
    } catch (const solver::InputError& error) {
      return error.what();
    }
    return {};
  }
  std::string error(const std::string& select, const std::string& where = {},
                    const std::string& group = {}, const std::string& order = {}) const {
    return error(question(select, where, group, order));
  }

  DatabaseHandle database_;
};

TEST_F(PlanTest, RowsAreInTheOrderOfPointsUnlessAnotherIsRequested) {
  EXPECT_THAT(texts(of_other(question("point"))), ElementsAre("0", "1", "2", "4"));
  EXPECT_THAT(texts(of_other(question("mu", "status = 'solved' AND mu > 0"))),
              ElementsAre("0.25", "0.5"));
  EXPECT_THAT(texts(of_other(question("point", "", "", "mu DESC"))),
              ElementsAre("4", "2", "1", "0"));
  EXPECT_THAT(texts(of_other(question("status || count(*)", "", "status"))),
              ElementsAre("failed1", "solved3"));
}

TEST_F(PlanTest, AConditionCannotReachOtherStudies) {
  EXPECT_THAT(texts(of_other(question("point", "mu = 7 OR 1"))), ElementsAre("0", "1", "2", "4"));
  EXPECT_THAT(texts(question("point", "study = 'it''s'")), IsEmpty());
  EXPECT_THAT(texts(of_other(question("DISTINCT study || study_id"))), ElementsAre("it's2"));
  edit("UPDATE studies SET recipe = x'ff'");
  EXPECT_THAT(texts(of_other(question("point", "mu > 0"))), ElementsAre("1", "2", "4"))
      << "an unreadable recipe gives no ranges";
}

TEST_F(PlanTest, AStarIsAllColumnsOfTheViewAndTheListsOfSolve) {
  const auto columns = plan(database_.get(), question("*, phases[0].t1_s")).columns;
  constexpr std::size_t kListsOfSolve = 4;
  const StatementHandle runs = prepare_query(database_.get(), "SELECT * FROM runs");
  const int in_view = sqlite3_column_count(runs.get());
  ASSERT_EQ(columns.size(), static_cast<std::size_t>(in_view) + kListsOfSolve + 1);
  for (int i = 0; i < in_view; ++i) {
    EXPECT_EQ(columns[static_cast<std::size_t>(i)].name, sqlite3_column_name(runs.get(), i));
  }
  EXPECT_EQ(columns.back().name, "phases[0].t1_s");
}

/// Returns the axes among the columns that a study query selects by default.
std::vector<std::string> usual_axes(const protocol::Recipe& recipe) {
  auto columns = usual_columns(recipe);
  columns.erase(std::find(columns.begin(), columns.end(), "status"), columns.end());
  columns.erase(columns.begin());  // point
  return columns;
}

TEST(UsualColumns, ContainExactlyTheKeysThatVaryInTheStudy) {
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
      << "H varies between blocks";
  EXPECT_THAT(usual_axes(recipe_of({{H, mu, e}, {listed("k", {1e7}), H, mu, e}})), ElementsAre("k"))
      << "k is set in only one of the blocks";
  EXPECT_THAT(usual_axes(recipe_of(
                  {{protocol::following("I", "A^2"), listed("length2", {0.3, 0.4}), H, mu, e}})),
              ElementsAre("I", "lengths_m"));
  EXPECT_THAT(usual_axes({}), ElementsAre("H", "mu", "e")) << "an unreadable recipe";
}

TEST_F(PlanTest, FunctionsAggregateTheNumbersOfRows) {
  EXPECT_DOUBLE_EQ(number("median(point)"), 4.5);
  EXPECT_DOUBLE_EQ(number("median(point)", "point < 3"), 1.0);
  EXPECT_DOUBLE_EQ(number("median(nullif(point, 9))"), 4.0);
  EXPECT_DOUBLE_EQ(number("stddev(point)"), std::sqrt(82.5 / 9.0));
  EXPECT_DOUBLE_EQ(number("stddev(point) IS NULL", "point = 3"), 1.0);
  EXPECT_DOUBLE_EQ(number("median(point) IS NULL AND stddev(point) IS NULL", "point < 0"), 1.0);
  EXPECT_EQ(number("count_mode('SC SR') - count_mode('x')"), 10.0);
  EXPECT_THAT(error("count_mode(mu)"), HasSubstr("count_mode('SC SR')"));
  EXPECT_THROW(texts("SELECT median('x') FROM results"), StorageError);
}

TEST_F(PlanTest, CorrIsPearsonsCorrelationOfRowsWithBothValues) {
  // The values 0, 1, 2 and 0, 1, 4 have the covariance 2 and the variances 1 and 13/3.
  EXPECT_NEAR(number("corr(point, point * point)", "point < 3"), 2.0 / std::sqrt(13.0 / 3.0),
              1e-15);
  EXPECT_NEAR(number("corr(nullif(point, 9), nullif(point * point, 64))"),
              number("corr(point, point * point)", "point NOT IN (8, 9)"), 1e-15);
  EXPECT_DOUBLE_EQ(number("corr(1e9 + point, -point)"), -1.0) << "large values caused cancellation";
  EXPECT_DOUBLE_EQ(number("corr(point, 7) IS NULL"), 1.0) << "one of the values is constant";
}

TEST_F(PlanTest, ElementsEqualThoseOfTheListsInTheView) {
  edit(
      "UPDATE results SET peaks = '[]', ft_peaks = '[]', phases = '[]', stick_intervals = '[]',"
      " reaction_peaks = '[]' WHERE point = 1;"
      "UPDATE results SET ft_peaks = NULL WHERE point IN (2, 3);"
      "UPDATE results SET phases = '[1e-5]' WHERE point = 3;"
      "UPDATE results SET phases = '[1.0e-05,2e-5,3e-5,4e-5,5e-5]' WHERE point = 4");
  const std::vector<std::pair<const char*, std::vector<const char*>>> lists{
      {"peaks", {"t_s", "fn_N", "ft_N", "major"}},
      {"ft_peaks", {"t_s", "ft_N"}},
      {"phases", {"kind", "t0_s", "t1_s"}},
      {"stick_intervals", {"t0_s", "t1_s"}},
      {"reaction_peaks", {"t_s", "force_N"}}};
  const auto expect_same = [&](const std::string& written, const std::string& sql) {
    const auto shown = texts("SELECT " + sql + " FROM runs WHERE study = 'a' ORDER BY point");
    EXPECT_EQ(texts(question(written)), shown) << written;
    // Only the view has the column `links`, so this query reads the view.
    EXPECT_EQ(texts(question(written + ", links")), shown) << written;
  };
  for (const auto& [list, members] : lists) {
    expect_same(fmt::format("{}.count", list), fmt::format("json_array_length({})", list));
    for (int i = -4; i <= 4; ++i) {
      const std::string path = i < 0 ? fmt::format("$[#{}]", i) : fmt::format("$[{}]", i);
      for (std::size_t member = 0; member < members.size(); ++member) {
        const bool is_number = !unit_of_member(members[member]).empty();
        const std::string value = fmt::format("{} ->> '{}[{}]'", list, path, member);
        expect_same(fmt::format("{}[{}].{}", list, i, members[member]),
                    is_number ? "CAST(" + value + " AS REAL)" : value);
      }
      expect_same(fmt::format("{}[{}]", list, i), fmt::format("{} -> '{}'", list, path));
    }
  }
  EXPECT_EQ(number("count(phases[2].t1_s)"), 8.0);
  EXPECT_EQ(number("count(phases[-4].kind)"), 1.0);
  EXPECT_EQ(number(of_other(question("count(peaks.count)"))), 3.0) << "a failed point has no lists";
}

TEST_F(PlanTest, ListsOfSolveHaveTheNumbersOfTheViews) {
  edit("UPDATE results SET ft_peaks = NULL WHERE point = 2");
  const auto numbers = [&](const char* column, const char* from) {
    return texts(
        fmt::format("SELECT (SELECT json_group_array({}) FROM {}) FROM runs WHERE study = "
                    "'a' ORDER BY point",
                    column, from));
  };
  const auto fn_N = numbers("value ->> 1", "json_each(runs.peaks)");
  EXPECT_EQ(texts(question("fn_peaks_N")), fn_N);
  EXPECT_EQ(texts(question("fn_peaks_N, links")), fn_N);
  EXPECT_EQ(texts(question("major_peaks_N")),
            numbers("value ->> 1", "json_each(runs.peaks) WHERE value ->> 3"));
  EXPECT_EQ(texts(question("ft_peaks_N")), numbers("value ->> 1", "json_each(runs.ft_peaks)"));
  EXPECT_EQ(texts(question("stick_intervals_s")), texts(question("stick_intervals")));
  EXPECT_EQ(texts(question("fn_peaks_N[-1]")), texts(question("peaks[-1].fn_N")));
  EXPECT_EQ(texts(question("lengths_m[0]")), texts(question("length")));
  EXPECT_THAT(texts(of_other(question("fn_peaks_N || ft_peaks_N", "point = 4"))), ElementsAre(""));
}

TEST_F(PlanTest, ElementsMayBeInEveryPartOfAQuery) {
  EXPECT_EQ(number("count(*)", "peaks[1].fn_N > 0 AND stick_intervals.count = 1"), 10.0);
  EXPECT_EQ(number(question("point", "", "", "phases[0].t1_s DESC")), 9.0);
  EXPECT_THAT(texts(question("peaks.count * count(*)", "", "peaks.count")), ElementsAre("20"));
  EXPECT_EQ(number("max(peaks[0].fn_N) - max(fn_peaks_N[0])"), 0.0);
  EXPECT_EQ(texts(question("peaks [0]")), texts(question("peaks[0]")));
  EXPECT_THAT(error("peaks [x]"), HasSubstr("whole number"));
  EXPECT_EQ(column("peaks[1].fn_N").name, "peaks[1].fn_N");
  EXPECT_EQ(column("peaks[1].fn_N").unit, "N");
  EXPECT_EQ(column("peaks[1].fn_N AS second").name, "second");
  EXPECT_THAT(error("peaks[0].fn"), AllOf(HasSubstr("peaks[0].fn"), HasSubstr("fn_N")));
  EXPECT_THAT(error("peaks[x].fn_N"), HasSubstr("whole number"));
  EXPECT_THAT(error("peaks[0.5].fn_N"), HasSubstr("whole number"));
}

TEST_F(PlanTest, WholeNumbersInListsAreDividedAsRealNumbers) {
  edit("UPDATE results SET peaks = '[[0,3,1,1],[1,2,1,1]]', phases = '[3,2]' WHERE point = 1");
  for (const char* ratio : {"peaks[0].fn_N / peaks[1].fn_N", "fn_peaks_N[0] / fn_peaks_N[1]",
                            "phases[0].t1_s / phases[1].t1_s"}) {
    EXPECT_EQ(number(ratio, "point = 1"), 1.5) << ratio;
  }
}

TEST_F(PlanTest, OnlyQueriesThatNameAModelOrWorkerReadTheirTables) {
  const auto reads_models = [&](const std::string& select, const std::string& group) {
    const auto sql = plan(database_.get(), question(select, "", group)).sql;
    return sql.find(" runs AS runs") != std::string::npos;
  };
  EXPECT_FALSE(reads_models("e, avg(fn_peak_N), max(peaks[0].fn_N), max(phases[0].t1_s)", "e"));
  EXPECT_FALSE(reads_models("study, status, major_mode, fn_peaks_N", ""));
  EXPECT_TRUE(reads_models("k, avg(fn_peak_N)", "k"));
  EXPECT_TRUE(reads_models("worker_name", ""));
  EXPECT_TRUE(reads_models("phases", ""));
}

TEST_F(PlanTest, PointsThatAConditionNamesAreLookedUpAndFailedOnesByTheirIndex) {
  EXPECT_THAT(steps_of(question("fn_peak_N", "point IN (3, 1)")),
              HasSubstr("(study_id=? AND point=?)"));
  EXPECT_THAT(steps_of(question("fn_peak_N", "point >= 3 AND point < 5")),
              HasSubstr("(study_id=? AND point>? AND point<?)"));
  for (const char* select : {"point", "point, k"}) {
    const auto failed = of_other(question(select, "mu > 0 AND error IS NOT NULL"));
    EXPECT_THAT(steps_of(failed), HasSubstr("failed_points"));
    EXPECT_THAT(texts(failed), ElementsAre("4"));
  }
  EXPECT_THAT(texts(of_other(question("point", "error IS NOT NULL OR mu = 0"))),
              ElementsAre("0", "4"));
}

TEST_F(PlanTest, UnitsFollowFromThoseOfColumns) {
  EXPECT_EQ(column("avg(fn_peak_N)").unit, "N");
  EXPECT_EQ(column("median(slide_m)").unit, "m");
  EXPECT_EQ(column("max(reaction_peaks[0].t_s) AS last").unit, "s");
  for (const char* other : {"count(fn_peak_N)", "fn_peak_N / 1000", "mode", "fn_peak_N + slide_m",
                            "peaks", "fn_peak_N > 3"}) {
    EXPECT_EQ(column(other).unit, "") << other;
  }
}

TEST_F(PlanTest, AGroupedQuerySelectsOnlyKeysOrAggregates) {
  const std::pair<const char*, const char*> right[] = {
      {"major_mode, count(*), avg(fn_peak_N)", "major_mode"},
      {"round(mu, 1) AS m, max(fn_peak_N)", "m"},
      {"round(mu, 1), max(fn_peak_N) / 1000", "round(mu, 1)"},
      {"peaks.count, count(*) FILTER (WHERE e = 1)", "peaks.count"},
      {"median(mu), max(mu) - min(mu), 1", ""},
      {"mu, max(mu, e)", ""},
      {"mu, avg(mu) OVER ()", ""},
      {"mu, (SELECT max(mu) FROM runs) AS most", ""},
      {"(SELECT max(mu) FROM runs), max(mu)", ""}};
  for (const auto& [select, group] : right) {
    EXPECT_EQ(error(select, "", group), "") << select;
  }
  const struct {
    const char* select;
    const char* group;
    const char* message;
  } wrong[] = {{"mu, count(*)", "e", "mu has many"},
               {"*", "e", "* has many"},
               {"e, max(mu, H)", "e", "mu has many"},
               {"peaks[0].fn_N", "e", "peaks has many"},
               {"median(mu), mode", "", "mode has many values"},
               {"mu, count(*) FILTER (WHERE e = 1)", "", "mu has many"},
               {"*, count(*)", "", "* has many"},
               {"H, MU, count(*)", "H", "MU is not a column, and SQL ignores case: write mu"}};
  for (const auto& [select, group, message] : wrong) {
    EXPECT_THAT(error(select, "", group), AllOf(HasSubstr("--select"), HasSubstr(message)));
  }
}

TEST_F(PlanTest, ErrorsHaveTheFlagAndTheNearestName) {
  const struct {
    protocol::StudyQuery query;
    const char* flag;
    const char* message;
  } wrong[] = {
      {question("media(mu)"), "--select", "did you mean `median`?"},
      {question("mode, count"), "--select", "did you mean `count`?"},
      {question("peaks.cnt"), "--select", "`peaks.count`"},
      {question("stik_total_s"), "`stick_total_s`", "oblique columns"},
      {question("count(*)", "\"mux\" > 0.5"), "did you mean `mu`", "write texts in single quotes"},
      {question("mu", "major_mode = \"SC\""), "--where \"major_mode", "SC"},
      {question("mu", "", "", "\"mux\""), "--order \"\"mux\"\"", ""},
      {question("count(*)", "", "\"mux\""), "--group \"\"mux\"\"", ""},
      {question("mu FROM runs --"), "--select", ""},
      {question("mu", "mu > 0.5 --"), "--where", ""},
      {question("mu", "", "mu ORDER BY 1"), "--group", ""},
      {question("mu", "", "", "mu LIMIT 1"), "--order", ""},
      {question("mu", "mu >"), "--where \"mu >\"", ""},
      {question("mu +"), "--select \"mu +\"", ""},
      {question("mu", "mu = = 1"), "--where \"mu = = 1\"", ""},
      {question("mu", "", "", "mu DESC DESC"), "--order \"mu DESC DESC\"", ""}};
  for (const auto& [query, flag, message] : wrong) {
    EXPECT_THAT(error(query), AllOf(HasSubstr(flag), HasSubstr(message))) << query.DebugString();
  }
  for (const char* text : {"E > 1", "\"E\" > 1", "abs([E]) > 1", "e = 1 AND -E > 1"}) {
    EXPECT_THAT(error("mu", text), AllOf(HasSubstr("--where"), HasSubstr("write e, or E_Pa")))
        << text;
  }
  EXPECT_THAT(error("mu", "", "", "\"Fn_Peak_N\""),
              AllOf(HasSubstr("--order"), HasSubstr("write fn_peak_N")));
  EXPECT_EQ(error("H AS h, LENGTH(mode)", "", "", "h DESC"), "");
  EXPECT_THAT(error("peak[0].fn_N"), HasSubstr("peak is not a list"));
  EXPECT_THAT(error("peaks[0].fn_M"), HasSubstr("did you mean `fn_N`"));
  EXPECT_THAT(error("xyzzy"), Not(HasSubstr("did you mean")));
  EXPECT_EQ(error("mu [0], mu AS \"my mu\", \"e\""), "");
  EXPECT_EQ(number("count(*)", "\"mu\" > 0.5"), number("count(*)", "mu > 0.5"));
  auto unknown = question("mu");
  unknown.set_study("b");
  EXPECT_THAT([&] { plan(database_.get(), unknown); },
              testing::ThrowsMessage<NoSuchStudy>(HasSubstr("no study called \"b\"")));
}

TEST_F(PlanTest, NumbersInEveryClauseEqualTheTypedNumbers) {
  // SQLite 3.40 parses each of these texts as a double next to the nearest one.
  for (const char* typed : {"0.1166477", "0.6341252", "0.2611956", "0.863579242346664"}) {
    EXPECT_EQ(number(typed), std::stod(typed));
    EXPECT_EQ(number(std::string("DISTINCT ") + typed), std::stod(typed));
  }
  EXPECT_EQ(column("DISTINCT 0.1166477 * mu").name, "0.1166477 * mu");
  EXPECT_EQ(column("0.1166477 AS \"x y\"").name, "x y");
  // If 0.1166477 and 1166477 / 1e7 are equal, the condition holds for exactly one row.
  const std::string is_it = "point = 3 AND 0.1166477 = 1166477 / 1e7";
  EXPECT_EQ(number(question("count(*)", "", is_it)), 9.0);
  EXPECT_EQ(number(question("point", "", "", is_it + " DESC")), 3.0);
}

/// Returns the error message for a condition, or an empty text if the condition is allowed.
std::string condition_error(const std::string& text) {
  try {
    check_sql_part("--where", text);
  } catch (const solver::InputError& error) {
    return error.what();
  }
  return {};
}

TEST(SqlPart, ExpressionsAreAllowed) {
  for (const char* text :
       {"mu > 0.5 AND (e = 1 OR e < .5)", "mode = 'sC -- sR; /* ? */'", "H=1E5",
        "mu BETWEEN 0x1F AND 1e-3", "abs(mu-.5) < 1.E-3", "mode = 'it''s'",
        "mu IN (SELECT max(mu) FROM runs WHERE e = 1 ORDER BY 1 LIMIT 1)",
        "mu IS NOT DISTINCT FROM e", "\"mu\" > 1 AND [e] = 1 AND `k` > 2",
        "CASE WHEN mu > 1 THEN e ELSE H END > .5", "x'0aE1' = mode", "mode || ':x' = '?'",
        "mode->>'$[0]' = 1", "*", "count(*), max(mu) AS m", "mu DESC, e NULLS LAST"}) {
    EXPECT_EQ(condition_error(text), "") << text;
  }
}

TEST(SqlPart, NothingCanChangeTheStatementAroundIt) {
  const std::pair<std::string, const char*> wrong[] = {
      {"mu > 0.5 --", "it has a comment (--)"},
      {"mu /* x */ > 0.5", "it has a comment (/*)"},
      {"mu > ?1", "it has a parameter (?)"},
      {"mu > :x", "it has a parameter (:)"},
      {"mu > @x", "it has a parameter (@)"},
      {"mu > $x", "it has a parameter ($)"},
      {"mu > #1", "it has a parameter (#)"},
      {"mu > 0.5; SELECT 1", "it has a semicolon"},
      {"mu > 0.5) OR (1", "closing bracket has no opening one"},
      {"(mu > 0.5", "bracket is not closed"},
      {"mode = 'x'' --", "the quote ' is not closed"},
      {"\"mu > 1", "the quote \" is not closed"},
      {"[mu > 1", "the quote [ is not closed"},
      {"x'00 > 1", "the quote ' is not closed"},
      {"mu FROM runs", "FROM outside brackets"},
      {"mu > 0.5 ORDER BY mu", "ORDER outside brackets"},
      {"1 LIMIT 1", "LIMIT outside brackets"},
      {"1 union select 1", "union outside brackets"},
      {" ", "it is empty"},
      {std::string("mu\0> 1", 6), "zero byte"},
      {"mu > 1 AND \xEF\xBB\xBFmu", "it has a byte-order mark"},
      {"mu > 1 AND (" + std::string(100'000, '1'), "--where \"mu > 1 AND (111"}};
  for (const auto& [text, message] : wrong) {
    EXPECT_THAT(condition_error(text), HasSubstr(message)) << text;
    EXPECT_LT(condition_error(text).size(), 1000U);
  }
}

}  // namespace
}  // namespace oblique::server
