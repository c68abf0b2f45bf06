#include "server/maintenance/merge.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/database/sqlite.h"
#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Results of one study, to be stored in a database.
struct Part {
  std::string study = "a";
  Table table = table_of(10);
  std::uint64_t first = 0;
  std::uint64_t end = 0;
  std::string solver_version = "0.1";
  std::string worker = "host";
  std::vector<std::uint64_t> failed{};
  double closure = 0.0;  ///< added to the output `closure` of each result
};

/// Makes databases and merges them into the database `all`.
class MergeTest : public StoreFixture {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name + ".db"); }

  /// Adds these studies and results to a database. Creates the database if it does not exist.
  void make(const std::string& name, const std::vector<Part>& parts) const {
    Store store(file(name));
    for (const Part& part : parts) {
      add_part(store, part);
    }
  }

  static void add_part(Store& store, const Part& part) {
    const auto studies = store.studies();
    const auto known = std::ranges::find(studies, part.study, &StoredStudy::name);
    const bool is_new = known == studies.end();
    const AddStudy study =
        study_of(part.table, is_new ? store.last_study_id() + 1 : known->study_id, part.study);
    const std::uint64_t worker = store.last_worker_id() + 1;
    std::vector<Change> changes;
    if (is_new) {
      changes.emplace_back(study);
    }
    changes.emplace_back(AddWorker{worker, part.worker, 1, part.solver_version, "avx2", "then"});
    AddResults results = solved(study, numbers(part.first, part.end), worker);
    for (protocol::PointResult& result : results.results) {
      if (std::ranges::find(part.failed, result.point()) != part.failed.end()) {
        result = protocol::failed_point(result.point(), "why");
      } else if (part.closure != 0.0) {
        solver::CaseResult other = protocol::from_message(result);
        other.energy.closure += part.closure;
        result = protocol::to_message(result.point(), other);
      }
    }
    changes.emplace_back(std::move(results));
    store.commit(changes);
  }

  Merged merge(const std::string& source, const std::string& rename_prefix = {}) const {
    return Merger(file("all")).merge(file(source), rename_prefix);
  }

  std::string refusal(const std::string& source, const std::string& rename_prefix = {}) const {
    try {
      merge(source, rename_prefix);
    } catch (const MergeRefused& error) {
      return error.what();
    }
    return "it was merged";
  }

  std::vector<std::string> texts(const std::string& name, const std::string& sql) const {
    return rows(file(name), sql);
  }
  std::string text(const std::string& name, const std::string& sql) const {
    return texts(name, sql).at(0);
  }

  /// Returns the ranges of completed points of all studies in a database, as "first+count,...".
  std::string ranges(const std::string& name) const {
    return text(name, "SELECT group_concat(first_point || '+' || points) FROM completed_ranges");
  }
};

TEST_F(MergeTest, StudiesOfSeveralDatabasesAreMergedWithAllRows) {
  make("one", {{.study = "a", .end = 10}, {.study = "b", .end = 3, .worker = "other host"}});
  make("two", {{.study = "c", .end = 7, .failed = {2}}});
  EXPECT_EQ(merge("one").studies_added, 2U);
  const Merged two = merge("two");
  EXPECT_EQ(two.studies_added, 1U);
  EXPECT_EQ(two.results_added, 7U);
  EXPECT_THAT(texts("all",
                    "SELECT study || ' ' || count(*) || ' ' || worker_name || ' ' ||"
                    " sum(status = 'failed') FROM runs GROUP BY study ORDER BY study"),
              ElementsAre("a 10 host 0", "b 3 other host 0", "c 7 host 1"));
  EXPECT_THAT(faults(file("all")), IsEmpty());
  const std::string outputs =
      "SELECT group_concat(quote(H) || quote(mu) || quote(fn_peak_N) || quote(closure) ||"
      " quote(peaks) || quote(reaction_peaks) || quote(steps) || quote(wall_s) || solved_at)"
      " FROM (SELECT * FROM runs WHERE study = 'b' ORDER BY point)";
  EXPECT_EQ(text("all", outputs), text("one", outputs)) << "outputs must be copied bit for bit";
  const Merged again = merge("one");
  EXPECT_EQ(again.results_known, 13U);
  EXPECT_EQ(again.studies_added + again.results_added, 0U) << "a second merge adds nothing";
  EXPECT_EQ(text("all", "SELECT (SELECT count(*) FROM models) || (SELECT count(*) FROM workers)"),
            "12")
      << "equal models and equal workers are stored once";
}

