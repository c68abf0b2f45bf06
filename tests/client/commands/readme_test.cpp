#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::client {
namespace {

std::string text_of(const std::string& name) {
  std::ifstream file(std::string(OBLIQUE_SOURCE_DIR) + "/" + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

// What stands between the mark of `command` and the end mark.
std::string shown(const std::string& text, const std::string& command) {
  const std::string mark = "<!-- $ " + command + " -->\n";
  const auto begin = text.find(mark);
  if (begin == std::string::npos) {
    return "no " + mark;
  }
  const auto from = begin + mark.size();
  return text.substr(from, text.find("<!-- end -->", from) - from);
}

// A command and what it prints, as .ci/tables writes them.
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

TEST(Readme, ShowsTheTableThatItsCommandPrints) {
  const auto printed = test::run_oblique({"paper"});
  ASSERT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_EQ(shown(text_of("client/paper/README.md"), "oblique paper"),
            block_of("oblique paper", printed.out))
      << ".ci/tables writes the tables into client/paper/README.md";
}

TEST(Readme, SummarisesTheComparisonInTheNumbersThatItsCommandPrints) {
  const auto printed = test::run_oblique({"paper"});
  std::smatch number;
  ASSERT_TRUE(std::regex_search(
      printed.out, number,
      std::regex(
          "(\\d+) trustworthy published numbers: rms difference (\\S+ %), largest (\\S+ %)")));
  const std::string summary = text_of("README.md");
  EXPECT_NE(summary.find("The " + number.str(1) + " trustworthy numbers"), std::string::npos);
  EXPECT_NE(summary.find("rms difference of " + number.str(2)), std::string::npos);
  EXPECT_NE(summary.find("the largest, " + number.str(3)), std::string::npos);
}

TEST(Readme, DescribesEveryColumnOfATrace) {
  const auto printed = test::run_oblique({"columns", "--trace"});
  ASSERT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_EQ(shown(text_of("worker/solver/README.md"), "oblique columns --trace"),
            block_of("oblique columns --trace", printed.out))
      << ".ci/tables writes the tables into worker/solver/README.md";
}

TEST(Readme, DescribesEveryColumn) {
  const auto printed = test::run_oblique({"columns"});
  ASSERT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_EQ(shown(text_of("client/io/README.md"), "oblique columns"),
            block_of("oblique columns", printed.out))
      << ".ci/tables writes the tables into client/io/README.md";
}

}  // namespace
}  // namespace oblique::client
