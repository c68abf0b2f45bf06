#include "server/store/result_rows.h"

#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/store/store_fixture.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAreArray;

class ResultRowsTest : public StoreFixture {
 protected:
  void store_results(const std::vector<protocol::PointResult>& results) {
    const auto study = study_of(1000);
    commit({study, worker(1), results_of(study, results)});
  }
  /// Returns a result with elements in all lists.
  static solver::CaseResult listed() {
    auto result = protocol::from_message(solved_point(2));
    result.peaks = {{0.0, 1234.56789012, 2.0, false}, {1.23456789e-5, 12345678.25, -3.5, true}};
    result.ft_peaks = {{0.25, -3.5}};
    result.phases = {{solver::PhaseKind::kCompression, 0.0, 0.25},
                     {solver::PhaseKind::kRestitution, 0.25, 1.0}};
    result.stick_intervals = {{0.0, 2.0}};
    result.reaction_peaks = {{1.0, 7.0}, {2.0, 1.0 / 3.0}};
    return result;
  }
};

TEST_F(ResultRowsTest, WrittenColumnsAreExactlyThoseOfTheTable) {
  store();
  const std::string columns_of =
      "SELECT name FROM pragma_table_info('{}') WHERE name <> 'checksum'";
  EXPECT_THAT(rows(fmt::format(fmt::runtime(columns_of), "results")),
              UnorderedElementsAreArray(result_columns()));
  EXPECT_THAT(rows(fmt::format(fmt::runtime(columns_of), "models") + " AND name <> 'model_id'"),
              UnorderedElementsAreArray(model_columns()));
}

TEST_F(ResultRowsTest, ScalarsKeepEveryBit) {
  const auto results = solved(study_of(50), numbers(0, 50)).results;
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
            EXPECT_EQ(row.real(column), *value) << field.column;
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
  store_results({protocol::to_message(2, listed())});
  EXPECT_THAT(rows("SELECT peaks FROM results"),
              ElementsAre("[[0,1234.5679,2,0],[1.2345679e-05,12345678,-3.5,1]]"));
  EXPECT_THAT(rows("SELECT ft_peaks, phases, stick_intervals, reaction_peaks FROM results"),
              ElementsAre("[[0.25,-3.5]]|[0.25,1]|[[0,2]]|[[1,7],[2,0.33333333]]"));
  EXPECT_THAT(rows("SELECT phases FROM runs"),
              ElementsAre(R"([["compression",0.0,0.25],["restitution",0.25,1]])"));
}

TEST_F(ResultRowsTest, ViewsHaveARowForEachElementOfAListAndNoIntegersExceptMajor) {
  store_results({protocol::to_message(2, listed()), protocol::failed_point(3, "it did not end")});
  EXPECT_THAT(rows("SELECT * FROM peaks"),
              ElementsAre("1|2|0|0.0|1234.5679|2.0|0", "1|2|1|1.2345679e-05|12345678.0|-3.5|1"));
  EXPECT_THAT(rows("SELECT * FROM phases"),
              ElementsAre("1|2|0|compression|0.0|0.25", "1|2|1|restitution|0.25|1.0"));
  EXPECT_THAT(rows("SELECT * FROM stick_intervals"), ElementsAre("1|2|0|0.0|2.0"));
  EXPECT_THAT(rows("SELECT * FROM reaction_peaks"),
              ElementsAre("1|2|0|1.0|7.0", "1|2|1|2.0|0.33333333"));
}

TEST_F(ResultRowsTest, FtPeaksEqualToThoseOfPeaksAreStoredAsNullAndShownByRuns) {
  auto same = listed();
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
  EXPECT_THAT(
      rows("SELECT ft_peaks, ft_peaks IS NULL FROM runs ORDER BY point"),
      ElementsAre("[[0.25,2],[0.5,1.5]]|0", "[[0.25,2],[0.5,1.5]]|0", "[[0.25,2]]|0", "|1"));
}

TEST_F(ResultRowsTest, MissingOutputsAreNull) {
  auto lacking = listed();
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
  EXPECT_THAT(
      rows(fmt::format("SELECT coalesce({}) IS NULL FROM runs", fmt::join(output_columns(), ", "))),
      ElementsAre("1"));
}

TEST_F(ResultRowsTest, AGridTakesLessThan850BytesAPointWithAllIndices) {
  constexpr std::uint64_t kPoints = 20'000;
  // An ordinary contact (mu 0.4, e 0.9) has two peaks, four phases and one stick interval.
  auto result = listed();
  result.errors = {};
  result.peaks = {{0.000123456789, 1234.56789, 456.789123, true},
                  {0.000345678912, 2345.67891, 345.678912, true}};
  result.ft_peaks = {{0.000123456789, 456.789123}, {0.000345678912, 345.678912}};
  result.phases.clear();
  for (const double t1_s : {0.000123456789, 0.000234567891, 0.000345678912, 0.000567891234}) {
    result.phases.push_back({solver::PhaseKind::kCompression, 0.0, t1_s});
  }
  result.stick_intervals = {{0.0, 0.000456789123}};
  result.reaction_peaks = {
      {0.000123456789, 1234.56789}, {0.000234567891, 2345.67891}, {0.000345678912, 345.678912}};
  solver::for_each_stored<double>([&](const auto&, const solver::Member<double>& member) {
    if (member.in != nullptr && !member.may_be_absent) {
      member.in(result) = 0.123456789012345;
    }
  });
  const auto study = study_of(kPoints);
  std::vector<protocol::PointResult> results;
  for (std::uint64_t point = 0; point < kPoints; ++point) {
    results.push_back(protocol::to_message(point, result));
  }
  commit({study, worker(1), results_of(study, results)});
  ASSERT_TRUE(store().merge_log());
  const auto bytes =
      number("SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
  EXPECT_LT(bytes, 850 * static_cast<std::int64_t>(kPoints));
}

}  // namespace
}  // namespace oblique::server
