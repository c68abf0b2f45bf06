// Tests the ranges of points that conditions select, and compares planned with plain queries.
#include "server/query/plan.h"

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "server/database/database_file.h"
#include "server/query/reader.h"
#include "tests/server/store/store_fixture.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

using protocol::Axis;
using protocol::listed;
using protocol::range;
using protocol::Recipe;
using Ranges = std::vector<PointRange>;

/// Returns a grid with ten values per axis: H from 0.1 to 1, mu from 0.2 to 2, e from 0.1 to 1.
Recipe cube() {
  return protocol::recipe_of(
      {{range("H", 0.1, 1.0, 10), range("mu", 0.2, 2.0, 10), range("e", 0.1, 1.0, 10)}});
}

Ranges ranges(const std::string& condition) {
  return point_ranges(cube(), condition);
}

TEST(PointRanges, RangesAreOneAxisValueWiderAtEachEnd) {
  EXPECT_EQ(ranges("H = 0.3"), (Ranges{{100, 399}}));
  EXPECT_EQ(ranges("H < 0.3"), (Ranges{{0, 399}}));
  EXPECT_EQ(ranges("H >= 0.8"), (Ranges{{600, 999}}));
  EXPECT_EQ(ranges("H BETWEEN 0.3 AND 0.5 AND mu > 0"), (Ranges{{100, 599}}));
  EXPECT_EQ(ranges("H = 0.3 AND (mu = 2 AND fn_peak_N > 1)"),
            (Ranges{{180, 199}, {280, 299}, {380, 399}}));
}

TEST(PointRanges, ListedValuesAreExact) {
  const auto recipe = protocol::recipe_of(
      {{listed("k", {3e7, 1e7}), listed("H", {0.5}), listed("mu", {0.1, 0.2}), listed("e", {1.0})},
       {listed("H", {0.5, 0.6}), listed("mu", {0.3}), listed("e", {1.0})}});
  EXPECT_EQ(point_ranges(recipe, "k = 1e7 AND mu = 0.2"), (Ranges{{3, 3}}));
  EXPECT_EQ(point_ranges(recipe, "mu = 0.3 AND H >= 0.6"), (Ranges{{5, 5}}));
  EXPECT_EQ(point_ranges(recipe, "H = 0.7"), Ranges());
}

TEST(PointRanges, ConditionsOtherThanComparisonsOfAxesRestrictNoPoints) {
  for (const char* condition :
       {"", "NOT H = 0.3", "H <> 0.3", "H = 0.3 = 1", "H + 0 = 0.3", "fn_peak_N > 3", "H = mu",
        "CASE WHEN mu > 1 AND H = 0.3 AND e = 1 THEN 1 END", "H = '0.3'", "H = 0x1",
        "H = 0.3 OR fn_peak_N > 1", "H IN (0.3)", "H NOT BETWEEN 0.1 AND 0.2", "integrator = 0",
        "E = 7e10", "H = 0.3 COLLATE NOCASE", "(H = 0.3) = 0",
        "mu BETWEEN 1 BETWEEN 0 AND H = 0.3 AND 2"}) {
    EXPECT_EQ(ranges(condition), (Ranges{{0, 999}})) << condition;
  }
}