TEST_F(MergeTest, PointsOfOneStudyAreUnitedAndTheStudyIsDoneWhenNoPointIsOpen) {
  make("all", {{.end = 4}});
  make("one", {{.first = 4, .end = 7}});
  make("two", {{.first = 5, .end = 10}});
  EXPECT_EQ(merge("one").studies_united, 1U);
  EXPECT_EQ(text("all", "SELECT state FROM studies"), "running");
  const Merged two = merge("two");
  EXPECT_EQ(two.results_added, 3U);
  EXPECT_EQ(two.results_known, 2U);
  EXPECT_EQ(two.results_differing, 0U);
  EXPECT_EQ(text("all", "SELECT state FROM studies"), "done");
  EXPECT_THAT(faults(file("all")), IsEmpty());
  EXPECT_EQ(Store(file("all")).studies().at(0).completed, IntervalSet(0, 10));
}

TEST_F(MergeTest, AServerMayUseTheSourceButNotTheTarget) {
  Store served(file("one"));
  add_part(served, {.end = 3});
  EXPECT_EQ(merge("one").results_added, 3U);
  add_part(served, {.first = 3, .end = 5});
  EXPECT_EQ(merge("one").results_added, 2U);
  const Store busy(file("all"));
  EXPECT_THROW(merge("one"), StorageError);
}

TEST_F(MergeTest, RowsOfTheTargetAreKeptAndDifferencesAreCountedAndNamed) {
  make("all", {{.table = table_of(1000), .end = 900}});
  make("one", {{.table = table_of(1000), .end = 1000, .closure = 1e-12}});
  const std::string before = text("all", "SELECT quote(closure) FROM results WHERE point = 2");
  const Merged merged = merge("one");
  EXPECT_EQ(merged.results_known, 900U);
  EXPECT_EQ(merged.results_differing, 900U);
  EXPECT_EQ(merged.remarks.size(), 10U);
  EXPECT_EQ(merged.remarks.at(2), "study a, point 2: the solved outputs differ");
  EXPECT_EQ(text("all", "SELECT quote(closure) FROM results WHERE point = 2"), before);
}

TEST_F(MergeTest, ASolvedRowReplacesAFailedOneButNotViceVersa) {
  make("all", {{.end = 10, .failed = {1, 2}}});
  make("one", {{.end = 10, .failed = {2, 3}}});
  const Merged merged = merge("one");
  EXPECT_EQ(merged.failures_replaced, 1U);
  EXPECT_EQ(merged.results_added, 1U);
  EXPECT_EQ(merged.results_known, 9U);
  EXPECT_EQ(text("all", "SELECT group_concat(point) FROM results WHERE status = 'failed'"), "2");
  EXPECT_THAT(faults(file("all")), IsEmpty());
}

TEST_F(MergeTest, AStudyOfTheSameNameWithAnotherRecipeIsRefusedUnlessAPrefixIsGiven) {
  make("all", {{.study = "a", .end = 1}});
  make("one", {{.study = "b", .end = 2}, {.study = "a", .table = table_of(11), .end = 5}});
  EXPECT_THAT(refusal("one"), AllOf(HasSubstr("a study called \"a\""), HasSubstr("block 1 differs"),
                                    HasSubstr("--rename-prefix")));
  EXPECT_EQ(text("all", "SELECT count(*) FROM results"), "1");
  EXPECT_EQ(merge("one", "lab ").studies_added, 2U);
  EXPECT_THAT(texts("all", "SELECT name FROM studies ORDER BY name"),
              ElementsAre("a", "b", "lab a"));
  EXPECT_EQ(merge("one", "lab ").results_known, 7U);
  make("two", {{.study = "a", .table = table_of(12), .end = 5}});
  EXPECT_THAT(refusal("two", "lab "), HasSubstr("\"lab a\""));
  EXPECT_THAT(refusal("two", std::string(100, 'x')), HasSubstr("bytes"));
}

