// Programs of other hands read a database: the examples of deploy/examples.
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/programs.h"
#include "tests/support/temporary_folder.h"

namespace oblique::test {
namespace {

using Rows = std::vector<std::vector<double>>;

/// The numbers of a CSV table with this head.
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

TEST(Examples, ReadADatabaseWithTheShellPythonPandasAndRAndAgree) {
  const TemporaryFolder folder;
  const std::string examples = OBLIQUE_EXAMPLES;
  const Outcome ran = run_oblique(folder, {"run", "--name", "grid", "--H", "0.5,1", "--mu",
                                           "0.2,0.9", "--e", "0.5,1", "--db", "grid.db"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Outcome asked = run_oblique(folder, {"query", "grid", "--db", "grid.db", "--where", "e = 1",
                                             "--select", "H,mu,fn_peak_N", "--format", "csv"});
  const Rows expected = numbers_of(asked.out);
  ASSERT_EQ(expected.size(), 4U) << asked.err;
  const std::vector<std::vector<std::string>> commands{
      {"/usr/bin/sqlite3", "-readonly", "grid.db", ".read " + examples + "/forces.sql"},
      {"/usr/bin/python3", examples + "/forces.py", "grid.db"},
      {"/usr/bin/python3", examples + "/cube.py", "grid.db"},
      {"/usr/bin/Rscript", examples + "/forces.R", "grid.db"}};
  for (const auto& command : commands) {
    ASSERT_TRUE(std::filesystem::exists(command.front()))
        << command.front() << " is missing; deploy/test installs it";
    const Outcome outcome =
        Process(folder, command.front(), {command.begin() + 1, command.end()}).outcome();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(numbers_of(outcome.out), expected) << command[1];
  }
}

}  // namespace
}  // namespace oblique::test
