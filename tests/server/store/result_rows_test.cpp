#include "server/store/result_rows.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/store/schema.h"
#include "tests/server/store/store_fixture.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class ResultRowsTest : public StoreFixture {
 protected:
  void store_results(const std::vector<protocol::PointResult>& results) {
    const auto study = study_of(1000);
    commit({study, worker(1), results_of(study, results)});
  }
  std::vector<std::string> columns_of(const std::string& table) {
    store();
    return rows("SELECT name FROM pragma_table_info('" + table + "')");
  }
};

/// With eight significant digits, as printf does it.
std::string rounded(double value) {
  return fmt::format("{:.8g}", value);
}

TEST_F(ResultRowsTest, ColumnsAreThoseOfTheTableInOneOrder) {
  store();
  std::vector<std::string> expected;
  for (const std::string_view column : result_columns()) {
    expected.emplace_back(column);
  }
  EXPECT_EQ(rows("SELECT name FROM pragma_table_xinfo('results')"
                 " WHERE name NOT IN ('status', 'checksum') ORDER BY name"),
            rows("WITH c(name) AS (VALUES ('" + fmt::format("{}", fmt::join(expected, "'), ('")) +
                 "')) SELECT name FROM c ORDER BY name"));
  EXPECT_EQ(std::set<std::string>(expected.begin(), expected.end()).size(), expected.size());
}

TEST_F(ResultRowsTest, EveryOutputIsAColumnOfItsTypeAndTheViewForPeopleShowsIt) {
  std::map<std::string, std::string> types;
  store();
  for (const std::string& row :
       rows("SELECT name || ' ' || type FROM pragma_table_info('results')")) {
    types[row.substr(0, row.find(' '))] = row.substr(row.find(' ') + 1);
  }
  const auto shown = columns_of("runs");
  const auto expect = [&](const std::string& column, const std::string& type) {
    EXPECT_EQ(types[column], type) << column;
    EXPECT_THAT(shown, testing::Contains(column));
  };
  solver::for_each_stored<double>(
      [&](const auto& field, const auto&) { expect(std::string(field.column), "REAL"); });
  solver::for_each_stored<std::int64_t>(
      [&](const auto& field, const auto&) { expect(std::string(field.column), "INTEGER"); });
  solver::for_each_stored<std::string>(
      [&](const auto& field, const auto&) { expect(std::string(field.column), "TEXT"); });
  for (const solver::ResultList* list : solver::result_lists()) {
    expect(std::string(list->column), "TEXT");
  }
  for (const auto& field : solver::result_fields()) {
    if (field.sent_with != solver::SentWith::kResult) {
      EXPECT_THAT(shown, testing::Contains(std::string(field.column)));
    }
  }
}

TEST_F(ResultRowsTest, ViewsOfListsHaveTheMembersOfTheirElements) {
  for (const solver::ResultList* list : solver::result_lists()) {
    std::vector<std::string> expected{"study_id", "point", "seq"};
    expected.insert(expected.end(), list->members.begin(), list->members.end());
    EXPECT_THAT(columns_of(std::string(list->column)),
                list->column == "ft_peaks" ? testing::Matcher<std::vector<std::string>>(IsEmpty())
                                           : testing::UnorderedElementsAreArray(expected))
        << list->column;
  }
}

