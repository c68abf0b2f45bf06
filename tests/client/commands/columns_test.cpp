#include "server/query/columns.h"

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/io/row_output.h"
#include "proto/wire/chunk.h"
#include "tests/support/programs.h"

namespace oblique::client {
namespace {

std::set<std::string> described_columns() {
  std::set<std::string> names;
  for (const auto& column : server::all_columns()) {
    EXPECT_TRUE(names.insert(column.name).second) << column.name << " is described twice";
  }
  return names;
}

// Returns the member names of a JSON object; a nested name has the form energy.friction_J.
std::set<std::string> members_of(const nlohmann::ordered_json& json) {
  std::set<std::string> names;
  for (const auto& [name, value] : json.items()) {
    if (!value.is_object()) {
      names.insert(name);
      continue;
    }
    for (const auto& [inner, ignored] : value.items()) {
      names.insert(name + "." + inner);
    }
  }
  return names;
}

// Results of one point: the output of `solve --json`, and all columns that `run` stored.
class OneResult : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const test::TemporaryFolder folder;
    const std::vector<std::string> point{"--preset", "paper", "--H", "1",
                                         "--mu",     "1.2",   "--e", "0.9"};
    const auto with_point = [&](std::vector<std::string> words) {
      words.insert(words.end(), point.begin(), point.end());
      return test::run_oblique(folder, words);
    };
    solved = nlohmann::ordered_json::parse(with_point({"solve", "--json"}).out);
    ASSERT_EQ(with_point({"run", "--name", "a"}).exit_code, 0);
    const auto rows =
        test::run_oblique(folder, {"query", "a", "--select", "*", "--format", "json"});
    ASSERT_EQ(rows.exit_code, 0) << rows.err;
    row = nlohmann::ordered_json::parse(rows.out)[0];
  }

  static inline nlohmann::ordered_json solved;
  static inline nlohmann::ordered_json row;
};

TEST_F(OneResult, DescriptionsCoverExactlyTheColumnsOfQueries) {
  std::set<std::string> names;
  for (const auto& [name, value] : row.items()) {
    names.insert(name);
  }
  EXPECT_EQ(described_columns(), names);
}

TEST_F(OneResult, DescriptionsCoverExactlyTheMembersOfSolveJson) {
  std::set<std::string> names;
  for (const auto& column : server::all_columns()) {
    if (!column.solve_json.empty()) {
      names.insert(column.solve_json);
    }
  }
  EXPECT_EQ(names, members_of(solved));
}

// Stored rows contain all digits of scalars, but only eight digits of numbers in lists.
void expect_same(const nlohmann::ordered_json& stored, const nlohmann::ordered_json& member,
                 const std::string& name, bool is_in_list = false) {
  if (member.is_structured()) {
    ASSERT_EQ(stored.size(), member.size()) << name;
    auto kept = stored.begin();
    for (auto part = member.begin(); part != member.end(); ++part, ++kept) {
      expect_same(*kept, *part, name, true);
    }
  } else if (member.is_number_float() && is_in_list) {
    const auto value = member.get<double>();
    EXPECT_NEAR(stored.get<double>(), value, 5.1e-8 * std::abs(value)) << name;
  } else {
    EXPECT_EQ(stored, member) << name;
  }
}

TEST_F(OneResult, QueriesAndSolveJsonGiveTheSameValuesInAllStoredDigits) {
  for (const auto& column : server::all_columns()) {
    if (column.solve_json.empty() || column.name == "wall_s") {
      continue;
    }
    const auto dot = column.solve_json.find('.');
    const auto& member =
        dot == std::string::npos
            ? solved[column.solve_json]
            : solved[column.solve_json.substr(0, dot)][column.solve_json.substr(dot + 1)];
    expect_same(row[column.name], member, column.name);
  }
}

TEST(Columns, ShowShortTimesInTheSameUnitsAsTheReport) {
  protocol::Table rows{.columns = {"duration_s", "slide_m", "wall_s", "H", "max(duration_s)"}};
  auto& row = rows.rows.emplace_back();
  for (const double value : {0.000543704, 0.00114159, 0.001, 1.0, 0.000543704}) {
    row.emplace_back(value);
  }
  const auto chunk = protocol::chunk_of(rows);
  EXPECT_EQ(text_of({chunk}, {.shown = shown_columns(chunk)}),
            "duration_s [us]  slide_m [mm]  wall_s [ms]  H  max(duration_s)\n"
            "---------------  ------------  -----------  -  ---------------\n"
            "        543.704       1.14159            1  1      0.000543704\n");
}

}  // namespace
}  // namespace oblique::client
