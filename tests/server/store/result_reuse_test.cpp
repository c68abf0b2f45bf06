// Rows of other studies that are reused, as the store looks them up and copies them.
#include "server/store/result_reuse.h"

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

#include "proto/recipe/canonical.h"
#include "server/database/sqlite.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::range;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

using Table = std::shared_ptr<const protocol::PointTable>;

Table table(const protocol::Recipe& recipe) {
  return std::make_shared<const protocol::PointTable>(recipe);
}

class ResultReuseTest : public testing::Test {
 protected:
  ResultReuseTest() {
    store_.commit(std::vector<Change>{AddWorker{kWorker, "host", 1, "1.0", "avx2", "then"},
                                      AddWorker{kOldWorker, "host", 1, "0.9", "avx2", "then"}});
  }

  void add(std::uint64_t study, const std::string& name, const Table& points) {
    store_.commit(std::vector<Change>{AddStudy{study, name, points, "then"}});
  }
  /// Points [0, count) are solved.
  void solve(std::uint64_t study, const Table& points, std::uint64_t count) {
    AddResults solved = results(study, points, kWorker);
    for (std::uint64_t point = 0; point < count; ++point) {
      solved.results.push_back(solved_point(point));
    }
    store_.commit(std::vector<Change>{solved});
  }
  static AddResults results(std::uint64_t study, const Table& points, std::uint64_t worker) {
    return {study, points, worker, "1.0", "avx2", 1, "2024-01-01T00:00:01.000Z", {}};
  }
  ReusedResults reuse_part(std::uint64_t study, const Table& points, std::uint64_t first = 0) {
    const auto outcome = std::make_shared<ReusedResults>();
    store_.commit(std::vector<Change>{ReuseResults{study, points, first, "1.0", outcome}});
    return *outcome;
  }
  /// As another tool does.
  void edit(const std::string& sql) {
    const DatabaseHandle database = open_database(file_, SQLITE_OPEN_READWRITE);
    execute(database.get(), sql);
  }
  std::map<std::uint64_t, std::string> copies(std::uint64_t study) {
    const DatabaseHandle database = open_database(file_, SQLITE_OPEN_READONLY);
    Statement rows(database.get(),
                   "SELECT point, taken_from FROM packed_results WHERE study_id = ?"
                   " AND taken_from IS NOT NULL");
    rows.bind(1, study);
    std::map<std::uint64_t, std::string> copies;
    while (rows.step()) {
      copies[static_cast<std::uint64_t>(rows.integer(0))] = rows.text(1);
    }
    return copies;
  }

  static constexpr std::uint64_t kWorker = 1;
  static constexpr std::uint64_t kOldWorker = 2;
  test::TemporaryFolder folder_;
  std::string file_ = folder_.file("reuse.db");
  Store store_{file_};
};

/// Study 1 has solved points 0 to 9, all of which study 2 has, too.
class SamePointsTest : public ResultReuseTest {
 protected:
  SamePointsTest() {
    add(1, "a", points_);
    add(2, "b", points_);
    solve(1, points_, 10);
  }
  IntervalSet reused() { return reuse_part(2, points_).points; }
  static IntervalSet all_but_the_third() {
    IntervalSet points(0, 10);
    points.erase(3, 4);
    return points;
  }

  Table points_ = table_of(10);
};

TEST_F(SamePointsTest, SoundRowsAreCopiedAndCountedByTheirOrigin) {
  const ReusedResults outcome = reuse_part(2, points_);
  EXPECT_EQ(outcome.points, IntervalSet(0, 10));
  EXPECT_THAT(outcome.origins, ElementsAre(Pair("a", 10)));
  EXPECT_EQ(outcome.probes, 10U);
  EXPECT_EQ(outcome.next_point, std::nullopt);
  const StoredStudy study = store_.studies().at(1);
  EXPECT_EQ(study.settled, IntervalSet(0, 10));
  EXPECT_THAT(study.taken, ElementsAre(Pair("a", 10)));
}

TEST_F(SamePointsTest, ARowThatIsNotTheOneThatWasStoredIsNotCopied) {
  edit("UPDATE packed_results SET slide = slide + 1000000 WHERE study_id = 1 AND point = 3");
  EXPECT_EQ(reused(), all_but_the_third());
}

TEST_F(SamePointsTest, ARowWithoutAChecksumIsNotCopied) {
  edit("UPDATE packed_results SET checksum = NULL WHERE study_id = 1 AND point = 3");
  EXPECT_EQ(reused(), all_but_the_third());
}

TEST_F(SamePointsTest, RowsWhoseTextsAreGoneOrOthersAreNotCopied) {
  edit("PRAGMA foreign_keys = OFF; UPDATE texts SET text = text || '?'");
  EXPECT_EQ(reused(), IntervalSet());
  edit("PRAGMA foreign_keys = OFF; DELETE FROM texts");
  EXPECT_EQ(reused(), IntervalSet());
}

