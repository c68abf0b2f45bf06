// Tests of the reuse of rows of other studies: lookup and copy.
#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::range;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

class ResultReuseTest : public StoreFixture {
 protected:
  ResultReuseTest() { commit({worker(kWorker, "1.0"), worker(kOldWorker, "0.9")}); }

  void add(std::uint64_t study, const std::string& name, const Table& points) {
    commit({study_of(points, study, name)});
  }
  /// Solves all points of a study.
  void solve(std::uint64_t study, const Table& points) {
    commit({solved(study_of(points, study), numbers(0, points->size()))});
  }
  ReusedResults reuse_part(std::uint64_t study, const Table& points, std::uint64_t first = 0) {
    const auto outcome = std::make_shared<ReusedResults>();
    commit({ReuseResults{study, points, first, "1.0", outcome}});
    return *outcome;
  }
  /// Returns "POINT of STUDY/POINT" for each copied row, where STUDY/POINT is its source.
  std::vector<std::string> copies(std::uint64_t study) const {
    return rows(
        fmt::format("SELECT point || ' of ' || reused_from FROM results"
                    " WHERE study_id = {} AND reused_from IS NOT NULL ORDER BY point",
                    study));
  }

  static constexpr std::uint64_t kWorker = 1;
  static constexpr std::uint64_t kOldWorker = 2;
};

/// Provides two studies with the same points; points 0 to 9 of study 1 are solved.
class SamePointsTest : public ResultReuseTest {
 protected:
  SamePointsTest() {
    add(1, "a", points_);
    add(2, "b", points_);
    solve(1, points_);
  }
  IntervalSet reused() { return reuse_part(2, points_).points; }

  Table points_ = table_of(10);
};

TEST_F(SamePointsTest, SoundRowsAreCopiedAndCountedByTheirOrigin) {
  const ReusedResults outcome = reuse_part(2, points_);
  EXPECT_EQ(outcome.points, IntervalSet(0, 10));
  EXPECT_THAT(outcome.origins, ElementsAre(Pair("a", 10)));
  EXPECT_EQ(outcome.probes, 10U);
  EXPECT_EQ(outcome.next_point, std::nullopt);
  const StoredStudy study = store().studies().at(1);
  EXPECT_EQ(study.completed, IntervalSet(0, 10));
  EXPECT_THAT(study.reused, ElementsAre(Pair("a", 10)));
}

TEST_F(SamePointsTest, ACopyDiffersFromItsSourceOnlyInStudyPointAndOrigin) {
  reused();
  std::vector<std::string> same;
  for (const std::string_view column : result_columns()) {
    if (column != "study_id" && column != "reused_from") {
      same.emplace_back(column);
    }
  }
  const std::string sql =
      fmt::format("SELECT {} FROM results WHERE study_id = ", fmt::join(same, ", "));
  EXPECT_EQ(rows(sql + "2"), rows(sql + "1"));
  EXPECT_EQ(copies(2).at(3), "3 of a/3");
  EXPECT_THAT(faults(), IsEmpty());
  commit({RenameStudy{1, "c"}});
  EXPECT_EQ(copies(2).at(3), "3 of a/3") << "a copied row keeps the name that its source had then";
}

TEST_F(SamePointsTest, OnlyUnchangedRowsOfTheSolverVersionAreCopiedAndNoneOfOrToADeletedStudy) {
  const std::vector<std::pair<std::string, Interval>> changes{
      {"UPDATE results SET slide_m = slide_m + 1 WHERE point = 3", {3, 4}},
      {"UPDATE results SET checksum = NULL WHERE point = 4", {4, 5}},
      {"UPDATE workers SET solver_version = '1.0b' WHERE worker_id = 1", {0, 10}}};
  IntervalSet expected(0, 10);
  std::uint64_t id = 3;
  for (const auto& [change, lost] : changes) {
    execute_sql(change);
    expected.erase(lost.begin, lost.end);
    add(id, "another", points_);
    EXPECT_EQ(reuse_part(id, points_).points, expected) << change;
    commit({DeleteStudy{id}});
    EXPECT_EQ(reuse_part(id++, points_).points, IntervalSet()) << "a deleted study gets no rows";
  }
}

