// A database of schema 7 that its programs made: two models of the explicit integrator, one with a
// tolerance of 1e-9, one of generalized-alpha with a given step, one with estimated errors, a study
// all of whose points failed, and one that is not finished.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/care/diagnosis.h"
#include "server/care/merge.h"
#include "server/store/store.h"
#include "tests/support/stored_numbers.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class MigratedValuesTest : public testing::Test {
 protected:
  MigratedValuesTest() {
    for (const std::string& path : {path_, before_}) {
      std::filesystem::copy_file(OBLIQUE_OLD_SCHEMAS "/made_by_schema_7.sqlite", path);
    }
  }

  static DatabaseHandle opened(const std::string& path) {
    return open_database(path, SQLITE_OPEN_READONLY);
  }
  static std::vector<std::string> texts(const std::string& path, const std::string& sql) {
    const DatabaseHandle database = opened(path);
    Statement statement(database.get(), sql);
    std::vector<std::string> found;
    while (statement.step()) {
      found.push_back(statement.text(0));
    }
    return found;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("study.db");
  std::string before_ = folder_.file("before.db");
};

/// How finely a row of schema 7, with the columns of its model, is stored now.
StoredDigits digits_of(const Statement& row, const std::vector<std::string>& columns) {
  const auto value = [&](const std::string& name) {
    const auto column = std::find(columns.begin(), columns.end(), name);
    return row.real(static_cast<int>(column - columns.begin()));
  };
  solver::CaseResult result{};
  result.fall_time_s = value("fall_time_s");
  result.impact_x_m = value("impact_x_m");
  result.vt_in_m_s = value("vt_in_m_s");
  result.vn_in_m_s = value("vn_in_m_s");
  result.duration_s = value("duration_s");
  result.fn_peak_N = value("fn_peak_N");
  result.impulse_n_Ns = value("impulse_n_Ns");
  result.energy.kinetic_in_J = value("kinetic_in_J");
  result.energy.exchanged_J = value("exchanged_J");
  result.solver.dt_s = value("dt_s");
  return {result, value("dt") > 0.0 ? 0.0 : value("tolerance")};
}

void expect_same_list(const std::string& now, const std::string& then, const std::string& list,
                      const StoredDigits& digits) {
  const auto a = nlohmann::json::parse(now);
  const auto b = nlohmann::json::parse(then);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t row = 0; row < b.size(); ++row) {
    ASSERT_EQ(a[row].size(), b[row].size());
    for (std::size_t i = 0; i < b[row].size(); ++i) {
      if (b[row][i].is_number_float()) {
        const bool is_force = i > 0 && list.ends_with("peaks");
        expect_as_stored(a[row][i].get<double>(), b[row][i].get<double>(),
                         is_force ? "fn_N" : "t_s", digits);
      } else {
        EXPECT_EQ(a[row][i], b[row][i]);  // the kind of a phase, or of a peak
      }
    }
  }
}

TEST_F(MigratedValuesTest, AreThoseOfBeforeToTheUnitsInWhichTheyAreStored) {
  { const Store store(path_); }
  const DatabaseHandle now = opened(path_);
  const DatabaseHandle then = opened(before_);
  std::vector<std::string> columns{"tolerance", "dt"};
  std::string list = "tolerance, dt";
  Statement names(then.get(), "SELECT name FROM pragma_table_info('results')");
  while (names.step()) {
    if (names.text(0) != "checksum") {
      columns.push_back(names.text(0));
      list += ", results." + names.text(0);
    }
  }
  const std::string sql =
      "SELECT " + list + " FROM results JOIN models USING (model_id) ORDER BY study_id, point";
  Statement rows(now.get(), sql);
  Statement rows_then(then.get(), sql);
  int count = 0;
  while (rows_then.step()) {
    ASSERT_TRUE(rows.step());
    const StoredDigits digits = digits_of(rows_then, columns);
    SCOPED_TRACE("row " + std::to_string(++count));
    for (int column = 0; column < rows_then.columns(); ++column) {
      const std::string& name = columns[static_cast<std::size_t>(column)];
      SCOPED_TRACE(name);
      ASSERT_EQ(rows.type(column), rows_then.type(column));
      const std::string text = rows_then.text(column);
      if (text.starts_with("[[")) {
        expect_same_list(rows.text(column), text, name, digits);
      } else if (rows.type(column) == SQLITE_FLOAT) {
        expect_as_stored(rows.real(column), rows_then.real(column), name, digits);
      } else {
        EXPECT_EQ(rows.text(column), text);
      }
    }
  }
  EXPECT_FALSE(rows.step());
  EXPECT_EQ(count, 22);
}

