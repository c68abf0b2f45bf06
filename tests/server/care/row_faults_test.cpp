#include "server/care/row_faults.h"
#include "proto/recipe/canonical.h"
#include "proto/result_message.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/result_message.h"
#include "server/care/diagnosis.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

/// A solved point whose outputs agree with each other.
protocol::PointResult agreeing_point(std::uint64_t point) {
  solver::CaseResult result{};
  result.duration_s = 3e-4;
  result.fn_peak_N = 5000.0;
  result.ft_peak_N = 2000.0;
  result.stick_total_s = 5e-5;
  result.mode = "SC sC sR sC SC SR";
  result.major_mode = "SC sR";
  result.peaks = {{1e-4, 5000.0, 2000.0, false}, {2.5e-4, 1500.0, 600.0, false}};
  result.ft_peaks = {{1e-4, 2000.0}, {2.5e-4, 600.0}};
  double begin_s = 0.0;
  for (const double end_s : {1e-4, 2e-4, 2.5e-4, 3e-4}) {
    result.phases.push_back({solver::PhaseKind::kCompression, begin_s, end_s});
    begin_s = end_s;
  }
  result.stick_intervals = {{0.0, 2e-5}, {2.7e-4, 3e-4}};
  result.reaction_peaks = {{3e-4, 5000.0}, {1e-4, 4000.0}};
  return protocol::to_message(point, result);
}

/// Three points, the last of them failed; their rows have no checksums.
class RowFaultsTest : public testing::Test {
 protected:
  RowFaultsTest() {
    Store store(path_);
    store.commit(std::vector<Change>{
        AddStudy{1, "a", table_, "now", {}},
        AddResults{1,
                   table_,
                   0,
                   "0.1",
                   "avx2",
                   1,
                   "now",
                   {agreeing_point(0), agreeing_point(1), protocol::failed_point(2, "why")}}});
    run("UPDATE results SET checksum = NULL");
    run("UPDATE studies SET checksum = NULL");
  }
  void run(const std::string& sql) {
    execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), sql);
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  std::shared_ptr<const protocol::PointTable> table_ = table_of(5);
};

TEST_F(RowFaultsTest, RowsThatAgreeWithThemselvesAndTheRecipeHaveNone) {
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

TEST_F(RowFaultsTest, AColumnThatDisagreesWithTheRecipeOrAnotherColumnIsNamed) {
  const std::vector<std::pair<std::string, std::string>> damages{
      {"H = 1.0000000000000002", "H is 1.0000000000000002"},
      {"mu = mu + 0.125", "mu is"},
      {"e = 0.5", "e is"},
      {"fn_peak = 500100000", "fn_peak_N"},
      {"ft_peak = 200100000", "ft_peak_N"},
      {"stick_total = 0", "stick_total_s"},
      {"mode = major_mode", "mode"},
      {"peaks = replace(peaks, '500000000', '400000000')", "fn_peak_N"},
      {"peaks = replace(peaks, ']', '')", "one of its lists cannot be read"},
      {"peaks = '[200000000,500000000,1,100000000,1,1]'", "peaks"},
      {"peaks = '[100000000,500000000,1,2]'", "peaks"},
      {"ft_peaks = '[100000000,1e999]'", "ft_peaks"},
      {"phases = '[200000000,100000000]'", "phases"},
      {"phases = '[100000000]'", "phases"},
      {"stick_intervals = replace(stick_intervals, '20000000', '30000000')", "stick_total_s"},
      {"reaction_peaks = '[100000000]'", "reaction_peaks"},
      {"duration = 9e999", "its duration_s is not a finite number"},
      {"closure = -9e999", "its closure is not a finite number"},
      {"phases = '[inf]'", "one of its lists cannot be read"},
      {"impulse_n = NULL", "outputs are missing"},
      {"error = 'none'", "it is failed, and has outputs"}};
  for (const auto& [change, said] : damages) {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    execute(database.get(),
            "CREATE TEMP TABLE before AS SELECT * FROM packed_results WHERE point = 1");
    execute(database.get(), "UPDATE packed_results SET " + change + " WHERE point = 1");
    EXPECT_THAT(find_faults(path_), Contains(testing::AllOf(HasSubstr("point 1"), HasSubstr(said))))
        << change;
    execute(database.get(), "DELETE FROM packed_results WHERE point = 1");
    execute(database.get(), "INSERT INTO packed_results SELECT * FROM before");
    EXPECT_THAT(find_faults(path_), IsEmpty()) << "after " << change;
  }
}

TEST_F(RowFaultsTest, AFailedPointWithOutputsIsNamed) {
  run("UPDATE packed_results SET fn_peak = 1 WHERE point = 2");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("point 2: it is failed, and has outputs")));
}

TEST_F(RowFaultsTest, AListThatIsLongerThanAnyResultHasItIsNamedAndNotUnfolded) {
  const auto peaks_of = [this](int elements) {
    run("UPDATE packed_results SET peaks = (WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1"
        " FROM n WHERE i < " +
        std::to_string(3 * elements) + ") SELECT json_group_array(i) FROM n) WHERE point < 2");
  };
  peaks_of(200'000);
  EXPECT_THAT(find_faults(path_),
              testing::UnorderedElementsAre(HasSubstr("point 0: one of its lists cannot be read, or"
                                                      " has more than 4096 elements"),
                                            HasSubstr("point 1: one of its lists")));
  peaks_of(protocol::kMostListElements);
  EXPECT_THAT(find_faults(path_), testing::Not(Contains(HasSubstr("one of its lists"))));
}

TEST_F(RowFaultsTest, AModelThatIsNotThatOfItsDefinitionOrOfTheRecipeIsNamed) {
  run("UPDATE models SET E = E + 1");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("model 1: E is not")));
  run("UPDATE models SET E = E - 1");
  solver::ModelParameters other = solver::preset("paper");
  other.E_Pa += 1.0;
  {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    Statement update(database.get(), "UPDATE models SET E = E + 1, definition = ?");
    update.bind(1, std::string_view(protocol::canonical_model(other)));
    update.run();
  }
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("point 0: its model is not")));
}

TEST_F(RowFaultsTest, ARecipeThatCannotBeReadOrHasOtherPointsIsNamed) {
  run("UPDATE studies SET points = 6");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("it has 6 points, and 5 by its recipe")));
  run("UPDATE studies SET points = 5, recipe = x'ff'");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("its recipe cannot be read")));
}

}  // namespace
}  // namespace oblique::server
