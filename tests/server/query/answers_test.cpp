#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/asking/plan.h"
#include "server/database/open_for_reading.h"
#include "server/reading/query_rules.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Study "a" has ten solved points, e = 1, H = 1, mu from 0 to 1.
class Answers : public testing::Test {
 protected:
  Answers() {
    Store store(path_);
    const auto table = table_of(10);
    AddResults results{1, table, 0, "", "", 1, "now", {}};
    for (std::uint64_t point = 0; point < 10; ++point) {
      results.results.push_back(solved_point(point));
    }
    store.commit(std::vector<Change>{AddStudy{1, "a", table, "2024-01-01T00:00:00.000Z"}, results});
    database_ = open_for_reading(path_).database;
    restrict_to_reading(database_.get());
  }

  static protocol::StudyQuery question(const std::string& select, const std::string& where = {},
                                       const std::string& group = {}) {
    protocol::StudyQuery question;
    question.set_study("a");
    question.add_select(select);
    question.set_where(where);
    question.set_group(group);
    return question;
  }

  double number(const protocol::StudyQuery& asked) const {
    Statement statement(database_.get(), plan(database_.get(), asked).statement);
    return statement.step() ? statement.real(0) : -1.0;
  }
  double number(const std::string& select, const std::string& where = {}) const {
    return number(question(select, where));
  }
  /// The same by plain SQL.
  double plain(const std::string& sql) const {
    Statement statement(database_.get(), sql);
    return statement.step() ? statement.real(0) : -1.0;
  }
  PlannedColumn column(const std::string& select) const {
    return plan(database_.get(), question(select)).columns.at(0);
  }