TEST_F(MergeTest, ResultsOfAnotherSolverVersionAreRefused) {
  make("all", {{.end = 4}});
  make("one", {{.study = "b", .end = 4}, {.first = 4, .end = 7, .solver_version = "0.2"}});
  EXPECT_THAT(refusal("one"), HasSubstr("results of study a come from solver version 0.2"));
  EXPECT_EQ(text("all", "SELECT count(*) FROM studies"), "1");
}

TEST_F(MergeTest, ASourceWithAnyFaultIsRefused) {
  int number = 0;
  for (const char* change :
       {"UPDATE results SET fn_peak_N = 1 WHERE point = 2", "UPDATE models SET k = -1",
        "UPDATE studies SET priority = 9223372036854775807", "DROP TABLE reused_points",
        "DROP TABLE reused_points; CREATE VIEW reused_points AS WITH RECURSIVE t (x) AS"
        " (SELECT 0 UNION ALL SELECT x FROM t) SELECT x AS study_id FROM t"}) {
    const std::string source = "source" + std::to_string(++number);
    make(source, {{.study = "b", .end = 2}, {.end = 9}});
    execute_sql(file(source), change);
    EXPECT_THROW(merge(source), StorageError) << change;
  }
  EXPECT_EQ(text("all", "SELECT count(*) FROM studies"), "0");
}

