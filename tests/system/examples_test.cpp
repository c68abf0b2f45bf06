// Example programs in deploy/examples that read a database.
#include <cstdlib>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/programs.h"
#include "tests/support/temporary_folder.h"

namespace oblique::test {
namespace {

using Rows = std::vector<std::vector<double>>;

/// Returns the numbers of a CSV table whose header begins with H, mu and fn_peak_N.
Rows numbers_of(const std::string& csv) {
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line.substr(0, 14), "H,mu,fn_peak_N");
  Rows rows;
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    auto& row = rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) {
      row.push_back(std::stod(cell));
    }
  }
  return rows;
}

/// An example program, and a command `needs` that succeeds if the program can run here.
struct Example {
  std::string name;
  std::vector<std::string> command;
  std::string needs;
  double relative_error = 0.0;  ///< allowed error of the printed numbers
};

void PrintTo(const Example& example, std::ostream* out) {
  *out << example.needs;
}

class Examples : public testing::TestWithParam<Example> {};

TEST_P(Examples, PrintTheSameNumbersAsTheClient) {
  if (std::system((GetParam().needs + " > /dev/null 2>&1").c_str()) != 0) {
    GTEST_SKIP() << "the example cannot run because this command fails: " << GetParam().needs;
  }
  const TemporaryFolder folder;
  const Outcome ran =
      run_oblique(folder, {"run", "--name", "grid", "--preset", "paper", "--H", "0.5,1", "--mu",
                           "0.2,0.9", "--e", "0.5,1", "--db", "grid.db"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Outcome queried =
      run_oblique(folder, {"query", "grid", "--db", "grid.db", "--where", "e = 1", "--select",
                           "H,mu,fn_peak_N", "--format", "csv"});
  const Rows expected = numbers_of(queried.out);
  ASSERT_EQ(expected.size(), 4U) << queried.err;
  const auto& command = GetParam().command;
  const Outcome outcome =
      Process(folder, command.front(), {command.begin() + 1, command.end()}).outcome();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const Rows found = numbers_of(outcome.out);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(found[i].size(), expected[i].size());
    for (std::size_t j = 0; j < expected[i].size(); ++j) {
      EXPECT_NEAR(found[i][j], expected[i][j], GetParam().relative_error * expected[i][j]);
    }
  }
}

const std::string kExamples = OBLIQUE_EXAMPLES;

INSTANTIATE_TEST_SUITE_P(
    All, Examples,
    testing::Values(Example{"Shell",
                            {"/usr/bin/sqlite3", "-readonly", "grid.db",
                             ".read '" + kExamples + "/forces.sql'"},
                            "test -x /usr/bin/sqlite3",
                            1e-14},  // the shell of SQLite prints 15 digits
                    Example{"Python",
                            {"/usr/bin/python3", kExamples + "/forces.py", "grid.db"},
                            "/usr/bin/python3 -c 'import sqlite3'"},
                    Example{"Pandas",
                            {"/usr/bin/python3", kExamples + "/cube.py", "grid.db"},
                            "/usr/bin/python3 -c 'import pandas, xarray'"},
                    Example{"R",
                            {"/usr/bin/Rscript", kExamples + "/forces.R", "grid.db"},
                            "/usr/bin/Rscript -e 'library(RSQLite)'"}),
    [](const auto& example) { return example.param.name; });

}  // namespace
}  // namespace oblique::test
