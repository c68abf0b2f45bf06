// Compares the expressions of studies with queries: both compute the same values from the same
// texts.
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/expression.h"
#include "server/database/database_file.h"
#include "server/query/plan.h"
#include "server/query/reader.h"
#include "tests/server/store/store_fixture.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Writes random expressions of numbers, keys, operators and functions.
class RandomText {
 public:
  explicit RandomText(unsigned seed) : random_(seed) {}

  std::string condition(int depth) {
    switch (below(depth > 0 ? 6 : 2)) {
      case 0:
      case 1:
        return fmt::format("{} {} {}", number(2), one_of({"<", "<=", ">", ">=", "==", "!="}),
                           number(2));
      case 2:
        return fmt::format("not {}", condition(depth - 1));
      case 3:
        return fmt::format("({})", condition(depth - 1));
      default:
        return fmt::format("{} {} {}", condition(depth - 1), one_of({"and", "or", "AND", "Or"}),
                           condition(depth - 1));
    }
  }

  std::string number(int depth) {
    switch (below(depth > 0 ? 8 : 3)) {
      case 0:
        return one_of({"0", "1", "2", "3", "7", "12", "100000", "94906267", "9007199254740993",
                       "0.1166477", ".5", "2.", "1e-3", "2.5E+2", "0.0"});
      case 1:
      case 2:
        return one_of({"mu", "H", "e", "k", "A", "I", "rho", "g", "links", "elements_per_link",
                       "eta2", "tip_mass", "spectral_radius", "dt", "dt_fall", "tolerance",
                       "length", "pi"});
      case 3:
        return call(depth);
      case 4:
        return fmt::format("(- {})", number(depth - 1));
      case 5:
        return fmt::format("({})", number(depth - 1));
      default:
        return fmt::format("{} {} {}", number(depth - 1), one_of({"+", "-", "*", "/"}),
                           number(depth - 1));
    }
  }

 private:
  std::size_t below(std::size_t limit) { return random_() % limit; }
  std::string one_of(const std::vector<std::string>& texts) { return texts[below(texts.size())]; }
  std::string call(int depth) {
    const auto functions = expressions::functions();
    const auto& function = functions[below(functions.size())];
    std::vector<std::string> arguments;
    for (std::size_t i = 0; i < function.arguments; ++i) {
      arguments.push_back(function.name == "if" && i == 0 ? condition(0) : number(depth - 1));
    }
    return fmt::format("{}({})", function.name, fmt::join(arguments, ", "));
  }

  std::mt19937 random_;
};

class LanguageTest : public StoreFixture {
 protected:
  LanguageTest() {
    const Table points = table(recipe());
    const auto study = study_of(points);
    AddResults results = results_of(study, {});
    for (std::uint64_t point = 0; point < points->size(); ++point) {
      results.results.push_back(solved_point(point, *points));
    }
    commit({study, worker(1), results});
    database_ = open_for_reading(path_);
    restrict_to_reading(database_.get());
  }

  static protocol::Recipe recipe(const std::string& where = {}) {
    protocol::Recipe recipe = protocol::recipe_of(
        {{protocol::listed("k", {1e7, 2e7}), protocol::listed("elements_per_link", {3, 4}),
          protocol::listed("H", {0.5, 1.0}), protocol::listed("mu", {0.0, 1.0 / 3.0, 0.4, 1.0}),
          protocol::listed("e", {0.8, 1.0})}});
    recipe.mutable_blocks(0)->set_where(where);
    return recipe;
  }

  /// Returns the value of `text` in the query at each point; NaN for NULL.
  std::vector<double> in_query(const std::string& text) {
    protocol::StudyQuery question;
    question.set_study("a");
    question.add_select(fmt::format("({})", text));
    const Plan planned = plan(database_.get(), question);
    std::vector<double> values;
    while (sqlite3_step(planned.statement.get()) == SQLITE_ROW) {
      const bool is_null = sqlite3_column_type(planned.statement.get(), 0) == SQLITE_NULL;
      values.push_back(is_null ? kNaN : sqlite3_column_double(planned.statement.get(), 0));
    }
    return values;
  }

  /// Returns the points that a query with the condition finds.
  std::vector<std::string> found(const std::string& where) {
    protocol::StudyQuery question;
    question.set_study("a");
    question.add_select("point");
    question.set_where(where);
    return rows(database_.get(), plan(database_.get(), question).sql);
  }

  std::string query_error(const std::string& where) {
    try {
      found(where);
    } catch (const solver::InputError& error) {
      return error.what();
    }
    return "none";
  }