/// Changes rows of `results` while SQLite does not know the index `solved_points`, which therefore
/// keeps the old values, as after a flipped bit in a row.
class ChangedRowTest : public SamePointsTest {
 protected:
  void change_rows_only(const std::string& sql) {
    close();
    const std::string index = " FROM sqlite_schema WHERE name = 'solved_points'";
    execute_sql("CREATE TABLE kept AS SELECT *" + index + "; PRAGMA writable_schema = ON; DELETE" +
                index);
    execute_sql(sql);
    execute_sql(
        "PRAGMA writable_schema = ON; INSERT INTO sqlite_schema SELECT * FROM kept;"
        "DROP TABLE kept");
  }
};

TEST_F(ChangedRowTest, ARowWithADamagedInputIsNotCopiedAlthoughItsIndexIsRight) {
  commit({study_of(3, 7, "for a second model")});
  IntervalSet expected(0, 10);
  std::uint64_t point = 0;
  for (const char* change : {"H = 0.5", "mu = mu + 1", "e = 0.25", "model_id = 2"}) {
    change_rows_only(
        fmt::format("UPDATE results SET {} WHERE study_id = 1 AND point = {}", change, point));
    expected.erase(point, point + 1);
    ++point;
  }
  EXPECT_EQ(reused(), expected);
}

TEST_F(ChangedRowTest, ASoundRowIsNotCopiedForInputsThatOnlyItsDamagedIndexHas) {
  change_rows_only(
      fmt::format("UPDATE results SET mu = 0.77 WHERE study_id = 1 AND point = 3;"
                  "UPDATE results SET checksum = {} WHERE study_id = 1 AND point = 3",
                  result_checksum_sql()));
  IntervalSet expected(0, 10);
  expected.erase(3, 4);
  EXPECT_EQ(reused(), expected);
}

TEST_F(SamePointsTest, RowsOfADamagedWorkerAreNotCopiedAndADamagedModelEndsTheServer) {
  execute_sql("UPDATE workers SET threads = threads + 1 WHERE worker_id = 1");
  EXPECT_EQ(reused(), IntervalSet());
  execute_sql("UPDATE models SET k = k + 1");
  EXPECT_THAT([&] { reused(); },
              testing::ThrowsMessage<StorageGone>(testing::AllOf(
                  testing::HasSubstr("model 1 was changed"), testing::HasSubstr("--salvage"))));
  close();
  EXPECT_THROW(solve(1, table_of(11)), StorageGone);
  close();
  execute_sql("UPDATE models SET checksum = NULL");
  EXPECT_EQ(reused(), IntervalSet());
}

TEST_F(SamePointsTest, PointsCompletedWithoutARowGetNoCopiedRow) {
  execute_sql("INSERT INTO completed_ranges VALUES (2, 2, 3)");
  IntervalSet others(0, 10);
  others.erase(2, 5);
  EXPECT_EQ(reused(), others) << "points outside the condition are not reused";
}

TEST_F(ResultReuseTest, TheEndOfALookupIsStoredWithTheStudy) {
  commit({AddStudy{3, "c", table_of(10), "then", {}, "", true}});
  EXPECT_TRUE(store().studies().at(0).reuses);
  commit({EndReuse{3}});
  EXPECT_FALSE(store().studies().at(0).reuses);
}

