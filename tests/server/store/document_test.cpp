// The tables of server/store/README.md against the one source of each: the comments of the schema
// for tables, the columns of `oblique columns` for views.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/database/sqlite.h"
#include "server/query/columns.h"
#include "server/store/store.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \n");
  const auto last = text.find_last_not_of(" \n");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

/// What the text of a table says of each column: the comment beside it, or the one before it.
std::map<std::string, std::string> comments_of(const std::string& create) {
  std::map<std::string, std::string> comments;
  std::istringstream lines(create);
  std::string line;
  std::string above;
  std::string last;
  while (std::getline(lines, line)) {
    const auto mark = line.find("-- ");
    const std::string comment = mark == std::string::npos ? "" : trimmed(line.substr(mark + 3));
    const std::string code = trimmed(line.substr(0, mark));
    if (code.empty()) {
      above += (above.empty() ? "" : " ") + comment;
      continue;
    }
    last = code.substr(0, code.find(' '));
    comments[last] = comment.empty() ? above : comment;
    above.clear();
  }
  return comments;
}

class DocumentTest : public testing::Test {
 protected:
  DocumentTest() {
    { const Store store(path_); }
    database_ = open_database(path_, SQLITE_OPEN_READONLY);
    for (const Column& column : all_columns()) {
      known_.emplace(column.name, column);
    }
    for (const auto& key : {"study_id", "point"}) {
      in_lists_.emplace(key, known_.at(key));
    }
    const auto add = [&](const char* name, const char* unit, const char* meaning) {
      in_lists_.emplace(name, Column{name, unit, "", "", meaning});
    };
    add("seq", "",
        "its place in the list, from 0; of reaction_peaks 0 is the pin O, 1 the first joint");
    add("t_s", "s", "instant, counted from touch");
    add("t0_s", "s", "beginning, counted from touch");
    add("t1_s", "s", "end, counted from touch");
    add("kind", "", "compression or restitution");
    add("fn_N", "N", "normal force");
    add("ft_N", "N", "largest tangential magnitude around it");
    add("force_N", "N", "magnitude of the largest force");
    add("major", "", "1: major; 0: a ripple");
    in_rows_.emplace(
        "checksum",
        Column{"checksum", "", "", "", "CRC-32 of what packed_results has of the row; NULL: none"});
    in_rows_.emplace("E", known_.at("E_Pa"));
  }

  std::vector<std::string> columns_of(const std::string& name) const {
    Statement list(database_.get(), "SELECT name FROM pragma_table_info(?)");
    list.bind(1, std::string_view(name));
    std::vector<std::string> names;
    while (list.step()) {
      names.push_back(list.text(0));
    }
    return names;
  }

  /// What is known of a column of a view.
  const Column& described(const std::string& view, const std::string& name) const {
    const bool is_list = columns_of(view).size() < 10;
    const auto& first = is_list ? in_lists_ : in_rows_;
    const auto found = first.find(name);
    if (found != first.end()) {
      return found->second;
    }
    const auto known = known_.find(name);
    static const Column kNone{};
    EXPECT_TRUE(known != known_.end()) << view << "." << name << " is not described";
    return known == known_.end() ? kNone : known->second;
  }

  std::string view_text(const std::string& view) const {
    std::string text = "\n#### " + view + " (view)\n\n| column | unit | |\n|---|---|---|\n";
    for (const std::string& name : columns_of(view)) {
      const Column& column = described(view, name);
      text += "| `" + name + "` | " + column.unit + " | " + column.meaning + " |\n";
    }
    return text;
  }

  std::string table_text(const std::string& table) const {
    Statement create(database_.get(), "SELECT sql FROM sqlite_schema WHERE name = ?");
    create.bind(1, std::string_view(table));
    create.step();
    const auto comments = comments_of(create.text(0));
    std::string text = "\n#### " + table + "\n\n| column | |\n|---|---|\n";
    for (const std::string& name : columns_of(table)) {
      const auto comment = comments.find(name);
      EXPECT_TRUE(comment != comments.end() && !comment->second.empty())
          << table << "." << name << " has no comment in the schema";
      text += "| `" + name + "` | " + (comment == comments.end() ? "" : comment->second) + " |\n";
    }
    return text;
  }

  std::string expected() const {
    std::string text;
    for (const char* view :
         {"runs", "results", "peaks", "phases", "stick_intervals", "reaction_peaks"}) {
      text += view_text(view);
    }
    Statement tables(database_.get(),
                     "SELECT name FROM sqlite_schema WHERE type = 'table'"
                     " AND name NOT LIKE 'sqlite%' ORDER BY rowid");
    while (tables.step()) {
      text += table_text(tables.text(0));
    }
    return text;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  DatabaseHandle database_;
  std::map<std::string, Column> known_;
  std::map<std::string, Column> in_lists_;
  std::map<std::string, Column> in_rows_;
};

/// OBLIQUE_WRITE_TABLES=1 in the environment writes them instead.
TEST_F(DocumentTest, EveryTableViewAndColumnStandsInTheReadmeAsItsSourceSaysIt) {
  const std::string readme = OBLIQUE_STORE_README;
  const std::string begin = "<!-- tables -->\n";
  const std::string end = "\n<!-- end of tables -->";
  std::ifstream file(readme);
  std::string text(std::istreambuf_iterator<char>(file), {});
  const auto from = text.find(begin);
  const auto to = text.find(end);
  ASSERT_TRUE(from != std::string::npos && to != std::string::npos && from < to);
  const auto first = from + begin.size();
  if (std::getenv("OBLIQUE_WRITE_TABLES") != nullptr) {
    const std::string written = text.replace(first, to - first, expected());
    std::ofstream(readme) << written;
    return;
  }
  EXPECT_EQ(text.substr(first, to - first), expected())
      << "OBLIQUE_WRITE_TABLES=1 server_tests --gtest_filter='DocumentTest.*' writes them";
}

}  // namespace
}  // namespace oblique::server
