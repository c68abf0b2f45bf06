// The tables of server/store/tables.md against the one source of each: the comments of the schema
// and the columns of `oblique columns`.
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
#include "server/store/schema.h"
#include "server/store/store.h"
#include "tests/support/temporary_folder.h"

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
    for (const TableDefinition& table : our_tables()) {
      comments_[table.name] = comments_of(table.sql);
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
  }

  std::vector<std::string> columns_of(const std::string& name) const {
    Statement list(database_.get(), "SELECT name FROM pragma_table_xinfo(?)");
    list.bind(1, std::string_view(name));
    std::vector<std::string> names;
    while (list.step()) {
      names.push_back(list.text(0));
    }
    return names;
  }

  /// What a table or view of results says in a column: a comment of the schema, or what `oblique
  /// columns` lists.
  Column described(const std::string& table, const std::string& name) const {
    Column column{name, "", "", "", ""};
    const auto known = known_.find(name);
    if (known != known_.end()) {
      column = known->second;
    }
    if (table != "results" && table != "runs" && in_lists_.contains(name)) {
      column = in_lists_.at(name);
    }
    const std::string comment = comment_of("results", name);
    if (!comment.empty() && (table == "results" || column.meaning.empty())) {
      column.meaning = comment;
    }
    EXPECT_FALSE(column.meaning.empty()) << table << "." << name << " is not described";
    return column;
  }

  std::string comment_of(const std::string& table, const std::string& column) const {
    const auto& comments = comments_.at(table);
    const auto found = comments.find(column);
    return found == comments.end() ? "" : found->second;
  }

  std::string text_with_units(const std::string& table, const std::string& kind) const {
    std::string text = "\n#### " + table + kind + "\n\n| column | unit | |\n|---|---|---|\n";
    for (const std::string& name : columns_of(table)) {
      const Column column = described(table, name);
      text += "| `" + name + "` | " + column.unit + " | " + column.meaning + " |\n";
    }
    return text;
  }

  std::string table_text(const std::string& table) const {
    std::string text = "\n#### " + table + "\n\n| column | |\n|---|---|\n";
    for (const std::string& name : columns_of(table)) {
      const std::string comment = comment_of(table, name);
      EXPECT_FALSE(comment.empty()) << table << "." << name << " has no comment in the schema";
      text += "| `" + name + "` | " + comment + " |\n";
    }
    return text;
  }

  std::string expected() const {
    std::string text;
    for (const char* view : {"runs", "peaks", "phases", "stick_intervals", "reaction_peaks"}) {
      text += text_with_units(view, " (view)");
    }
    for (const TableDefinition& table : our_tables()) {
      text += table.name == "results" ? text_with_units(table.name, "") : table_text(table.name);
    }
    return text;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  DatabaseHandle database_;
  std::map<std::string, Column> known_;
  std::map<std::string, Column> in_lists_;
  std::map<std::string, std::map<std::string, std::string>> comments_;
};

/// OBLIQUE_WRITE_TABLES=1 in the environment writes them instead.
TEST_F(DocumentTest, EveryTableViewAndColumnIsDocumentedAsItsSourceDescribesIt) {
  const std::string document = OBLIQUE_STORE_TABLES;
  const std::string begin = "<!-- tables -->\n";
  const std::string end = "\n<!-- end of tables -->";
  std::ifstream file(document);
  std::string text(std::istreambuf_iterator<char>(file), {});
  const auto from = text.find(begin);
  const auto to = text.find(end);
  ASSERT_TRUE(from != std::string::npos && to != std::string::npos && from < to);
  const auto first = from + begin.size();
  if (std::getenv("OBLIQUE_WRITE_TABLES") != nullptr) {
    const std::string written = text.replace(first, to - first, expected());
    std::ofstream(document) << written;
    return;
  }
  EXPECT_EQ(text.substr(first, to - first), expected())
      << "OBLIQUE_WRITE_TABLES=1 server_tests --gtest_filter='DocumentTest.*' writes them";
}

}  // namespace
}  // namespace oblique::server