TEST_F(ResultRowsTest, ScalarsKeepEveryBit) {
  std::vector<protocol::PointResult> results;
  for (std::uint64_t point = 0; point < 50; ++point) {
    results.push_back(solved_point(point));
  }
  store_results(results);
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
  for (const char* table : {"results", "runs"}) {
    Statement row(database.get(), fmt::format("SELECT {}, mu FROM {} ORDER BY point",
                                              fmt::join(output_columns(), ", "), table));
    std::size_t compared = 0;
    for (const auto& message : results) {
      ASSERT_TRUE(row.step());
      const solver::CaseResult result = protocol::from_message(message);
      int column = 0;
      const auto compare = [&](const auto& field, const auto& member) {
        const auto* value = member.of(result);
        ASSERT_EQ(row.is_null(column), value == nullptr) << field.column;
        if (value != nullptr) {
          using Value = typename std::decay_t<decltype(member)>::Value;
          if constexpr (std::is_same_v<Value, double>) {
            EXPECT_EQ(std::bit_cast<std::uint64_t>(row.real(column)),
                      std::bit_cast<std::uint64_t>(*value))
                << field.column;
          } else if constexpr (std::is_same_v<Value, std::string>) {
            EXPECT_EQ(row.text(column), *value) << field.column;
          } else {
            EXPECT_EQ(row.integer(column), *value) << field.column;
          }
          ++compared;
        }
        ++column;
      };
      solver::for_each_stored<double>(compare);
      solver::for_each_stored<std::int64_t>(compare);
      solver::for_each_stored<std::string>(compare);
      EXPECT_EQ(row.real(static_cast<int>(output_columns().size())),
                table_of(1000)->point(message.point()).mu);
    }
    EXPECT_GT(compared, results.size() * 25U);
  }
}

TEST_F(ResultRowsTest, ListsAreJsonArraysOfNumbersWithEightDigits) {
  const auto result = protocol::from_message(solved_point(2));
  store_results({solved_point(2)});
  const auto r = [](double value) { return rounded(value); };
  const auto& peaks = result.peaks;
  EXPECT_THAT(
      rows("SELECT peaks, ft_peaks, phases, stick_intervals, reaction_peaks FROM results"),
      ElementsAre(fmt::format(
          "[[0,{},2,0],[{},{},{},1]]|[[{},{}]]|[{},{},{}]|[[0,{}]]|[[{},{}],[{},{}],[{},{}]]",
          r(peaks[0].fn_N), r(peaks[1].t_s), r(peaks[1].fn_N), r(peaks[1].ft_N),
          r(result.ft_peaks[0].t_s), r(result.ft_peaks[0].ft_N), r(result.phases[0].t1_s),
          r(result.phases[1].t1_s), r(result.phases[2].t1_s), r(result.stick_intervals[0].t1_s),
          r(result.reaction_peaks[0].t_s), r(result.reaction_peaks[0].force_N),
          r(result.reaction_peaks[1].t_s), r(result.reaction_peaks[1].force_N),
          r(result.reaction_peaks[2].t_s), r(result.reaction_peaks[2].force_N))));
}

TEST_F(ResultRowsTest, ViewsHaveARowForEachElementOfALists) {
  const auto result = protocol::from_message(solved_point(2));
  store_results({solved_point(2), protocol::failed_point(3, "it did not end")});
  const auto number = [](double value) { return std::stod(rounded(value)); };
  const auto expect_rows = [&](const std::string& sql,
                               const std::vector<std::vector<double>>& expected) {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement row(database.get(), sql);
    for (const auto& values : expected) {
      ASSERT_TRUE(row.step()) << sql;
      for (std::size_t i = 0; i < values.size(); ++i) {
        EXPECT_EQ(row.real(static_cast<int>(i)), values[i]) << sql << " column " << i;
      }
    }
    EXPECT_FALSE(row.step()) << sql;
  };
  std::vector<std::vector<double>> peaks;
  std::vector<std::vector<double>> phases;
  std::vector<std::vector<double>> reactions;
  for (const auto& peak : result.peaks) {
    peaks.push_back({2, static_cast<double>(peaks.size()), number(peak.t_s), number(peak.fn_N),
                     number(peak.ft_N), peak.major ? 1.0 : 0.0});
  }
  for (const auto& phase : result.phases) {
    phases.push_back({static_cast<double>(phases.size()), number(phase.t0_s), number(phase.t1_s)});
  }
  for (const auto& peak : result.reaction_peaks) {
    reactions.push_back(
        {static_cast<double>(reactions.size()), number(peak.t_s), number(peak.force_N)});
  }
  expect_rows("SELECT point, seq, t_s, fn_N, ft_N, major FROM peaks ORDER BY seq", peaks);
  expect_rows("SELECT seq, t0_s, t1_s FROM phases ORDER BY seq", phases);
  expect_rows("SELECT seq, t0_s, t1_s FROM stick_intervals",
              {{0.0, 0.0, number(result.stick_intervals[0].t1_s)}});
  expect_rows("SELECT seq, t_s, force_N FROM reaction_peaks ORDER BY seq", reactions);
  EXPECT_THAT(rows("SELECT kind FROM phases ORDER BY seq"),
              ElementsAre("compression", "restitution", "compression"));
}