TEST_F(MigratedValuesTest, AreInASoundFileThatHasNoEmptyPagesAndKnowsWhatIsSettled) {
  std::vector<std::string> said;
  {
    const Store store(path_, [&](const std::string& sentence) { said.push_back(sentence); });
  }
  EXPECT_THAT(said, testing::Contains(HasSubstr("from schema 7 to 8, once, with about 2")));
  EXPECT_THAT(find_faults(path_), testing::IsEmpty());
  EXPECT_THAT(texts(path_, "PRAGMA auto_vacuum"), ElementsAre("2"));
  EXPECT_THAT(texts(path_, "PRAGMA freelist_count"), ElementsAre("0"));
  EXPECT_THAT(texts(path_,
                    "SELECT first_point || '+' || points FROM settled_points"
                    " WHERE study_id = 6 ORDER BY first_point"),
              ElementsAre("0+1", "3+2"));
  EXPECT_THAT(texts(path_, "SELECT counted FROM studies ORDER BY study_id"),
              ElementsAre("1", "1", "1", "1", "1", "0"));
}

TEST_F(MigratedValuesTest, AreMergedAsTheyWouldBeFromTheMigratedFile) {
  { const Store store(path_); }
  for (const std::string& source : {before_, path_}) {
    const std::string target = source + ".merged";
    EXPECT_EQ(Merger(target).merge(source, {}, [](auto, auto) {}).results_added, 22U);
    EXPECT_THAT(find_faults(target), testing::IsEmpty());
  }
  const std::string sql =
      "SELECT study_id || ' ' || point || ' ' || checksum FROM packed_results"
      " ORDER BY study_id, point";
  EXPECT_EQ(texts(before_ + ".merged", sql).size(), 22U);
  const Merged again = Merger(path_ + ".merged").merge(before_, {}, [](auto, auto) {});
  EXPECT_EQ(again.results_known, 22U);
  EXPECT_EQ(again.results_differing, 0U) << "rounded alike, whichever way they came";
}

TEST_F(MigratedValuesTest, AreAllThereWheneverTheProgramIsKilled) {
  // Before anything, between the transaction and the file's being written again, and behind that.
  for (int sentences = 1; sentences <= 3; ++sentences) {
    const std::string path = folder_.file(std::to_string(sentences) + ".db");
    std::filesystem::copy_file(before_, path);
    const pid_t child = fork();
    if (child == 0) {
      int said = 0;
      const Store store(path, [&](const std::string& /*sentence*/) {
        if (++said == sentences) {
          kill(getpid(), SIGKILL);
        }
      });
      _exit(EXIT_SUCCESS);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << sentences;
    EXPECT_THAT(find_faults(path), testing::IsEmpty()) << sentences;
    { const Store store(path); }
    EXPECT_THAT(find_faults(path), testing::IsEmpty()) << sentences;
    EXPECT_THAT(texts(path, "SELECT count(*) FROM runs"), ElementsAre("22")) << sentences;
    EXPECT_THAT(texts(path, "PRAGMA auto_vacuum"), ElementsAre("2")) << sentences;
  }
}

TEST_F(MigratedValuesTest, OfRowsThatAreNotAsTheyWereStoredAreLeftOutAndPendingAgain) {
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "UPDATE results SET fn_peak_N = 1 WHERE study_id = 1 AND point = 5;"
          "UPDATE results SET peaks = '[[', checksum = NULL WHERE study_id = 1 AND point = 7");
  std::vector<std::string> said;
  Store store(path_, [&](const std::string& sentence) { said.push_back(sentence); });
  EXPECT_THAT(said, testing::Contains(HasSubstr("2 results were not as they were stored")));
  const auto small = store.studies().at(0);
  EXPECT_EQ(small.state, StudyState::kRunning);
  EXPECT_EQ(small.settled.size(), 11U);
  EXPECT_THAT(find_faults(path_), testing::IsEmpty());
}

TEST_F(MigratedValuesTest, StayAsTheyAreWhereTheFileCannotGrow) {
  // Somebody else is in the middle of writing.
  const DatabaseHandle other = open_database(path_, SQLITE_OPEN_READWRITE);
  execute(other.get(), "BEGIN IMMEDIATE");
  EXPECT_THROW(Store{path_}, StorageError);
  execute(other.get(), "ROLLBACK");
  EXPECT_EQ(texts(path_, "SELECT group_concat(fn_peak_N) FROM results"),
            texts(before_, "SELECT group_concat(fn_peak_N) FROM results"));
}

}  // namespace
}  // namespace oblique::server