TEST_F(SamePointsTest, RowsOfAWorkerThatIsNotTheOneThatWasStoredAreNotCopied) {
  edit("UPDATE workers SET instruction_set = 'sse9'");
  EXPECT_EQ(reused(), IntervalSet());
}

TEST_F(SamePointsTest, RowsOfADeletedStudyAreNotCopied) {
  store_.commit(std::vector<Change>{DeleteStudy{1}});
  EXPECT_EQ(reused(), IntervalSet());
}

TEST_F(SamePointsTest, ADeletedStudyGetsNoRows) {
  store_.commit(std::vector<Change>{DeleteStudy{2}});
  EXPECT_EQ(reused(), IntervalSet());
  EXPECT_THAT(copies(2), IsEmpty());
}

TEST_F(SamePointsTest, WhereSeveralStudiesHaveAResultItIsCopiedFromTheFirst) {
  add(3, "c", points_);
  EXPECT_EQ(reused(), IntervalSet(0, 10));
  EXPECT_THAT(reuse_part(3, points_).origins, ElementsAre(Pair("a", 10)));
}

TEST_F(ResultReuseTest, PartsFollowEachOtherAndPassOverSettledPoints) {
  const Table points = table_of(10'000);
  add(1, "a", points);
  add(2, "b", points);
  solve(1, points, 10'000);
  const auto first = reuse_part(2, points);
  ASSERT_TRUE(first.next_point);
  const std::uint64_t part = *first.next_point;
  EXPECT_LT(part, 5000U);
  EXPECT_EQ(first.points, IntervalSet(0, part));
  const auto second = reuse_part(2, points, 0);  // as after a restart of the server
  EXPECT_EQ(second.points, IntervalSet(part, 2 * part));
  const auto third = reuse_part(2, points, 2 * part);
  EXPECT_EQ(third.points, IntervalSet(2 * part, 10'000));
  EXPECT_EQ(third.next_point, std::nullopt);
}

TEST_F(ResultReuseTest, AModelThatNoRowHasCostsOneProbe) {
  const Table known = table_of(10);
  add(1, "a", known);
  solve(1, known, 10);
  const Table other =
      table(protocol::recipe_of({{listed("E", {6.5e10}), listed("H", {1.0}),
                                  range("mu", 0.0, 1.0, 1'000'000'000), listed("e", {1.0})}}));
  add(2, "b", other);
  const auto outcome = reuse_part(2, other);
  EXPECT_EQ(outcome.probes, 1U);
  EXPECT_EQ(outcome.next_point, std::nullopt);
}

// ---- Random studies against a lookup in a map
// ----------------------------------------------------

/// Few values of each key, so that studies share points, some of them twice.
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

TEST_F(ResultReuseTest, RandomStudiesGetWhatALookupInAMapFinds) {
  std::mt19937 random(4711);
  std::map<Inputs, std::string> solved;  // by inputs the first row, as taken_from has it
  std::size_t reused = 0;
  std::size_t open = 0;
  for (std::uint64_t study = 1; study <= 60; ++study) {
    const Table points = random_table(random);
    add(study, "study " + std::to_string(study), points);
    // Some points fail before, and others are solved by another version: these keep their rows.
    AddResults own = results(study, points, kWorker);
    AddResults old = results(study, points, kOldWorker);
    std::map<std::uint64_t, std::string> expected;
    for (std::uint64_t number = 0; number < points->size(); ++number) {
      const std::uint64_t fate = random() % 10;
      if (!points->is_left_in(number)) {
        continue;
      }
      if (fate == 0) {
        own.results.push_back(protocol::failed_point(number, "for the test"));
      } else if (fate == 1) {
        old.results.push_back(solved_point(number));
      } else if (const auto found = solved.find(inputs_of(*points, number));
                 found != solved.end()) {
        expected[number] = found->second;
      } else {
        ++open;
      }
    }
    store_.commit(std::vector<Change>{own, old});
    const auto outcome = reuse_part(study, points);
    EXPECT_EQ(copies(study), expected) << "study " << study;
    EXPECT_EQ(outcome.points.size(), expected.size());
    reused += expected.size();
    // What is left is solved in part. A copy comes behind its source, so it is never the first.
    AddResults rest = results(study, points, kWorker);
    const IntervalSet settled = store_.studies().back().settled;
    for (std::uint64_t number = 0; number < points->size(); ++number) {
      if (points->is_left_in(number) && !settled.contains(number) && random() % 2 == 0) {
        rest.results.push_back(solved_point(number));
        solved.emplace(inputs_of(*points, number),
                       std::to_string(study) + "/" + std::to_string(number));
      }
    }
    store_.commit(std::vector<Change>{rest});
  }
  EXPECT_GT(reused, 300U);
  EXPECT_GT(open, 300U);
}

}  // namespace
}  // namespace oblique::server
