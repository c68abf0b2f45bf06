#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/study/study_text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

struct Wrong {
  std::string text;      // a whole file, lines of [model], or a line of a block
  std::string place;     // line and column
  std::string expected;  // part of the error message
};

/// `whole` turns the text of a case into a complete study file.
template <typename Whole>
void expect_refused(const std::vector<Wrong>& cases, Whole whole) {
  for (const auto& [text, place, expected] : cases) {
    SCOPED_TRACE(text.substr(0, 100));
    try {
      parsed(whole(text), "study.toml");
      ADD_FAILURE() << "the invalid study file was accepted";
    } catch (const solver::InputError& error) {
      EXPECT_EQ(error.fields().place, "study.toml" + (place.empty() ? "" : ":" + place));
      EXPECT_THAT(error.what(), testing::HasSubstr(expected));
    }
  }
}

TEST(WrongStudyFile, IsRefusedWithThePlace) {
  const std::string point = kPoint;
  expect_refused(
      {{"name = \n", "1:8", "value"},
       {"name = 'a'\nname = 'b'\n", "2:8", "name"},
       {"nam = 'x'\n" + point, "1:1", "`nam` (did you mean `name`?)"},
       {"mu = 0.4\n" + point, "1:1", "H, mu and e belong in a block"},
       {"errors = 1\n" + point, "1:10", "errors = 1 is a number: it must be true or false"},
       {"name = 3\n" + point, "1:8", "name = 3 is a number: it must be a string"},
       {"name = ''\n" + point, "1:8", "1 to 100 bytes"},
       {"name = \"a\\u001b[2J\"\n" + point, "1:8", "a\\x1b[2J"},
       {"name = \"a\\u202eb\"\n" + point, "1:8", "a\\u202eb"},
       {"name = 'x'\n", "", "no [[block]]: a study needs at least one, with H, mu and e"},
       {"block = []\n", "1:9", "block = []"},
       {"block = [3]\n", "1:9", "write [[block]]"},
       {"[block]\nH = 1\nmu = 0.4\ne = 1\n", "1:1", "write [[block]]"},
       {"model = 3\n" + point, "1:9", "write [model]"},
       {point + block_with("H = 1.3"), "6:5", "H = 1.3"},
       {"[[block]]\nmu = 0.4\ne = 1\n", "1:1", "H is missing: every block needs H, mu and e"},
       {"[[block]]\nzip = true\nH = [0.5, 0.6]\nmu = [0.4, 0.5, 0.6]\ne = 1\n", "3:5", "H has 2 v"},
       {"[model]\nlengths = [0.4, 0.2]\n" + block_with("H = 0.7"), "4:5", "H = 0.7 m"},
       {"[model]\nlengths = [0.4]\nlinks = 2\n" + point, "2:11", "give lengths, one per link"}},
      [](const std::string& text) { return text; });
}

TEST(WrongStudyFile, WithAWrongModelIsRefused) {
  expect_refused(
      {{"elements_per_lnk = 4", "2:20", "`elements_per_lnk` (did you mean `elements_per_link`?)"},
       {"k = 'stiff'", "2:5", "k = 'stiff' is a string: it must be a number"},
       {"k = [0.1, 0.3, 'x', [1]]", "2:5", "k = [0.1, 0.3, 'x', a list] is a list"},
       {"k = { from = 0.1, to = 2 }", "2:5", "k = { from = 0.1, to = 2 } is a table"},
       {"rho = -1", "2:7", "rho = -1 kg/m^3 is not allowed: rho must be > 0"},
       {"rho = nan", "2:7", "rho = nan"},
       {"preset = 'papre'", "2:10", "preset must be standard, paper, printed, converged"},
       {"preset = 3", "2:10", "preset = 3"},
       {"integrator = 'euler'", "2:14", "integrator must be explicit"},
       {"integrator = 0", "2:14", "the name of one, in quotes: explicit"},
       {"lengths = 0.4", "2:11", "lengths = 0.4"},
       {"lengths = []", "2:11", "lengths = [] is not allowed"},
       {"lengths = [0.4, 'x']", "2:17", "a list of numbers"},
       {"lengths = [\n0.4,\n-0.4]", "4:1", "lengths = -0.4 m is not allowed"}},
      [](const std::string& line) { return "[model]\n" + line + "\n" + kPoint; });
}

