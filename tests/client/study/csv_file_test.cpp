#include "client/study/csv_file.h"

#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/blocks.h"
#include "tests/support/temporary_folder.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;

std::vector<double> column(const std::string& text, const std::string& name = "drop") {
  return CsvFile(text, "measured.csv").values(name, protocol::axis_key("mu"));
}

std::string csv_error(const std::string& text, const std::string& name = "drop") {
  try {
    column(text, name);
  } catch (const solver::InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(CsvFile, GivesTheNumbersOfAColumn) {
  EXPECT_EQ(column("drop,speed\n0.4,1\n0.6,2\n"), (std::vector{0.4, 0.6}));
  EXPECT_EQ(column("speed,drop\n1,0.4"), (std::vector{0.4})) << "the last line has no line break";
}

TEST(CsvFile, ReadsFilesOfSpreadsheets) {
  EXPECT_EQ(column("\xef\xbb\xbf"
                   "drop\r\n0.4\r\n\r\n0.6\r\n"),
            (std::vector{0.4, 0.6}))
      << "byte order mark, CRLF, empty lines";
  EXPECT_EQ(column("\"a \"\"b\"\", c\",\"drop\"\n\"x,\ny\",\" 0.4\"\n , +6e-1 \n"),
            (std::vector{0.4, 0.6}))
      << "quotes, commas, doubled quotes and line breaks in them; spaces; signs and exponents";
}

TEST(CsvFile, ReadsLinesThatEndWithCarriageReturns) {
  EXPECT_EQ(column("drop,speed\r0.4,1\r\r0.6,2\r"), (std::vector{0.4, 0.6}));
  EXPECT_THAT(csv_error("drop\r0.4\r0.x\r"), HasSubstr("measured.csv:3: column `drop`"));
}

TEST(CsvFile, TakesIntegratorsByName) {
  const CsvFile file("integrator\nexplicit\ngeneralized-alpha\n", "x.csv");
  EXPECT_EQ(file.values("integrator", protocol::axis_key("integrator")), (std::vector{0.0, 1.0}));
}

// Line numbers count every line break of the file, also those in quoted fields.
TEST(CsvFile, AnErrorNamesFileLineAndColumn) {
  EXPECT_THAT(csv_error("drop\n0.4\n0.x\n"),
              HasSubstr("measured.csv:3: column `drop`: \"0.x\" is not a number"));
  EXPECT_THAT(csv_error("drop,b\n0.4,\"\n\n\"\n,1\n"),
              HasSubstr("measured.csv:5: column `drop`: the field is empty"));
  EXPECT_THAT(csv_error("drop\n-1\n"), HasSubstr("measured.csv:2: column `drop`: mu = -1"));
  EXPECT_THAT(csv_error("drop\nnan\n"), HasSubstr("measured.csv:2: column `drop`: mu = nan"));
  EXPECT_THAT(csv_error("drop\ninf\n"), HasSubstr("mu = inf"));
  EXPECT_THAT(csv_error("drop\n1e-400\n"), HasSubstr("is not a number: it is too small"));
  EXPECT_THAT(csv_error("drop\n0.4\u00a0\n"), HasSubstr("\"0.4\\xa0\" is not a number"));
  EXPECT_THAT(csv_error("drop,b\n1\n"), HasSubstr("measured.csv:2: the line has 1 fields"));
  EXPECT_THAT(csv_error("drop\n0,4\n"), HasSubstr("measured.csv:2: the line has 2 fields"));
  EXPECT_THAT(csv_error("drop\n\"1\n"), HasSubstr("measured.csv:2: a quote is not closed"));
  EXPECT_THAT(csv_error("drop\n\"1\"2\n"), HasSubstr("measured.csv:2: text follows"));
  EXPECT_THAT(csv_error("drop\n\x1b[2J\n"), HasSubstr("\\x1b[2J"));
}

TEST(CsvFile, NeedsColumnNames) {
  EXPECT_THAT(csv_error(""), HasSubstr("it needs a line with column names"));
  EXPECT_THAT(csv_error("drop\n"), HasSubstr("and lines with values"));
  EXPECT_THAT(csv_error("0.4,0.5\n0.6,0.7\n"), HasSubstr("it must name the columns"));
  EXPECT_THAT(csv_error("drop;mu\n1;2\n"), HasSubstr("semicolons: use commas"));
  EXPECT_THAT(csv_error("drop\tmu\n1\t2\n"), HasSubstr("tabs: use commas"));
  EXPECT_THAT(csv_error("drop,\n1,2\n"), HasSubstr("column 2 has no name"));
  EXPECT_THAT(csv_error("drop,drop\n1,2\n"), HasSubstr("two columns are called `drop`"));
  EXPECT_THAT(csv_error("dorp,b\n1,2\n"), HasSubstr("no column `drop` (did you mean `dorp`?)"));
  EXPECT_THAT(csv_error("drop\n\xff\n"), HasSubstr("UTF-8"));
}

TEST(CsvFile, MayHaveManyColumnsAndFieldsWithManyQuotes) {
  std::string names;
  std::string values;
  for (int i = 0; i < 300'000; ++i) {
    names += "c" + std::to_string(i) + ",";
    values += "1,";
  }
  EXPECT_THAT(column(names + "drop\n" + values + "0.25\n", "drop"), testing::ElementsAre(0.25));
  std::string quotes;
  for (int i = 0; i < 1'000'000; ++i) {
    quotes += "a\"";
  }
  EXPECT_THAT(column("text,drop\n" + quotes + ",0.5\n", "drop"), testing::ElementsAre(0.5));
}

TEST(CsvFiles, AreFoundBesideTheStudyAndMustBeFiles) {
  const test::TemporaryFolder folder;
  { std::ofstream(folder.file("beside.csv")) << "drop\n0.4\n"; }
  CsvFiles files(folder.path());
  EXPECT_EQ(files.at("beside.csv").columns().size(), 1U);
  EXPECT_EQ(files.at(folder.file("beside.csv")).columns().size(), 1U) << "an absolute path";
  for (const std::string path : {"nowhere.csv", ".", "/dev/zero"}) {
    EXPECT_THROW(files.at(path), solver::InputError) << path;
  }
}

}  // namespace
}  // namespace oblique::client
