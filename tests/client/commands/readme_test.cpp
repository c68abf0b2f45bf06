#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::client {
namespace {

std::string text_of(const std::string& name) {
  std::ifstream file(std::string(OBLIQUE_SOURCE_DIR) + "/" + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Returns the text between the HTML comment that names `command` and the end comment.
std::string shown(const std::string& text, const std::string& command) {
  const std::string mark = "<!-- $ " + command + " -->\n";
  const auto begin = text.find(mark);
  if (begin == std::string::npos) {
    return "no " + mark;
  }
  const auto from = begin + mark.size();
  return text.substr(from, text.find("<!-- end -->", from) - from);
}

// Returns a command and its output in the format that .ci/tables writes.
std::string block_of(const std::string& command, const std::string& printed) {
  return "\n```\n$ " + command + "\n" + printed + "```\n\n";
}

TEST(Readme, ShowsTheBeginningOfTheReportOfOneImpact) {
  const std::string readme = text_of("README.md");
  const std::string command = "$ oblique solve --H 1 --mu 1.2 --e 1\n";
  const auto from = readme.find(command) + command.size();
  const auto shown_report = readme.substr(from, readme.find("...\n", from) - from);
  const auto printed = test::run_oblique({"solve", "--H", "1", "--mu", "1.2", "--e", "1"});
  ASSERT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_EQ(printed.out.substr(0, shown_report.size()), shown_report);
}

TEST(Readme, ShowsTheTablesThatCommandsPrint) {
  for (const auto& [file, words] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"client/paper/README.md", {"paper"}},
           {"worker/solver/README.md", {"columns", "--trace"}},
           {"client/io/README.md", {"columns"}}}) {
    std::string command = "oblique";
    for (const auto& word : words) {
      command += ' ' + word;
    }
    const auto printed = test::run_oblique(words);
    ASSERT_EQ(printed.exit_code, 0) << printed.err;
    EXPECT_EQ(shown(text_of(file), command), block_of(command, printed.out))
        << ".ci/tables writes the tables into " << file;
  }
}

TEST(Readme, QuotesTheNumbersOfTheComparisonWithThePaper) {
  const auto printed = test::run_oblique({"paper"});
  std::smatch number;
  ASSERT_TRUE(std::regex_search(
      printed.out, number,
      std::regex("(\\d+) reliable published numbers: rms difference (\\S+ %), largest (\\S+ %)")));
  const std::string summary = text_of("README.md");
  EXPECT_NE(summary.find("The " + number.str(1) + " trustworthy numbers"), std::string::npos);
  EXPECT_NE(summary.find("rms difference of " + number.str(2)), std::string::npos);
  EXPECT_NE(summary.find("the largest, " + number.str(3)), std::string::npos);
}

}  // namespace
}  // namespace oblique::client