  std::string objection(const protocol::StudyQuery& asked) const {
    try {
      plan(database_.get(), asked);
    } catch (const solver::InputError& error) {
      return error.what();
    }
    return {};
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  DatabaseHandle database_;
};

TEST_F(Answers, FunctionsGatherTheNumbersOfRows) {
  EXPECT_DOUBLE_EQ(number("median(point)"), 4.5);
  EXPECT_DOUBLE_EQ(number("median(point)", "point < 3"), 1.0);
  EXPECT_DOUBLE_EQ(number("percentile(point, 0)"), 0.0);
  EXPECT_DOUBLE_EQ(number("percentile(point, 100)"), 9.0);
  EXPECT_DOUBLE_EQ(number("percentile(point, 25)"), 2.25);
  EXPECT_DOUBLE_EQ(number("variance(point)"), 82.5 / 9.0);
  EXPECT_DOUBLE_EQ(number("stddev(point)"), std::sqrt(82.5 / 9.0));
  EXPECT_DOUBLE_EQ(number("median(point)", "point = 3"), 3.0);
  EXPECT_DOUBLE_EQ(number("stddev(point) IS NULL", "point = 3"), 1.0);
  EXPECT_DOUBLE_EQ(number("median(point) IS NULL AND variance(point) IS NULL", "point < 0"), 1.0);
  EXPECT_DOUBLE_EQ(number("median(nullif(point, 9))"), 4.0);
}

TEST_F(Answers, CorrIsPearsonsCorrelationOfTheRowsThatHaveBoth) {
  EXPECT_DOUBLE_EQ(number("corr(point, 3 - 2 * point)"), -1.0);
  // Of 0, 1, 2 with 0, 1, 4: covariance 2, variances 1 and 13/3.
  EXPECT_NEAR(number("corr(point, point * point)", "point < 3"), 2.0 / std::sqrt(13.0 / 3.0),
              1e-15);
  EXPECT_NEAR(number("corr(nullif(point, 9), nullif(point * point, 64))", "point NOT IN (3, 4)"),
              number("corr(point, point * point)", "point NOT IN (3, 4, 8, 9)"), 1e-15);
  EXPECT_DOUBLE_EQ(number("corr(1e9 + point, point)"), 1.0) << "without cancellation";
  EXPECT_DOUBLE_EQ(number("corr(point, 7) IS NULL"), 1.0) << "one of them does not vary";
  EXPECT_DOUBLE_EQ(number("corr(point, mu) IS NULL", "point = 3"), 1.0);
}

TEST_F(Answers, FunctionsRefuseWhatIsNoNumber) {
  const auto failure = [&](const std::string& expression) -> std::string {
    try {
      plain("SELECT " + expression + " FROM results");
    } catch (const StorageError& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_THAT(failure("median('x')"), HasSubstr("take numbers"));
  EXPECT_THAT(failure("stddev(x'00')"), HasSubstr("take numbers"));
  EXPECT_THAT(failure("corr(mu, 'x')"), HasSubstr("take numbers"));
  EXPECT_THAT(failure("percentile(mu, 101)"), HasSubstr("from 0 to 100"));
  EXPECT_THAT(failure("percentile(mu, 'x')"), HasSubstr("from 0 to 100"));
  EXPECT_THAT(failure("percentile(mu, point)"), HasSubstr("one percentage"));
}

TEST_F(Answers, WhatAFunctionKeepsIsBoundedByTheLimitOnMemory) {
  const std::int64_t before = sqlite3_hard_heap_limit64(std::int64_t{16} << 20U);
  Statement statement(database_.get(),
                      "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c LIMIT "
                      "4000000) SELECT median(x) FROM c");
  EXPECT_THROW(statement.step(), StorageError);
  statement.reset();
  sqlite3_hard_heap_limit64(before);
  EXPECT_EQ(number("median(point)"), 4.5);
}

TEST_F(Answers, ElementsOfListsCountFromZero) {
  const auto view = [&](const std::string& column, const std::string& list, int seq) {
    return plain("SELECT " + column + " FROM " + list +
                 " WHERE point = 4 AND seq = " + std::to_string(seq));
  };
  const std::string at = "point = 4";
  EXPECT_EQ(number("peaks[1].fn_N", at), view("fn_N", "peaks", 1));
  EXPECT_EQ(number("peaks[-1].t_s", at), view("t_s", "peaks", 1));
  EXPECT_EQ(number("phases[2].t1_s", at), view("t1_s", "phases", 2));
  EXPECT_EQ(number("stick_intervals[0].t1_s", at), view("t1_s", "stick_intervals", 0));
  EXPECT_EQ(number("reaction_peaks[2].force_N", at), view("force_N", "reaction_peaks", 2));
  EXPECT_EQ(number("peaks.count", at), 2.0);
  EXPECT_EQ(number("peaks[7].fn_N IS NULL", at), 1.0);
  EXPECT_EQ(number("fn_peaks_N[0]", at), view("fn_N", "peaks", 0));
  EXPECT_EQ(number("count(*)", "peaks[1].fn_N > 0 AND stick_intervals.count = 1"), 10.0);
  EXPECT_EQ(column("peaks[1].fn_N"), (PlannedColumn{"peaks[1].fn_N", "N"}));
  EXPECT_EQ(column("peaks[1].fn_N AS second").name, "second");
  EXPECT_THAT(objection(question("peaks[0].fn")),
              AllOf(HasSubstr("peaks[0].fn"), HasSubstr("fn_N")));
  EXPECT_THAT(objection(question("peaks[x].fn_N")), HasSubstr("whole number"));
}

TEST_F(Answers, ModesAreCounted) {
  EXPECT_EQ(number("count_mode('SC SR')"), 10.0);
  EXPECT_EQ(number("count_mode('x')"), 0.0);
  EXPECT_THAT(objection(question("count_mode(mu)")), HasSubstr("count_mode('SC SR')"));
}

TEST_F(Answers, UnitsFollowFromThoseOfColumns) {
  EXPECT_EQ(column("avg(fn_peak_N)").unit, "N");
  EXPECT_EQ(column("percentile(slide_m, 90)").unit, "m");
  EXPECT_EQ(column("max(reaction_peaks[0].t_s)").unit, "s");
  for (const char* other : {"count(fn_peak_N)", "fn_peak_N / 1000", "mode", "fn_peak_N + slide_m",
                            "peaks", "fn_peak_N > 3", "variance(duration_s)"}) {
    EXPECT_EQ(column(other).unit, "") << other;
  }
}

TEST_F(Answers, AGroupHasOneValueOfWhatItIsAskedFor) {
  const auto said = [&](const std::string& select, const std::string& group) {
    return objection(question(select, "", group));
  };
  EXPECT_EQ(said("major_mode, count(*), avg(fn_peak_N)", "major_mode"), "");
  EXPECT_EQ(said("round(mu, 1) AS m, max(fn_peak_N)", "m"), "");
  EXPECT_EQ(said("round(mu, 1), max(fn_peak_N) / 1000", "round(mu, 1)"), "");
  EXPECT_EQ(said("peaks.count, count(*) FILTER (WHERE e = 1)", "peaks.count"), "");
  EXPECT_EQ(said("mu + e, count(*)", "mu, e"), "");
  EXPECT_THAT(said("mu, count(*)", "e"), AllOf(HasSubstr("--select"), HasSubstr("mu has many")));
  EXPECT_THAT(said("*", "e"), HasSubstr("* has many"));
  EXPECT_THAT(said("e, max(mu, H)", "e"), HasSubstr("mu has many"));
  EXPECT_THAT(said("peaks[0].fn_N", "e"), HasSubstr("peaks[0].fn_N has many"));
  auto sorted = question("e, count(*)", "", "e");
  sorted.set_order("mu");
  EXPECT_THAT(objection(sorted), AllOf(HasSubstr("--order"), HasSubstr("mu has many")));
  sorted.set_order("count(*) DESC");
  EXPECT_EQ(objection(sorted), "");
}

TEST_F(Answers, AColumnBesideWhatMakesOneRowOfAllIsRefused) {
  const auto said = [&](const std::string& select) { return objection(question(select)); };
  EXPECT_THAT(
      said("median(mu), mode"),
      AllOf(HasSubstr("--select"), HasSubstr("mode has many values"), HasSubstr("--group")));
  EXPECT_THAT(said("mu, count(*) FILTER (WHERE e = 1)"), HasSubstr("mu has many"));
  EXPECT_THAT(said("*, count(*)"), HasSubstr("* has many"));
  EXPECT_THAT(said("peaks[0].fn_N, avg(mu)"), HasSubstr("peaks[0].fn_N has many"));
  EXPECT_THAT(said("max(fn_peak_N), point"), HasSubstr("point has many"));
  for (const char* right :
       {"median(mu), max(mu) - min(mu), 1", "count(*)", "mu, e", "mu, max(mu, e)",
        "mu, avg(mu) OVER ()",
        "mu, avg(mu) OVER (ORDER BY mu RANGE BETWEEN 0.05 PRECEDING AND 0.05 FOLLOWING)",
        "mu, (SELECT max(mu) FROM runs) AS most"}) {
    EXPECT_EQ(said(right), "") << right;
  }
}

TEST_F(Answers, WhatIsMisspeltIsNamedWithTheNearest) {
  const auto said = [&](const std::string& select) { return objection(question(select)); };
  EXPECT_THAT(said("media(mu)"), HasSubstr("did you mean `median(x)`?"));
  EXPECT_THAT(said("peak[0].fn_N"), AllOf(HasSubstr("peak is no list"), HasSubstr("`peaks`")));
  EXPECT_THAT(said("fn_peak_N[0]"), AllOf(HasSubstr("is no list"), HasSubstr("`fn_peaks_N`")));
  EXPECT_THAT(said("peaks[0].fn_M"), HasSubstr("did you mean `fn_N`"));
  EXPECT_THAT(said("peaks.cnt"), HasSubstr("`peaks.count`"));
  EXPECT_THAT(said("fn_peak"), HasSubstr("did you mean `fn_peak_N`"));
  EXPECT_THAT(said("mode, count"), HasSubstr("did you mean `count(*)`?"));
  EXPECT_EQ(said("mu [0]"), "");  // a name with a number in it
}

TEST_F(Answers, ANameInDoubleQuotesIsNeverAText) {
  const auto said = [&](const std::string& select, const std::string& where = {}) {
    return objection(question(select, where));
  };
  EXPECT_THAT(said("count(*)", "\"mux\" > 0.5"),
              AllOf(HasSubstr("no such column: mux"), HasSubstr("did you mean `mu`"),
                    HasSubstr("in single quotes a text")));
  EXPECT_THAT(said("avg(\"fn_peak_M\")"), HasSubstr("`fn_peak_N`"));
  EXPECT_THAT(said("mu", "major_mode = \"SC\""), HasSubstr("no such column: SC"));
  auto sorted = question("mu");
  sorted.set_order("\"mux\"");
  EXPECT_THAT(objection(sorted), HasSubstr("no such column: mux"));
  EXPECT_THAT(objection(question("count(*)", "", "\"mux\"")), HasSubstr("no such column: mux"));
  EXPECT_EQ(number("count(*)", "\"mu\" > 0.5"), number("count(*)", "mu > 0.5"));
  EXPECT_EQ(said("mu AS \"my mu\", \"e\""), "");
  EXPECT_THAT(said("mux"), testing::Not(HasSubstr("quotes")));
}

TEST_F(Answers, ForPatternsOtherWaysAreNamed) {
  EXPECT_THAT(objection(question("mu", "mode REGEXP 'S'")),
              AllOf(HasSubstr("GLOB 'SC*'"), HasSubstr("LIKE '%sR%'")));
}

TEST_F(Answers, AWrongColumnIsToldInALine) {
  const std::string said = objection(question("stik_total_s"));
  EXPECT_THAT(said, AllOf(HasSubstr("`stick_total_s`"), HasSubstr("oblique columns")));
  EXPECT_LT(said.size(), 150U) << said;
  EXPECT_THAT(objection(question("xyzzy")), testing::Not(HasSubstr("did you mean")));
}

TEST_F(Answers, WhatEndsTooEarlyIsNamedByItsFlag) {
  EXPECT_THAT(objection(question("mu", "mu >")),
              AllOf(HasSubstr("--where \"mu >\""), HasSubstr("must follow")));
  EXPECT_THAT(objection(question("mu +")), HasSubstr("--select \"mu +\""));
  EXPECT_THAT(objection(question("mu", "mu = = 1")),
              AllOf(HasSubstr("--where"), HasSubstr("near \"=\"")));
  auto sorted = question("mu");
  sorted.set_order("mu DESC DESC");
  EXPECT_THAT(objection(sorted), HasSubstr("--order \"mu DESC DESC\""));
}

TEST_F(Answers, NumbersAreThoseThatWereTypedInWhateverPartOfAQuestion) {
  // SQLite 3.40 reads the neighbour of each of these.
  for (const char* typed : {"0.1166477", "0.6341252", "0.2611956", "0.863579242346664"}) {
    EXPECT_EQ(number(typed), std::stod(typed));
    EXPECT_EQ(number(std::string("DISTINCT ") + typed), std::stod(typed));
  }
  EXPECT_EQ(number(".5e1"), 5.0);
  EXPECT_EQ(column("0.1166477 * mu").name, "0.1166477 * mu");
  EXPECT_EQ(column("peaks[0].fn_N * mu").name, "peaks[0].fn_N * mu");
  EXPECT_EQ(column("DISTINCT 0.1166477 * mu").name, "0.1166477 * mu");
  EXPECT_EQ(column("DISTINCT 0.1166477 * mu x").name, "x");
  EXPECT_EQ(column("0.1166477 AS \"x y\"").name, "x y");
  EXPECT_EQ(number("count(*)", "mode = '0.1166477'"), 0.0);
  // True of one row if both numbers are the same.
  const std::string is_it = "point = 3 AND 0.1166477 = 1166477 / 1e7";
  const auto grouped = question("count(*)", "", is_it);
  Statement groups(database_.get(), plan(database_.get(), grouped).statement);
  ASSERT_TRUE(groups.step());
  EXPECT_EQ(groups.real(0), 9.0);
  auto sorted = question("point");
  sorted.set_order(is_it + " DESC");
  EXPECT_EQ(number(sorted), 3.0);
}

}  // namespace
}  // namespace oblique::server