TEST_F(MergeTest, TheSourceIsNotChangedAndTheStateOfItsStudyIsCopied) {
  make("one", {{.end = 5}});
  execute_sql(file("one"), "UPDATE studies SET priority = 7");
  Store(file("one")).commit(std::vector<Change>{SetStudyState{1, StudyState::kPaused, "later"}});
  const auto bytes = [&] {
    std::ifstream stream(file("one"), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  const std::string before = bytes();
  merge("one");
  EXPECT_EQ(bytes(), before);
  EXPECT_EQ(text("all",
                 "SELECT state || ' ' || priority || ' ' || created_at || ' ' || changed_at"
                 " FROM studies"),
            "paused 7 2024-01-01T00:00:00.000Z later");
}

/// From now on this process kills itself as soon as a new database connection updates a study.
/// Merging updates a study after storing the last of its rows.
void kill_when_a_study_is_updated() {
  const auto watch = [](sqlite3* database) {
    sqlite3_update_hook(
        database,
        [](void*, int change, const char*, const char* table, sqlite3_int64) {
          if (change == SQLITE_UPDATE && std::string_view(table) == "studies") {
            kill(getpid(), SIGKILL);
          }
        },
        nullptr);
    return SQLITE_OK;
  };
  int (*const extension)(sqlite3*) = watch;
  sqlite3_auto_extension(reinterpret_cast<void (*)()>(extension));
}

TEST_F(MergeTest, AKilledMergeChangesNothingAndCanBeRepeated) {
  make("all", {{.study = "before", .end = 5}});
  make("one", {{.table = table_of(20'000), .end = 20'000}});
  const pid_t child = fork();
  if (child == 0) {
    kill_when_a_study_is_updated();
    merge("one");
    _exit(EXIT_SUCCESS);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_THAT(faults(file("all")), IsEmpty());
  EXPECT_EQ(Store(file("all")).studies().size(), 1U);
  EXPECT_EQ(merge("one").results_added, 20'000U);
  EXPECT_FALSE(std::filesystem::exists(file("all") + ".merging"))
      << "the temporary copy of the source was not deleted";
}

TEST_F(MergeTest, AGrownStudyIsUnitedWithItsShorterVersion) {
  for (const bool source_grew : {true, false}) {
    const std::string name = source_grew ? "grown" : "shorter";
    make("all", {{.study = name, .table = source_grew ? table_of(10) : grown_table(), .end = 5}});
    make(name, {{.study = name,
                 .table = source_grew ? grown_table() : table_of(10),
                 .first = 3,
                 .end = source_grew ? 15U : 10U}});
    Store(file("all"))
        .commit(
            std::vector<Change>{SetStudyState{source_grew ? 1U : 2U, StudyState::kDone, "then"}});
    const Merged merged = merge(name);
    EXPECT_EQ(merged.studies_united, 1U);
    EXPECT_EQ(merged.studies_grown, source_grew ? 1U : 0U);
    EXPECT_EQ(merged.results_known, 2U);
    const std::string where = " FROM runs WHERE study = '" + name + "'";
    EXPECT_EQ(text("all", "SELECT count(*)" + where), source_grew ? "15" : "10");
    EXPECT_EQ(text("all", "SELECT state || points FROM studies WHERE name = '" + name + "'"),
              "running20");
    EXPECT_THAT(faults(file("all")), IsEmpty());
    EXPECT_EQ(merge(name).results_added, 0U) << "a second merge adds nothing";
  }
}

TEST_F(MergeTest, CompletedPointsThatAFilterLeavesOutAreUnited) {
  const Table filtered = filtered_table("mu > 0.5");
  const auto leave_out = [&](const std::string& name, std::uint64_t begin, std::uint64_t end) {
    Store(file(name))
        .commit(std::vector<Change>{
            AddResults{1, filtered, 1, "0.1", "avx2", 1, "now", {}, IntervalSet(begin, end)}});
  };
  const auto state = [&] {
    return text("all", "SELECT state || ' ' || counted || ' ' || left_out FROM studies");
  };
  make("one", {{.table = filtered, .first = 5, .end = 8}});
  make("two", {{.table = filtered, .first = 7, .end = 10}});
  leave_out("one", 0, 2);
  leave_out("two", 1, 5);
  merge("one");
  EXPECT_EQ(ranges("all"), "0+2,5+3");
  EXPECT_EQ(state(), "running 1 2");
  merge("two");
  EXPECT_EQ(ranges("all"), "0+10");
  EXPECT_EQ(state(), "done 1 5");
  EXPECT_THAT(faults(file("all")), IsEmpty());
}

TEST_F(MergeTest, ASourceWhoseRowsWereChangedByHandIsMergedByItsRows) {
  make("one", {{.end = 10}});
  execute_sql(file("one"),
              "DELETE FROM results WHERE point = 3;"
              "UPDATE results SET checksum = NULL, wall_s = 7 WHERE point = 1");
  merge("one");
  EXPECT_EQ(ranges("all"), "0+3,4+6");
  EXPECT_EQ(text("all", "SELECT group_concat(point) FROM results WHERE checksum IS NULL"), "1");
  EXPECT_THAT(faults(file("all")), IsEmpty());
}

TEST_F(MergeTest, ReusedResultsStillNameTheirSourceAndAreCounted) {
  make("one",
       {{.study = "a/b", .end = 4}, {.study = "gone", .first = 4, .end = 10}, {.study = "c"}});
  {
    Store store(file("one"));
    const auto outcome = std::make_shared<ReusedResults>();
    store.commit(
        std::vector<Change>{ReuseResults{3, table_of(10), 0, "0.1", outcome}, DeleteStudy{2}});
  }
  make("all", {{.study = "c", .end = 2}});
  for (int i = 0; i < 2; ++i) {
    merge("one");
    EXPECT_EQ(text("all",
                   "SELECT group_concat(reused_from) FROM (SELECT * FROM runs WHERE study = 'c'"
                   " ORDER BY point)"),
              "a/b/2,a/b/3,gone/4,gone/5,gone/6,gone/7,gone/8,gone/9");
    EXPECT_THAT(texts("all", "SELECT source || ' ' || points FROM reused_points ORDER BY source"),
                ElementsAre("a/b 2", "gone 6"));
    EXPECT_THAT(faults(file("all")), IsEmpty());
  }
}

}  // namespace
}  // namespace oblique::server