TEST_F(ResultRowsTest, NumbersOfListsAreNeverIntegersInSql) {
  auto result = protocol::from_message(solved_point(1));
  result.peaks = {{0.0, 12345678.25, 3.0, true}};
  result.phases = {{solver::PhaseKind::kCompression, 0.0, 2.0},
                   {solver::PhaseKind::kRestitution, 2.0, 3.0}};
  result.stick_intervals = {{1.0, 2.0}};
  result.reaction_peaks = {{1.0, 7.0}};
  store_results({protocol::to_message(1, result)});
  EXPECT_THAT(rows("SELECT typeof(t_s), typeof(fn_N), typeof(ft_N), fn_N / 5 FROM peaks"),
              ElementsAre("real|real|real|2469135.6"));
  EXPECT_THAT(rows("SELECT DISTINCT typeof(t0_s), typeof(t1_s) FROM phases"),
              ElementsAre("real|real"));
  EXPECT_THAT(rows("SELECT typeof(t0_s), typeof(t1_s) FROM stick_intervals"),
              ElementsAre("real|real"));
  EXPECT_THAT(rows("SELECT typeof(t_s), typeof(force_N) FROM reaction_peaks"),
              ElementsAre("real|real"));
}

TEST_F(ResultRowsTest, PeaksOfFtThatEqualThoseOfPeaksAreNullAndRunsShowsThemWhole) {
  auto same = protocol::from_message(solved_point(0));
  same.peaks = {{0.25, 3.0, 2.0, true}, {0.5, 2.0, 1.5, false}};
  same.ft_peaks = {{0.25, 2.0}, {0.5, 1.5}};
  auto other = same;
  other.ft_peaks[1].t_s = std::nextafter(0.5, 1.0);
  auto fewer = same;
  fewer.ft_peaks.pop_back();
  store_results({protocol::to_message(0, same), protocol::to_message(1, other),
                 protocol::to_message(2, fewer), protocol::failed_point(3, "it did not end")});
  EXPECT_THAT(rows("SELECT ft_peaks IS NULL FROM results ORDER BY point"),
              ElementsAre("1", "0", "0", "1"));
  EXPECT_THAT(rows("SELECT ft_peaks FROM runs ORDER BY point"),
              ElementsAre("[[0.25,2],[0.5,1.5]]", "[[0.25,2],[0.5,1.5]]", "[[0.25,2]]", ""));
  EXPECT_THAT(rows("SELECT ft_peaks IS NULL FROM runs WHERE point = 3"), ElementsAre("1"));
}

TEST_F(ResultRowsTest, RunsShowsPhasesWithTheirKindsAndBeginnings) {
  auto result = protocol::from_message(solved_point(0));
  result.phases = {{solver::PhaseKind::kCompression, 0.0, 0.25},
                   {solver::PhaseKind::kRestitution, 0.25, 0.5}};
  store_results({protocol::to_message(0, result)});
  EXPECT_THAT(rows("SELECT phases FROM runs"),
              ElementsAre(R"([["compression",0.0,0.25],["restitution",0.25,0.5]])"));
}