  /// Returns the value of `text` as an expression of a study at each point.
  static std::vector<double> in_study(const std::string& text) {
    const protocol::PointTable points(recipe());
    const expressions::Expression expression(
        text, [](std::string_view name) { return protocol::key_number(name); });
    std::vector<double> values;
    for (std::uint64_t i = 0; i < points.size(); ++i) {
      const auto point = points.point(i);
      const auto model = points.model(points.point(i).model);
      std::vector<double> keys;
      for (const auto& key : solver::model_keys()) {
        keys.push_back(key.get(model));
      }
      keys.resize(std::max({protocol::key_number("H"), protocol::key_number("mu"),
                            protocol::key_number("e")}) +
                  1);
      keys[protocol::key_number("H")] = point.H_m;
      keys[protocol::key_number("mu")] = point.mu;
      keys[protocol::key_number("e")] = point.e_star;
      values.push_back(expression.value_at(keys));
    }
    return values;
  }

  /// Expects the same values in a study and in a query. A study refuses an undefined condition. A
  /// query may find it true or false, because SQL's OR is true if either side is.
  void expect_same(const std::string& text, bool may_decide) {
    const auto expected = in_study(text);
    const auto values = in_query(text);
    ASSERT_EQ(values.size(), expected.size()) << text;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const bool are_undefined = std::isnan(values[i]) && std::isnan(expected[i]);
      if (!are_undefined && !(may_decide && std::isnan(expected[i]))) {
        ASSERT_EQ(values[i], expected[i]) << text << " at point " << i;
      }
    }
  }

  DatabaseHandle database_;
};

TEST_F(LanguageTest, RandomNumbersAreTheSameInAStudyAndInAQuery) {
  RandomText random(1);
  for (int i = 0; i < 1500; ++i) {
    expect_same(random.number(4), false);
  }
}

TEST_F(LanguageTest, RandomConditionsAreTheSameInAStudyAndInAQuery) {
  RandomText random(2);
  for (int i = 0; i < 1500; ++i) {
    expect_same(random.condition(3), true);
  }
}

TEST_F(LanguageTest, AFilterAndAQueryFindTheSamePoints) {
  for (const char* where :
       {"mu > 1/3", "log(k) > 16.7", "elements_per_link / 2 == 2", "round(mu * 2.5) == 1",
        "mu - 0.4", "1 / mu > 2", "NOT mu > 0.5 AND e < 1", "if(mu > 0.3, e, H) == 1",
        "94906267 * 94906267 == 9007199515875289", "k * 900719925474099 / k == 900719925474099",
        "pow(mu, 0.5) > .6", "mu > pi / 9", "min(mu, e) == max(mu, 0)", "log10(mu) < -0.4"}) {
    const protocol::PointTable points(recipe(where));
    std::vector<std::string> expected;
    for (std::uint64_t i = 0; i < points.size(); ++i) {
      if (points.passes_filter(i)) {
        expected.push_back(std::to_string(i));
      }
    }
    EXPECT_EQ(found(where), expected) << where;
  }
}

TEST_F(LanguageTest, WhatCannotBeTheSameIsRefusedInAQuery) {
  EXPECT_THAT(query_error("mu ^ 2 > 0.1"), HasSubstr("write pow(a, b)"));
  EXPECT_THAT(query_error("mu > 1 || e > 0.5"), HasSubstr("write OR"));
  EXPECT_THAT(query_error("mu > 1 && e > 0.5"), HasSubstr("&"));
  EXPECT_THAT(query_error("!mu > 1"), HasSubstr("!"));
  EXPECT_THAT(query_error("E > 1"), HasSubstr("E_Pa"));
  EXPECT_EQ(query_error("mode || ':' || e = 'x'"), "none");
}

TEST_F(LanguageTest, WhatCannotBeTheSameIsRefusedInAStudy) {
  for (const auto& [where, reason] : std::vector<std::pair<std::string, std::string>>{
           {"mu = 0.4", "=="},
           {"0.1 < mu < 0.5", "a < b && b < c"},
           {"mu % 2", "operator"},
           {"round(mu, 1) == 0.4", "1 argument"},
           {"log(2, mu) == 0.4", "1 argument"},
           {"integrator == 0", "`integrator` has no number"}}) {
    try {
      const protocol::PointTable points(recipe(where));
      ADD_FAILURE() << where;
    } catch (const solver::InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(reason)) << where;
    }
  }
  auto lengths = recipe("length > 0.3");
  *lengths.mutable_blocks(0)->add_axes() = protocol::listed("length1", {0.3});
  EXPECT_THROW(protocol::PointTable{lengths}, solver::InputError);
}

TEST_F(LanguageTest, TextsAreNotNumbers) {
  EXPECT_EQ(sqlite3_step(plan(database_.get(),
                              [] {
                                protocol::StudyQuery question;
                                question.set_study("a");
                                question.add_select("log(mode)");
                                return question;
                              }())
                             .statement.get()),
            SQLITE_ERROR);
  EXPECT_THAT(sqlite3_errmsg(database_.get()), HasSubstr("log needs numbers"));
}

}  // namespace
}  // namespace oblique::server
