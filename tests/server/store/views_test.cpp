// What views show of what was stored.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proto/result_message.h"
#include "server/query/reader.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/stored_numbers.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

class ViewsTest : public testing::Test {
 protected:
  /// A study with these results.
  void store(std::uint64_t points, const std::vector<protocol::PointResult>& results) {
    Store store(path_);
    store.commit(std::vector<Change>{
        AddStudy{1, "a", table_of(points), "then", {}},
        AddWorker{1, "host", 2, "0.1", "avx2", "then"},
        AddResults{1, table_of(points), 1, "0.1", "avx2", 1, "2024-01-01T00:00:01.000Z", results}});
  }
  protocol::QueryReply ask(const std::string& sql) const {
    return Reader(path_).query(sql, kNoLimits);
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
};

TEST_F(ViewsTest, NumbersComeBackFromColumnsAndViewsAHundredTimesFinerThanTheyAreAccurate) {
  std::vector<protocol::PointResult> results;
  for (std::uint64_t point = 0; point < 500; ++point) {
    results.push_back(solved_point(point));
  }
  store(500, results);
  const auto table = table_of(500);
  const auto scalars =
      ask("SELECT fall_time_s, duration_s, fn_peak_N, closure, mu FROM results"
          " ORDER BY point");
  const auto peaks = ask("SELECT t_s, fn_N, ft_N FROM peaks ORDER BY point, seq");
  const auto phases = ask("SELECT t0_s, t1_s FROM phases ORDER BY point, seq");
  const auto sticks = ask("SELECT t0_s, t1_s FROM stick_intervals ORDER BY point, seq");
  ASSERT_EQ(scalars.rows_size(), 500);
  ASSERT_EQ(peaks.rows_size(), 1000);
  for (int i = 0; i < 500; ++i) {
    const auto& result = results[static_cast<std::size_t>(i)];
    const auto outputs = protocol::from_message(result);
    const StoredDigits digits(outputs, accuracy_of(table->model(0)));
    const auto& row = scalars.rows(i);
    expect_as_stored(row.values(0).real(), outputs.fall_time_s, "fall_time_s", digits);
    expect_as_stored(row.values(1).real(), outputs.duration_s, "duration_s", digits);
    expect_as_stored(row.values(2).real(), outputs.fn_peak_N, "fn_peak_N", digits);
    expect_as_stored(row.values(3).real(), outputs.energy.closure, "closure", digits);
    EXPECT_EQ(row.values(4).real(), table->point(result.point()).mu);
    for (int j = 0; j < 6; ++j) {
      expect_as_stored(peaks.rows(2 * i + j / 3).values(j % 3).real(), result.peaks(j),
                       j % 3 == 0 ? "t_s" : "fn_N", digits);
    }
    const auto& phase = phases.rows(3 * i + 1);
    expect_as_stored(phase.values(0).real(), result.phase_ends_s(0), "t0_s", digits);
    expect_as_stored(phase.values(1).real(), result.phase_ends_s(1), "t1_s", digits);
    const auto& last = phases.rows(3 * i + 2);
    expect_as_stored(last.values(1).real(), outputs.duration_s, "t1_s", digits);
    expect_as_stored(sticks.rows(i).values(1).real(), result.stick_intervals(1), "t1_s", digits);
  }
}

TEST_F(ViewsTest, ViewsUnfoldThePackedArrays) {
  store(3, {solved_point(2)});
  const auto peaks = ask("SELECT study_id, point, seq, typeof(t_s), major FROM peaks");
  ASSERT_EQ(peaks.rows_size(), 2);
  EXPECT_EQ(peaks.rows(0).values(1).integer(), 2);
  EXPECT_EQ(peaks.rows(0).values(2).integer(), 0);
  EXPECT_EQ(peaks.rows(0).values(3).text(), "real");  // 0.0 is no integer
  EXPECT_EQ(peaks.rows(0).values(4).integer(), 0);
  EXPECT_EQ(peaks.rows(1).values(2).integer(), 1);
  EXPECT_EQ(peaks.rows(1).values(4).integer(), 1);
  const auto phases = ask("SELECT group_concat(kind) FROM phases");
  EXPECT_EQ(phases.rows(0).values(0).text(), "compression,restitution,compression");
}

TEST_F(ViewsTest, AListThatIsDamagedIsNullAndTheOtherRowsAreShown) {
  store(4, {solved_point(0), solved_point(1), solved_point(2), solved_point(3)});
  const std::string all =
      "SELECT point, peaks IS NULL, ft_peaks IS NULL, phases IS NULL, stick_intervals IS NULL,"
      " reaction_peaks IS NULL FROM runs ORDER BY point";
  const auto unfolded = [&](const std::string& view) {
    return ask("SELECT count(DISTINCT point) FROM " + view).rows(0).values(0).integer();
  };
  for (const std::string list :
       {"peaks", "ft_peaks", "phases", "stick_intervals", "reaction_peaks"}) {
    execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
            "UPDATE packed_results SET " + list + " = '[1,inf]' WHERE point = 1");
    const auto rows = ask(all);
    ASSERT_EQ(rows.rows_size(), 4) << list;
  }
  const auto rows = ask(all);
  for (int i = 1; i < 6; ++i) {
    EXPECT_EQ(rows.rows(0).values(i).integer(), 0) << i;
    EXPECT_EQ(rows.rows(1).values(i).integer(), 1) << i;
  }
  for (const std::string view : {"peaks", "phases", "stick_intervals", "reaction_peaks"}) {
    EXPECT_EQ(unfolded(view), 3) << view;
  }
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "UPDATE packed_results SET duration = 9e999 WHERE point = 2");
  EXPECT_EQ(unfolded("phases"), 2);
  EXPECT_EQ(ask(all).rows(2).values(3).integer(), 1);
}

TEST_F(ViewsTest, TheLargestReactionsComeBackThePinFirst) {
  auto of_older_worker = solved_point(2);
  of_older_worker.clear_reaction_peaks();
  const auto result = solved_point(1);
  store(3, {result, of_older_worker});
  const auto peaks = ask("SELECT point, seq, t_s, force_N FROM reaction_peaks ORDER BY seq");
  ASSERT_EQ(peaks.rows_size(), 3);
  const StoredDigits digits(protocol::from_message(result), accuracy_of(table_of(3)->model(0)));
  for (int joint = 0; joint < 3; ++joint) {
    const auto& row = peaks.rows(joint);
    EXPECT_EQ(row.values(0).integer(), 1);
    EXPECT_EQ(row.values(1).integer(), joint);
    expect_as_stored(row.values(2).real(), result.reaction_peaks(2 * joint), "t_s", digits);
    expect_as_stored(row.values(3).real(), result.reaction_peaks(2 * joint + 1), "force_N", digits);
  }
  const auto in_runs = ask("SELECT reaction_peaks IS NULL FROM runs ORDER BY point");
  EXPECT_EQ(in_runs.rows(0).values(0).integer(), 0);
  EXPECT_EQ(in_runs.rows(1).values(0).integer(), 1) << "its worker did not send any";
}

}  // namespace
}  // namespace oblique::server