TEST(PointRanges, TheirNumberStaysSmallInHugeStudies) {
  const auto recipe = protocol::recipe_of(
      {{range("H", 0.1, 1.0, 10'000), range("mu", 0.0, 1.0, 10'001), range("e", 0.1, 1.0, 9'999)}});
  EXPECT_EQ(points_in(point_ranges(recipe, "H = 0.1 AND mu = 0 AND e = 1")), 2U * 2 * 2);
  EXPECT_EQ(point_ranges(recipe, "e = 1").size(), 1U);
  const std::vector<Axis> block{range("H", 0.1, 1.0, 100), range("mu", 0.0, 1.0, 90),
                                range("e", 0.1, 1.0, 100)};
  EXPECT_EQ(point_ranges(protocol::recipe_of({block, block}), "e = 1").size(), 18'000U);
  EXPECT_EQ(point_ranges(protocol::recipe_of({block, block, block}), "e = 1").size(), 1U);
}

// ---- Random studies and conditions --------------------------------------------------------------

/// Draws random studies and conditions, which are the same on every machine.
class Drawn {
 public:
  explicit Drawn(unsigned seed) : engine_(seed) {}

  std::size_t below(std::size_t limit) { return engine_() % limit; }
  bool once_in(std::size_t times) { return below(times) == 0; }
  template <class T>
  const T& of(const std::vector<T>& list) {
    return list[below(list.size())];
  }

  Recipe recipe() {
    std::vector<std::vector<Axis>> blocks(1 + below(3));
    for (auto& axes : blocks) {
      if (once_in(2)) {
        axes.push_back(axis("k", 1e7, 4e7, 1 + below(3)));
      }
      axes.push_back(axis("H", 0.1, 1.1, 1 + below(11)));
      axes.push_back(axis("mu", 0.0, 2.0, 1 + below(12)));
      axes.push_back(axis("e", 0.1, 1.0, 1 + below(10)));
    }
    Recipe recipe = protocol::recipe_of(blocks);
    for (protocol::Block& block : *recipe.mutable_blocks()) {
      make_unusual(block);
    }
    return recipe;
  }

  /// Returns a random condition, mostly a conjunction. It compares axes and outputs with values of
  /// axes and with arbitrary numbers.
  std::string condition(const Recipe& recipe, int depth = 0) {
    const std::size_t kind = depth == 0 && !once_in(4) ? 5 : below(depth < 3 ? 9 : 4);
    const auto inner = [&] { return condition(recipe, depth + 1); };
    switch (kind) {
      case 4:
        return fmt::format("({})", inner());
      case 5:
        return fmt::format("{} AND {}", inner(), inner());
      case 6:
        return fmt::format("{} or {}", inner(), inner());
      case 7:
        return once_in(3) ? fmt::format("NOT {}", inner())
                          : fmt::format("({}) AND ({})", inner(), inner());
      case 8:
        return once_in(4)
                   ? fmt::format("CASE WHEN {} THEN {} ELSE {} END", inner(), inner(), inner())
                   : fmt::format("({}) OR ({})", inner(), inner());
      default:
        return comparison(recipe);
    }
  }

 private:
  /// Makes the block a zip or a sample, adds an expression or a filter, or changes nothing.
  void make_unusual(protocol::Block& block) {
    auto& e = *block.mutable_axes(block.axes_size() - 1);
    switch (below(6)) {
      case 0:
        for (Axis& side : *block.mutable_axes()) {
          side = once_in(4) ? listed(side.key(), {0.5}) : axis(side.key(), 0.1, 0.9, 5);
        }
        block.set_zip(true);
        break;
      case 1:
        e.Clear();
        e.set_key("e");
        e.mutable_distribution()->set_from(0.2);
        e.mutable_distribution()->set_to(0.9);
        block.mutable_sample()->set_count(40);
        block.mutable_sample()->set_seed(below(1000));
        break;
      case 2:
        e.Clear();
        e.set_key("e");
        e.set_expression("0.5 + H / 4");
        break;
      case 3:
        block.set_where("mu < 0.5 * e + H");
        break;
      default:
        break;
    }
  }

  Axis axis(const std::string& key, double from, double to, std::size_t count) {
    if (count > 1 && once_in(2)) {
      Axis spaced = range(key, from, to, count);
      if (from > 0.0 && once_in(2)) {
        spaced.set_spacing(protocol::SPACING_LOGARITHMIC);
      }
      return spaced;
    }
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i) {
      values.push_back(from + (to - from) * static_cast<double>(i) / static_cast<double>(count));
    }
    std::shuffle(values.begin(), values.end(), engine_);
    return listed(key, values);
  }

  std::string comparison(const Recipe& recipe) {
    if (once_in(25)) {
      return "error IS NOT NULL";
    }
    const auto& block =
        recipe.blocks(static_cast<int>(below(static_cast<std::size_t>(recipe.blocks_size()))));
    const auto& drawn =
        block.axes(static_cast<int>(below(static_cast<std::size_t>(block.axes_size()))));
    const std::vector<std::string> others{"fn_peak_N", "point", "duration_s"};
    const bool is_other = once_in(5);
    const std::string column = is_other ? of(others) : drawn.key();
    const auto value = [&] {
      if (column == "point") {
        return std::to_string(below(200));
      }
      const double chosen = protocol::has_own_values(drawn)
                                ? protocol::axis_value(drawn, below(protocol::axis_size(drawn)))
                                : 0.5 + static_cast<double>(below(10)) / 40.0;
      return solver::exact_number(once_in(4) ? chosen * 1.01 : chosen);
    };
    const std::vector<std::string> signs{"=", "==", "<", "<=", ">", ">=", "<>", "!=", "IS"};
    switch (below(5)) {
      case 0:
        return fmt::format("{} BETWEEN {} AND {}", column, value(), value());
      case 1:
        return fmt::format("{}{} IN ({}, {}, {})", column, once_in(4) ? " NOT" : "", value(),
                           value(), value());
      case 2:
        return fmt::format("{} {} {}", value(), of(signs), column);
      default:
        return fmt::format("{} {} {}", column, of(signs), value());
    }
  }

  std::mt19937 engine_;
};

/// Returns a study with results. If `number` is a multiple of 4, a third of the rows is missing.
std::vector<Change> stored_study(std::uint64_t number, const Recipe& recipe) {
  const Table points = table(recipe);
  AddResults results{number, points, 0, "", "", 1, "now", {}};
  for (std::uint64_t point = 0; point < points->size(); ++point) {
    if (points->passes_filter(point) && (number % 4 != 0 || point % 3 != 0)) {
      results.results.push_back(point % 7 == 0 ? protocol::failed_point(point, "why")
                                               : solved_point(point));
    }
  }
  return {AddStudy{number, "s" + std::to_string(number), points, "now"}, results};
}

using SameRows = StoreFixture;

TEST_F(SameRows, APlanReturnsTheSameRowsAsSqliteAlone) {
  constexpr std::uint64_t kStudies = 10;
  constexpr int kConditions = 60;
  Drawn drawn(7);
  std::vector<Recipe> recipes;
  for (std::uint64_t number = 1; number <= kStudies; ++number) {
    recipes.push_back(drawn.recipe());
    commit(stored_study(number, recipes.back()));
  }
  const auto database = open_for_reading(path_);
  restrict_to_reading(database.get());
  int narrowed = 0;
  for (std::uint64_t number = 1; number <= kStudies; ++number) {
    const Recipe& recipe = recipes[number - 1];
    for (int i = 0; i < kConditions; ++i) {
      protocol::StudyQuery question;
      question.set_study("s" + std::to_string(number));
      question.set_where(drawn.condition(recipe));
      question.add_select("point");
      question.set_order(
          drawn.of<std::string>({"", "", "point DESC", "mu, H DESC, e, k, point", "mu, point",
                                 "H DESC, mu, point", "e DESC, point"}));
      if (drawn.once_in(3)) {
        question.set_limit(drawn.below(20));
      }
      const std::string brute = fmt::format(
          "SELECT point FROM runs WHERE study_id = {} AND ({}) ORDER BY {} LIMIT {}", number,
          question.where(), question.order().empty() ? "point" : question.order(),
          question.has_limit() ? static_cast<std::int64_t>(question.limit()) : -1);
      const auto planned = plan(database.get(), question);
      ASSERT_EQ(rows(database.get(), planned.sql), rows(database.get(), brute))
          << planned.sql << '\n'
          << brute;
      const auto read = points_in(point_ranges(recipe, question.where()));
      narrowed += read < protocol::PointTable(recipe).size() ? 1 : 0;
    }
  }
  EXPECT_GT(narrowed, static_cast<int>(kStudies) * kConditions / 4);
}

}  // namespace
}  // namespace oblique::server
