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
#include "server/store/store.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \n");
  const auto last = text.find_last_not_of(" \n");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

/// The comment on each column of a table: beside it, or before it.
std::map<std::string, std::string> comments_of(const std::string& create) {
  std::map<std::string, std::string> comments;
  std::istringstream lines(create);
  std::string above;
  for (std::string line; std::getline(lines, line);) {
    const auto mark = line.find("-- ");
    const std::string comment = mark == std::string::npos ? "" : trimmed(line.substr(mark + 3));
    const std::string code = trimmed(line.substr(0, mark));
    if (code.empty()) {
      above += (above.empty() ? "" : " ") + comment;
      continue;
    }
    comments[code.substr(0, code.find(' '))] = comment.empty() ? above : comment;
    above.clear();
  }
  return comments;
}

struct Description {
  std::string unit;
  std::string meaning;
};

/// Columns of the views of lists.
const std::map<std::string, Description>& list_columns() {
  static const std::map<std::string, Description> kColumns{
      {"seq",
       {"", "its place in the list, from 0; of reaction_peaks 0 is the pin O, 1 the first joint"}},
      {"t_s", {"s", "instant, counted from touch"}},
      {"t0_s", {"s", "beginning, counted from touch"}},
      {"t1_s", {"s", "end, counted from touch"}},
      {"kind", {"", "compression or restitution"}},
      {"fn_N", {"N", "normal force"}},
      {"ft_N", {"N", "largest tangential magnitude around it"}},
      {"force_N", {"N", "magnitude of the largest force"}},
      {"major", {"", "1: major; 0: a ripple"}}};
  return kColumns;
}

class Document {
 public:
  explicit Document(sqlite3* database) : database_(database) {
    Statement tables(database,
                     "SELECT name, sql FROM sqlite_schema WHERE type = 'table'"
                     " AND name NOT LIKE 'sqlite_%' ORDER BY rowid");
    while (tables.step()) {
      tables_.push_back(tables.text(0));
      comments_[tables.text(0)] = comments_of(tables.text(1));
    }
  }

  std::string text() {
    std::string text;
    for (const char* view : {"runs", "peaks", "phases", "stick_intervals", "reaction_peaks"}) {
      text += table_text(view, " (view)", true);
    }
    for (const std::string& table : tables_) {
      text += table_text(table, "", table == "results");
    }
    return text;
  }

 private:
  std::string table_text(const std::string& table, const std::string& kind, bool has_units) {
    std::string text =
        "\n#### " + table + kind +
        (has_units ? "\n\n| column | unit | |\n|---|---|---|\n" : "\n\n| column | |\n|---|---|\n");
    Statement columns(database_, "SELECT name FROM pragma_table_xinfo(?)");
    columns.bind_all(table);
    while (columns.step()) {
      const std::string name = columns.text(0);
      const Description column =
          has_units ? output(table, name) : Description{"", comments_[table][name]};
      EXPECT_FALSE(column.meaning.empty()) << table << "." << name << " is not described";
      text +=
          "| `" + name + "` | " + (has_units ? column.unit + " | " : "") + column.meaning + " |\n";
    }
    return text;
  }

  /// A column of results: as a comment of the schema describes it, or `oblique columns`.
  Description output(const std::string& table, const std::string& name) {
    Description found;
    for (const Column& column : all_columns()) {
      if (column.name == name) {
        found = {column.unit, column.meaning};
      }
    }
    if (table != "results" && table != "runs" && list_columns().contains(name)) {
      found = list_columns().at(name);
    }
    const std::string comment = comments_["results"][name];
    if (!comment.empty() && (table == "results" || found.meaning.empty())) {
      found.meaning = comment;
    }
    return found;
  }

  sqlite3* database_;
  std::vector<std::string> tables_;
  std::map<std::string, std::map<std::string, std::string>> comments_;  // by table and column
};

/// OBLIQUE_WRITE_TABLES=1 in the environment writes them instead.
TEST(DocumentTest, EveryTableViewAndColumnIsDocumentedAsItsSourceDescribesIt) {
  const test::TemporaryFolder folder;
  const Store store(folder.file("studies.db"));
  const DatabaseHandle database = open_database(folder.file("studies.db"), SQLITE_OPEN_READONLY);
  const std::string expected = Document(database.get()).text();
  const std::string document = OBLIQUE_STORE_TABLES;
  const std::string begin = "<!-- tables -->\n";
  std::ifstream file(document);
  std::string text(std::istreambuf_iterator<char>(file), {});
  const auto from = text.find(begin) + begin.size();
  const auto to = text.find("\n<!-- end of tables -->");
  ASSERT_TRUE(from != std::string::npos && to != std::string::npos && from < to);
  if (std::getenv("OBLIQUE_WRITE_TABLES") != nullptr) {
    std::ofstream(document) << text.replace(from, to - from, expected);
    return;
  }
  EXPECT_EQ(text.substr(from, to - from), expected)
      << "OBLIQUE_WRITE_TABLES=1 server_tests --gtest_filter='DocumentTest.*' writes them";
}

}  // namespace
}  // namespace oblique::server