TEST_F(ResultReuseTest, PartsFollowEachOtherAndSkipCompletedPoints) {
  const Table points = table_of(10'000);
  add(1, "a", points);
  add(2, "b", points);
  solve(1, points);
  const auto first = reuse_part(2, points);
  ASSERT_TRUE(first.next_point);
  const std::uint64_t part = *first.next_point;
  EXPECT_LT(part, 5000U);
  EXPECT_EQ(first.points, IntervalSet(0, part));
  const auto second = reuse_part(2, points, 0);  // repeats the lookup, like a restarted server
  EXPECT_EQ(second.points, IntervalSet(part, 2 * part));
  const auto third = reuse_part(2, points, 2 * part);
  EXPECT_EQ(third.points, IntervalSet(2 * part, 10'000));
  EXPECT_EQ(third.next_point, std::nullopt);
}

TEST_F(ResultReuseTest, AModelWithoutRowsCostsOneProbe) {
  const Table known = table_of(10);
  add(1, "a", known);
  solve(1, known);
  const Table other =
      table(protocol::recipe_of({{listed("E", {6.5e10}), listed("H", {1.0}),
                                  range("mu", 0.0, 1.0, 1'000'000'000), listed("e", {1.0})}}));
  add(2, "b", other);
  const auto outcome = reuse_part(2, other);
  EXPECT_EQ(outcome.probes, 1U);
  EXPECT_EQ(outcome.next_point, std::nullopt);
}

// ---- Random studies, compared with a lookup in a map --------------------------------------------

/// Returns a block with few values per axis, so that many points occur several times.
protocol::Block random_block(std::mt19937& random) {
  const auto pick = [&](const std::string& key, std::vector<double> values) {
    std::shuffle(values.begin(), values.end(), random);
    values.resize(1 + random() % values.size());
    return listed(key, values);
  };
  std::vector<protocol::Axis> axes;
  if (random() % 2 == 0) {
    axes.push_back(pick("E", {6.5e10, 7e10}));
  }
  axes.push_back(pick("H", {0.5, 0.75, 1.0}));
  axes.push_back(random() % 2 == 0 ? range("mu", 0.0, 1.0, 2 + random() % 3)
                                   : pick("mu", {0.0, 1.0 / 3.0, 0.5, 1.0}));
  axes.push_back(pick("e", {0.25, 0.5, 1.0}));
  protocol::Recipe recipe = protocol::recipe_of({axes});
  if (random() % 4 == 0) {
    recipe.mutable_blocks(0)->set_where("mu > 0.3");
  }
  return recipe.blocks(0);
}

Table random_table(std::mt19937& random) {
  std::vector<protocol::Block> blocks;
  for (std::size_t i = 0; i < 1 + random() % 3; ++i) {
    blocks.push_back(random_block(random));
  }
  protocol::Recipe recipe = protocol::recipe_of_blocks(blocks);
  recipe.set_errors(random() % 3 == 0);
  return table(recipe);
}

using Inputs = std::tuple<bool, std::string, std::array<std::uint64_t, 3>>;

Inputs inputs_of(const protocol::PointTable& points, std::uint64_t number) {
  const protocol::Point point = points.point(number);
  return {points.wants_errors(),
          protocol::canonical_model(points.model(point.model)),
          {std::bit_cast<std::uint64_t>(point.H_m), std::bit_cast<std::uint64_t>(point.mu),
           std::bit_cast<std::uint64_t>(point.e_star)}};
}

TEST_F(ResultReuseTest, RandomStudiesReuseTheResultsThatALookupInAMapFinds) {
  std::mt19937 random(4711);
  std::map<Inputs, std::string> solved;  // first row with the inputs, as "study STUDY/POINT"
  std::size_t reused = 0;
  std::size_t open = 0;
  for (std::uint64_t study = 1; study <= 60; ++study) {
    const Table points = random_table(random);
    add(study, "study " + std::to_string(study), points);
    // Some points have failed or were solved by another version. Reuse must not replace their rows.
    const AddStudy added = study_of(points, study);
    AddResults own = results_of(added, {}, kWorker);
    AddResults old = results_of(added, {}, kOldWorker);
    std::vector<std::string> expected;
    for (std::uint64_t number = 0; number < points->size(); ++number) {
      const std::uint64_t fate = random() % 10;
      if (!points->passes_filter(number)) {
        continue;
      }
      if (fate == 0) {
        own.results.push_back(protocol::failed_point(number, "for the test"));
      } else if (fate == 1) {
        old.results.push_back(solved_point(number));
      } else if (const auto found = solved.find(inputs_of(*points, number));
                 found != solved.end()) {
        expected.push_back(fmt::format("{} of {}", number, found->second));
      } else {
        ++open;
      }
    }
    commit({own, old});
    const auto outcome = reuse_part(study, points);
    EXPECT_EQ(copies(study), expected) << "study " << study;
    EXPECT_EQ(outcome.points.size(), expected.size());
    reused += expected.size();
    // Solves some of the open points and adds them to `solved`. Copied rows are not added, because
    // their source, the first row with the same inputs, is in `solved` already.
    AddResults rest = results_of(added, {}, kWorker);
    const IntervalSet completed = store().studies().back().completed;
    for (std::uint64_t number = 0; number < points->size(); ++number) {
      if (points->passes_filter(number) && !completed.contains(number) && random() % 2 == 0) {
        rest.results.push_back(solved_point(number));
        solved.emplace(inputs_of(*points, number), fmt::format("study {}/{}", study, number));
      }
    }
    commit({rest});
  }
  EXPECT_GT(reused, 300U);
  EXPECT_GT(open, 300U);
}

}  // namespace
}  // namespace oblique::server
