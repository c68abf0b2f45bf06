// The schema against the tables of what a result has.
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/database/sqlite.h"
#include "server/store/store.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using solver::ResultList;
using solver::SentWith;

class SchemaTest : public testing::Test {
 protected:
  SchemaTest() { const Store store(path_); }

  /// Type by name; views have types where they show a column of a table as it is.
  std::map<std::string, std::string> columns_of(const std::string& table) const {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement list(database.get(), "SELECT name, type FROM pragma_table_info('" + table + "')");
    std::map<std::string, std::string> columns;
    while (list.step()) {
      columns.emplace(list.text(0), list.text(1));
    }
    return columns;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
};

/// The type of the column of each output that comes with a result.
std::map<std::string, std::string> expected_outputs() {
  std::map<std::string, std::string> columns;
  const auto add = [&](const std::string& type) {
    return [&columns, type](const solver::ResultField& field, const auto&) {
      columns.emplace(field.column, type);
    };
  };
  solver::for_each_stored<double>(add("REAL"));
  solver::for_each_stored<std::int64_t>(add("INTEGER"));
  solver::for_each_stored<std::string>(add("TEXT"));
  for (const ResultList* list : solver::result_lists()) {
    columns.emplace(list->column, "TEXT");
  }
  return columns;
}

TEST_F(SchemaTest, ResultsHaveAColumnForEveryOutputAndNoneWithoutOne) {
  auto expected = expected_outputs();
  expected.insert({{"study_id", "INTEGER"},
                   {"point", "INTEGER"},
                   {"model_id", "INTEGER"},
                   {"H", "REAL"},
                   {"mu", "REAL"},
                   {"e", "REAL"},
                   {"status", "TEXT"},
                   {"error", "TEXT"},
                   {"worker", "INTEGER"},
                   {"solver_version", "TEXT"},
                   {"instruction_set", "TEXT"},
                   {"attempt", "INTEGER"},
                   {"solved_at", "TEXT"},
                   {"checksum", "INTEGER"}});
  expected.emplace("taken_from", "TEXT");
  const auto shown = columns_of("results");
  EXPECT_EQ(shown.size(), expected.size());
  for (const auto& [name, type] : shown) {
    EXPECT_TRUE(expected.contains(name)) << name;
    EXPECT_TRUE(type.empty() || type == expected[name]) << name;
  }
}

TEST_F(SchemaTest, TheViewForPeopleShowsEveryOutput) {
  auto shown = columns_of("runs");
  for (const auto& [name, type] : expected_outputs()) {
    EXPECT_TRUE(shown.contains(name)) << name;
    EXPECT_TRUE(shown[name].empty() || shown[name] == type) << name;
  }
  for (const auto& field : solver::result_fields()) {
    if (field.sent_with != SentWith::kResult) {
      EXPECT_TRUE(shown.contains(std::string(field.column))) << field.column;
    }
  }
}

TEST_F(SchemaTest, ViewsOfListsHaveTheMembersOfTheirElements) {
  for (const ResultList* list : solver::result_lists()) {
    const auto view = columns_of(std::string(list->column));
    if (list->column == "ft_peaks") {
      EXPECT_TRUE(view.empty()) << "peaks has what people ask for";
      continue;
    }
    std::set<std::string> expected{"study_id", "point", "seq"};
    expected.insert(list->members.begin(), list->members.end());
    std::set<std::string> names;
    for (const auto& [name, type] : view) {
      names.insert(name);
    }
    EXPECT_EQ(names, expected) << list->column;
  }
}

}  // namespace
}  // namespace oblique::server