TEST(WrongStudyFile, WithAWrongAxisIsRefused) {
  expect_refused(
      {{"mu = 0.4\nmuu = 1", "4:7", "`muu` (did you mean `mu`?): the keys are"},
       {"mu = 0.4\npreset = 'paper'", "4:10", "preset cannot be an axis"},
       {"mu = -0.4", "3:6", "mu = -0.4 is not allowed: mu must be >= 0"},
       {"e = [0.5, 1.1]", "4:11", "e = 1.1 is not allowed: e must be in [0.001, 1]"},
       {"mu = 'rough'", "3:6", "mu = \"rough\": unknown key `rough`"},
       {"mu = \"\"", "3:6", "mu = \"\" is empty"},
       {"mu = true", "3:6", "mu = true is a boolean"},
       {"mu = 1979-05-27", "3:6", "a date or time"},
       {"mu = 9007199254740993", "3:6", "more digits"},
       {"mu = [\n0.4,\n'a',\n0.6]", "5:1", "a list of numbers"},
       {"mu = [\n0.4,\n0.5,\n-0.6]", "6:1", "mu = -0.6"},
       {"mu = 0.4\nintegrator = [\n'explicit',\n'euler']", "6:1", "euler"},
       {"mu = 0.4\nintegrator = [0]", "4:15", "explicit"},
       {"mu = []", "3:6", "mu = [] has no values: give at least one"},
       {"mu = [0.4, 0.4]", "3:6", "mu has 0.4 twice"},
       {"mu = { from = 2, to = 1, count = 3 }", "3:6", "mu from 2 to 1 is reversed"},
       {"mu = { from = 1, to = 2, cuont = 3 }", "3:26", "`cuont` (did you mean `count`?)"},
       {"mu = { from = 1, count = 3 }", "3:6", "give `from`, `to` and either `count` or `step`"},
       {"mu = { from = 1, to = 2 }", "3:6", "either `count` or `step`"},
       {"mu = { from = 1, to = 2, count = 2, step = 1 }", "3:6", "either `count` or `step`"},
       {"mu = { from = 'a', to = 2, count = 2 }", "3:15", "mu: from = 'a' is a string"},
       {"mu = { from = 1, to = 2, count = 2.5 }", "3:6", "count = 2.5 is not allowed"},
       {"mu = { from = 0, to = 1, count = 2000000000000 }", "1:1", "1000000000000 points"},
       {"mu = { from = 0.5, to = 1, step = 0.2 }", "3:6", "step = 0.2 does not lead from 0.5 to 1"},
       {"mu = { from = 1, to = 2, count = 3, spacing = 'lgo' }", "3:47", "linear or log"},
       {"mu = { from = 1, to = 2, step = 1, spacing = 'log' }", "3:46", "with `step` only linear"},
       {"mu = { from = 0, to = 2, count = 3, spacing = 'log' }", "3:6",
        "logarithmic ends must be > 0"},
       {"mu = { csv = 3 }", "3:14", "mu: csv = 3 is a number: it must be the name of a file"},
       {"mu = { column = 'a' }", "3:6", "`column` needs `csv`"},
       {"mu = { csv = 'a.csv', colum = 'a' }", "3:23", "`colum` (did you mean `column`?)"},
       {"mu = { distribution = 'nromal', mean = 1, sd = 1 }", "3:6", "did you mean `normal`"},
       {"mu = { distribution = 'normal', mean = 1 }", "3:6", "needs mean and sd"},
       {"mu = { distribution = 'uniform', from = 0, to = 1 }", "3:6",
        "only a sample draws from one"},
       {"H = [1, 1.19]", "2:5", "drop of 1.179156 m, so H must be at most that"}},
      block_with);
}

TEST(WrongStudyFile, WithAWrongKeyOfABlockIsRefused) {
  expect_refused(
      {{"zip = 'yes'", "5:7", "zip = 'yes' is a string: it must be true or false"},
       {"wheer = 'mu > 1'", "5:1", "`wheer` (did you mean `where`?)"},
       {"where = true", "5:9", "a condition in quotes"},
       {"where = 'mu >'", "5:9", "where = \"mu >\": a value is missing at its end"},
       {"I = 'AA^2'", "5:5", "I = \"AA^2\": unknown key `AA`"},
       {"columns = { H = 'a' }", "5:11", "columns needs `csv`"},
       {"sample = 'sobol'", "5:10", "sample = 'sobol' is a string"},
       {"where = ''", "5:9", "where = \"\" is empty"},
       {"sample = { kind = 'sobol' }", "5:10", "lacks `count`"},
       {"sample = { kind = 'sobl', count = 3 }", "5:10", "did you mean `sobol`"},
       {"sample = { kind = 'sobol', count = 1e5 }", "5:36", "it must be an integer"},
       {"sample = { kind = 'lhs', count = 0 }", "5:10", "count = 0 is not allowed"},
       {"sample = { kind = 'lhs', count = 1, seed = -1 }", "5:10", "seed = -1 is not allowed"},
       {"sample = { kind = 'lhs', cuont = 1 }", "5:26", "`cuont` (did you mean `count`?)"}},
      [](const std::string& line) { return kPoint + line + "\n"; });
}

}  // namespace
}  // namespace oblique::client
