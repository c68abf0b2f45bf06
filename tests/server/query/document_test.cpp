// Compares server/store/tables.md with its sources: the comments in the schema and the columns that
// `oblique columns` prints.
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <string>

#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "server/query/columns.h"
#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

using Comments = std::map<std::string, std::string>;

/// Returns the comments of columns in CREATE TABLE. A comment is on the line of its column or on
/// the lines before it.
Comments comments_of(const std::string& create) {
  static const std::regex kLine("[ \n]*(\\w*)[^\n]*?(?:-- ([^\n]*))?(?:\n|$)");
  Comments comments;
  std::string above;
  for (auto line = std::sregex_iterator(create.begin(), create.end(), kLine);
       line != std::sregex_iterator(); ++line) {
    const std::string name = (*line)[1];
    const std::string comment = (*line)[2];
    if (!name.empty()) {
      comments[name] = comment.empty() ? above : comment;
    }
    above = name.empty() ? above + (above.empty() ? "" : " ") + comment : "";
  }
  return comments;
}

/// Returns units and meanings of the columns of views that contain a result's lists.
const Comments& list_columns() {
  static const Comments kColumns{
      {"seq",
       " | its place in the list, from 0; of reaction_peaks 0 is the pin O, 1 the first joint"},
      {"t_s", "s | instant, counted from touch"},
      {"t0_s", "s | beginning, counted from touch"},
      {"t1_s", "s | end, counted from touch"},
      {"kind", " | compression or restitution"},
      {"fn_N", "N | normal force"},
      {"ft_N", "N | largest magnitude of the tangential force around it"},
      {"force_N", "N | magnitude of the largest force"},
      {"major", " | 1: major; 0: a ripple"}};
  return kColumns;
}

class DocumentTest : public StoreFixture {
 protected:
  DocumentTest() { store(); }

  /// Returns the section on a table or view. It describes each column by its comment in `comments`
  /// or as `oblique columns` does.
  std::string table_text(const std::string& title, const Comments& comments, bool has_units) const {
    const std::string table = title.substr(0, title.find(' '));
    std::string text =
        "\n#### " + title +
        (has_units ? "\n\n| column | unit | |\n|---|---|---|\n" : "\n\n| column | |\n|---|---|\n");
    for (const auto& name : rows("SELECT name FROM pragma_table_xinfo('" + table + "')")) {
      const auto comment = comments.find(name);
      const std::string written = comment == comments.end() ? "" : comment->second;
      const std::string described = has_units ? output(table, name, written) : written;
      EXPECT_FALSE(described.empty() || described.ends_with("| "))
          << table << "." << name << " is not described";
      text += "| `" + name + "` | " + described + " |\n";
    }
    return text;
  }

 private:
  static std::string output(const std::string& table, const std::string& name,
                            const std::string& comment) {
    const bool is_of_results = table == "results" || table == "runs";
    if (!is_of_results && list_columns().contains(name)) {
      return list_columns().at(name);
    }
    const Column* const column = find_column(name);
    const bool has_own = column != nullptr && (table != "results" || comment.empty());
    return (column == nullptr ? "" : column->unit) + " | " + (has_own ? column->meaning : comment);
  }
};

/// With OBLIQUE_WRITE_TABLES=1 in the environment, this test writes the document and checks
/// nothing.
TEST_F(DocumentTest, EveryTableViewAndColumnIsDocumentedAsItsSourceDescribesIt) {
  std::string tables;
  Comments of_results;
  for (const auto& name : rows("SELECT name FROM sqlite_schema WHERE type = 'table'"
                               " AND name NOT LIKE 'sqlite_%' ORDER BY rowid")) {
    const auto comments =
        comments_of(rows("SELECT sql FROM sqlite_schema WHERE name = '" + name + "'").at(0));
    of_results = name == "results" ? comments : of_results;
    tables += table_text(name, comments, name == "results");
  }
  std::string expected;
  for (const char* view : {"runs", "peaks", "phases", "stick_intervals", "reaction_peaks"}) {
    expected += table_text(std::string(view) + " (view)", of_results, true);
  }
  expected += tables;
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
      << "OBLIQUE_WRITE_TABLES=1 query_tests --gtest_filter='DocumentTest.*' writes them";
}

}  // namespace
}  // namespace oblique::server
