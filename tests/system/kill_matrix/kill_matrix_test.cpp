#include <sqlite3.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/amount.h"
#include "tests/system/kill_matrix/kill_cycle.h"

namespace oblique::test {
namespace {

/// Number of cycles of `deploy/test --all`; the program `oblique-kill-matrix` runs more.
constexpr std::uint64_t kCycles = 23;

TEST(KillMatrixTest, TheDatabaseEqualsThatOfAnUndisturbedRunWhicheverProcessIsKilledOrHalted) {
  const std::uint64_t cycles = static_cast<std::uint64_t>(amount(8, kCycles));
  const MatrixReport report = run_matrix(0, cycles);
  EXPECT_EQ(report.cycles, cycles);
  for (const std::string& failure : report.failures) {
    ADD_FAILURE() << failure;
  }
  // A run may combine messages, and then reaches a point less often than the case requires.
  EXPECT_LE(report.not_reached, cycles / 5) << "too many cycles ended before their point";
}

TEST(KillMatrixTest, TheFirstCyclesContainEveryClassOfPointProgramAndSignalOfTheMatrix) {
  std::set<std::string> always;
  std::set<std::string> all;
  for (std::uint64_t seed = 0; seed < entries_of_matrix(); ++seed) {
    const KillCase drawn = draw_case(seed);
    const std::string program = (drawn.all_in_one ? "run " : "apart ") + drawn.program;
    for (const std::string& part : {class_of(drawn.point), program, std::to_string(drawn.signal)}) {
      all.insert(part);
      if (seed < kCycles) {
        always.insert(part);
      }
    }
  }
  EXPECT_EQ(always, all);
}

class ComparisonTest : public ::testing::Test {
 protected:
  /// Returns the difference found after `sql` has changed one of two equal databases.
  std::string difference_after(const std::string& sql) {
    const std::string changed = folder_.file("changed.db");
    std::filesystem::copy_file(study_.undisturbed(), changed,
                               std::filesystem::copy_options::overwrite_existing);
    sqlite3* database = nullptr;
    EXPECT_EQ(sqlite3_open(changed.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(database);
    return first_difference(changed, study_.undisturbed());
  }

  TemporaryFolder folder_;
  KillStudy study_;
};

TEST_F(ComparisonTest, FindsExactlyTheDifferencesThatAreNotAllowed) {
  EXPECT_EQ(difference_after("SELECT 1"), "");
  EXPECT_EQ(difference_after("UPDATE results SET attempt = 7, wall_s = 1, solved_at = 'then'"), "");
  // Selects a point by its position, because a filter leaves out some point numbers.
  const std::string one = " WHERE point = (SELECT point FROM results LIMIT 1 OFFSET 300)";
  for (const std::string& change : std::vector<std::string>{
           "UPDATE results SET fn_peak_N = fn_peak_N + 1" + one,
           "UPDATE results SET mode = mode || ' C'" + one,
           "UPDATE results SET error = 'another' WHERE error IS NOT NULL",
           "UPDATE results SET model_id = (SELECT min(models.model_id) FROM models"
           " WHERE models.model_id != results.model_id)" +
               one,
           "UPDATE results SET point = 5000" + one,
           "DELETE FROM results WHERE point = (SELECT max(point) FROM results)",
           "UPDATE studies SET state = 'paused'", "UPDATE models SET dt = 1 WHERE model_id = 2",
           "INSERT INTO studies (study_id, name, recipe, points, errors, state, created_at,"
           " changed_at, priority)"
           " SELECT 2, 'another', recipe, points, errors, state, '', '', priority"
           " FROM studies"}) {
    EXPECT_NE(difference_after(change), "") << change;
  }
}

}  // namespace
}  // namespace oblique::test
