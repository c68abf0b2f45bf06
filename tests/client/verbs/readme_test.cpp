#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "tests/client/verbs/program.h"

namespace oblique::client {
namespace {

std::string contents(const std::string& name) {
  std::ifstream file(std::string(OBLIQUE_SOURCE_DIR) + "/" + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

// What stands between the mark of `command` and the end mark.
std::string shown(const std::string& text, const std::string& command) {
  const std::string mark = "<!-- " + command + " -->\n";
  const auto begin = text.find(mark);
  if (begin == std::string::npos) {
    return "no " + mark;
  }
  const auto from = begin + mark.size();
  return text.substr(from, text.find("<!-- end -->", from) - from);
}

TEST(Readme, ShowsTheTableThatItsCommandPrints) {
  const auto printed = oblique({"paper", "--format", "markdown"});
  ASSERT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_EQ(shown(contents("README.md"), "oblique paper --format markdown"),
            "\n" + printed.out + "\n")
      << ".ci/tables writes the tables into README.md";
}

TEST(Readme, DescribesEveryColumn) {
  const auto printed = oblique({"columns", "--format", "markdown"});
  ASSERT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_EQ(shown(contents("client/README.md"), "oblique columns --format markdown"),
            "\n" + printed.out + "\n")
      << ".ci/tables writes the tables into client/README.md";
}

}  // namespace
}  // namespace oblique::client