TEST_F(ResultRowsTest, OutputsThatAResultLacksAreNull) {
  auto lacking = protocol::from_message(solved_point(1));
  lacking.margin.reset();
  lacking.margin_event.reset();
  lacking.errors = {};
  lacking.reaction_peaks.clear();
  store_results({solved_point(0), protocol::to_message(1, lacking)});
  EXPECT_THAT(rows("SELECT margin IS NULL, margin_event IS NULL, mode_same IS NULL,"
                   " fn_peak_error IS NULL, reaction_peaks IS NULL, closure > 0"
                   " FROM runs ORDER BY point"),
              ElementsAre("0|0|0|0|0|1", "1|1|1|1|1|1"));
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(ResultRowsTest, AFailedPointHasAReasonAndNoOutputs) {
  const auto study = study_of(3);
  AddResults by_server = failed(study, {2});
  by_server.worker_id = 0;
  commit({study, by_server});
  EXPECT_THAT(rows("SELECT status, error, worker_id IS NULL, attempt, solved_at FROM runs"),
              ElementsAre("failed|it did not end|1|1|2024-01-01T00:00:01.000Z"));
  for (const std::string_view column : output_columns()) {
    EXPECT_THAT(rows(fmt::format("SELECT {} IS NULL FROM runs", column)), ElementsAre("1"))
        << column;
  }
  EXPECT_THAT(rows("SELECT * FROM peaks"), IsEmpty());
}

TEST_F(ResultRowsTest, ARowThatBreaksARuleOfTheTableIsAnErrorAndAPointThatHasARowKeepsIt) {
  store();
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
  add_row_checksum(database.get());
  ResultInsert insert(database.get());
  const auto outputs = protocol::from_message(solved_point(0));
  ResultRow row{.study_id = 1,
                .point = 0,
                .model_id = 1,
                .inputs = {0, std::numeric_limits<double>::quiet_NaN(), 0.5, 1.0},
                .result = &outputs,
                .error = {},
                .worker_id = 1,
                .attempt = 1,
                .solved_at = "now"};
  EXPECT_THROW(insert.run(row), StorageError) << "SQLite stores a NaN as NULL";
  row.inputs.H_m = 1.0;
  EXPECT_TRUE(insert.run(row));
  row.result = nullptr;
  row.error = "late";
  EXPECT_FALSE(insert.run(row));
  EXPECT_THAT(rows("SELECT status, count(*) FROM results"), ElementsAre("solved|1"));
}

TEST_F(ResultRowsTest, AGridTakesLessThan850BytesAPointWithAllIndices) {
  constexpr std::uint64_t kPoints = 20'000;
  // A contact of ordinary length (mu 0.4, e 0.9): two peaks, four phases, one stick interval.
  auto result = protocol::from_message(solved_point(1));
  result.errors = {};
  result.mode = "SC SR sR";
  result.peaks = {{0.000123456789, 1234.56789, 456.789123, true},
                  {0.000345678912, 2345.67891, 345.678912, true}};
  result.ft_peaks = {{0.000123456789, 456.789123}, {0.000345678912, 345.678912}};
  result.phases = {{solver::PhaseKind::kCompression, 0.0, 0.000123456789},
                   {solver::PhaseKind::kRestitution, 0.000123456789, 0.000234567891},
                   {solver::PhaseKind::kCompression, 0.000234567891, 0.000345678912},
                   {solver::PhaseKind::kRestitution, 0.000345678912, 0.000567891234}};
  result.stick_intervals = {{0.0, 0.000456789123}};
  result.reaction_peaks = {
      {0.000123456789, 1234.56789}, {0.000234567891, 2345.67891}, {0.000345678912, 345.678912}};
  solver::for_each_stored<double>([&](const auto&, const solver::Member<double>& member) {
    if (member.in != nullptr && !member.may_be_absent) {
      member.in(result) = 0.123456789012345;
    }
  });
  const auto study = study_of(kPoints);
  AddResults change = results_of(study, {});
  for (std::uint64_t point = 0; point < kPoints; ++point) {
    change.results.push_back(protocol::to_message(point, result));
  }
  commit({study, worker(1), change});
  ASSERT_TRUE(store().merge_log());
  const auto bytes =
      number("SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
  EXPECT_LT(bytes, 850 * static_cast<std::int64_t>(kPoints));
}

}  // namespace
}  // namespace oblique::server
