// Rows printed as tables, CSV and JSON.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/io/row_output.h"
#include "proto/wire/chunk.h"

namespace oblique::client {
namespace {

protocol::QueryReply chunk_of(const std::vector<std::string>& columns,
                              const std::vector<protocol::Row>& rows) {
  return protocol::chunk_of({.columns = columns, .rows = rows});
}

std::string printed(Format format, const std::vector<protocol::QueryReply>& chunks,
                    OutputSettings settings = {}) {
  settings.format = format;
  return text_of(chunks, settings);
}

protocol::QueryReply points(std::int64_t from, std::int64_t to) {
  std::vector<protocol::Row> rows;
  for (std::int64_t i = from; i < to; ++i) {
    rows.push_back({i, 0.5 * static_cast<double>(i)});
  }
  return chunk_of({"point", "H"}, rows);
}

TEST(Formats, AreTheSameHoweverRowsAreSplitIntoChunks) {
  const auto whole = points(0, 100);
  const std::vector parts{points(0, 1), points(1, 1), points(1, 60), points(60, 100)};
  for (const Format format : {Format::kTable, Format::kCsv, Format::kJson, Format::kJsonLines}) {
    EXPECT_EQ(printed(format, {whole}), printed(format, parts)) << static_cast<int>(format);
  }
}

TEST(Formats, AreValidWithoutRows) {
  const std::vector none{chunk_of({"a", "b"}, {})};
  EXPECT_EQ(printed(Format::kTable, none), "a  b\n-  -\n");
  EXPECT_EQ(printed(Format::kCsv, none), "a,b\n");
  EXPECT_EQ(printed(Format::kJson, none), "[]\n");
  EXPECT_EQ(printed(Format::kJsonLines, none), "");
}

TEST(Csv, HasNoEmptyLineForANull) {
  const auto null = chunk_of({"x"}, {{protocol::Value()}});
  EXPECT_EQ(printed(Format::kCsv, {null, null, chunk_of({"x"}, {{2.0}, {"\"\""}})}),
            "x\n\"\"\n\"\"\n2\n\"\"\"\"\"\"\n");
  EXPECT_EQ(printed(Format::kCsv, {chunk_of({"x", "y"}, {{protocol::Value(), protocol::Value()}})}),
            "x,y\n,\n");
}

TEST(JsonLines, HaveOneObjectPerLine) {
  EXPECT_EQ(
      printed(Format::kJsonLines, {chunk_of({"n", "x", "s"}, {{std::int64_t{1}, 2.0, "a\nb"}}),
                                   chunk_of({"n", "x", "s"}, {{protocol::Value(), 1e-300, "\""}})}),
      "{\"n\":1,\"x\":2.0,\"s\":\"a\\nb\"}\n"
      "{\"n\":null,\"x\":1e-300,\"s\":\"\\\"\"}\n");
}

/// Returns the JSON value that is printed for the cell `text` of a column.
std::string json_value(const std::string& column, const std::string& text) {
  const std::string line = printed(Format::kJsonLines, {chunk_of({column}, {{text}})});
  const std::size_t begin = column.size() + 4;
  return line.substr(begin, line.size() - begin - 2);
}

TEST(Json, HasListsAsInSolveJson) {
  for (const auto& [column, text, json] : std::vector<std::array<std::string, 3>>{
           {"phases", R"([["compression",0.0,1e-05]])",
            R"([{"kind":"compression","t0_s":0.0,"t1_s":1e-05}])"},
           {"peaks", "[[1e-05,4000.5,2000.0,1]]",
            R"([{"t_s":1e-05,"fn_N":4000.5,"ft_N":2000.0,"major":1}])"},
           {"reaction_peaks", "[[1e-05,7.5]]", R"([{"t_s":1e-05,"force_N":7.5}])"},
           {"stick_intervals", "[[0.0,1e-05]]", "[[0.0,1e-05]]"},
           {"fn_peaks_N", "[5057.6299999999992,0.1,5e-324]", "[5057.629999999999,0.1,5e-324]"},
           {"fn_peaks_N", "[]", "[]"},
           {"name", "[1,2]", "\"[1,2]\""}}) {
    EXPECT_EQ(json_value(column, text), json);
  }
}

TEST(Json, WritesATextThatIsNoListAsAString) {
  const std::string deep(1000000, '[');
  for (const std::string& text :
       {std::string(), std::string("[1,2"), std::string("17"), std::string("{}"),
        std::string("[[1e-05,4000.5]]"), std::string("[1,2,3,4]"), std::string("[[[1]]]"),
        std::string("[{}]"), deep, deep + std::string(1000000, ']')}) {
    EXPECT_EQ(json_value("peaks", text), "\"" + text + "\"") << text.substr(0, 20);
  }
}

TEST(Json, LeavesCharactersThatTerminalsShowAsTheyAre) {
  EXPECT_EQ(json_value("name", "µ \"\\"), R"("µ \"\\")");
  EXPECT_EQ(json_value("name", "\xff"), R"("\ufffd")");
}

TEST(Table, AlignsNumbersAtThePoint) {
  EXPECT_EQ(
      printed(
          Format::kTable,
          {chunk_of({"fn_N", "kind"},
                    {{5057.63, "SC"}, {812.345, "sC"}, {-2.0, "SR"}, {protocol::Value(), "-"}})}),
      "    fn_N  kind\n"
      "--------  ----\n"
      "5057.63   SC\n"
      " 812.345  sC\n"
      "  -2      SR\n"
      "       -  -\n");
}

TEST(Table, ExplainsTheLettersOfModes) {
  for (const char* column : {"mode", "major_mode"}) {
    EXPECT_TRUE(printed(Format::kTable, {chunk_of({column}, {{"SC"}})})
                    .ends_with("\n(S stick, s slip; C compression, R restitution)\n"));
  }
}

TEST(Table, KeepsTheWidthsOfItsFirstRows) {
  OutputSettings settings;
  settings.first_rows = 2;
  const auto rows = chunk_of({"s", "n"}, {{"ab", std::int64_t{1}},
                                          {"abc", std::int64_t{2}},
                                          {"abcdefgh", std::int64_t{3}},
                                          {"a", std::int64_t{4}}});
  EXPECT_EQ(printed(Format::kTable, {rows}, settings),
            "s    n\n"
            "---  -\n"
            "ab   1\n"
            "abc  2\n"
            "abcdefgh  3\n"
            "a    4\n");
}

TEST(Table, FitsATerminalAndReportsWhatItLeavesOut) {
  OutputSettings settings;
  settings.width = 40;
  const std::string long_text = "µµµµµµµµµµµµµµµµµµµµµµµµµµµµµµ";
  const auto rows = chunk_of({"point", "error", "a_long_heading", "last"},
                             {{std::int64_t{1}, long_text, 0.5, std::int64_t{7}}});
  EXPECT_EQ(printed(Format::kTable, {rows}, settings),
            "point  error         a_long_heading  …\n"
            "-----  ------------  --------------\n"
            "    1  µµµµµµµµµµµ…             0.5\n"
            "Left out to fit 40 columns (csv and json\nhave all): last\n");
  settings.width = 3;
  EXPECT_THAT(printed(Format::kTable, {rows}, settings), testing::HasSubstr("    1\n"))
      << "one column is shown even in a very narrow terminal";
  settings.width = 0;
  EXPECT_THAT(printed(Format::kTable, {rows}, settings), testing::HasSubstr(long_text));
}

TEST(Table, WithAllColumnsWrapsSentencesInTheLastColumn) {
  OutputSettings settings;
  settings.width = 40;
  settings.may_leave_out = false;
  const auto rows = chunk_of({"column", "n", "meaning"},
                             {{"a", std::int64_t{1}, "what stands here is longer than the line"},
                              {std::string(20, 'x'), std::int64_t{2}, "short"}});
  EXPECT_EQ(printed(Format::kTable, {rows}, settings),
            "column               n  meaning\n"
            "-------------------  -  ----------------\n"
            "a                    1  what stands here\n"
            "                        is longer than\n"
            "                        the line\n"
            "xxxxxxxxxxxxxxxxxx…  2  short\n");
}

const std::vector<double> kAwkward{0.1,
                                   1.0 / 3.0,
                                   -0.0,
                                   5e-324,
                                   std::numeric_limits<double>::max(),
                                   std::numeric_limits<double>::epsilon(),
                                   5057.6299999999992,
                                   1e22};

protocol::Table rows_of_texts(const std::vector<std::string>& texts) {
  protocol::Table rows{.columns = {"text"}};
  for (const auto& text : texts) {
    rows.rows.push_back({text});
  }
  return rows;
}

std::string whole(const protocol::Table& rows, Format format) {
  return text_of({protocol::chunk_of(rows)}, {.format = format});
}

TEST(Csv, WritesEveryNumberToTheLastBit) {
  protocol::Table rows{.columns = {"x"}};
  for (const double value : kAwkward) {
    rows.rows.push_back({value});
  }
  std::istringstream lines(whole(rows, Format::kCsv));
  std::string line;
  std::getline(lines, line);
  for (const double value : kAwkward) {
    std::getline(lines, line);
    const double back = std::strtod(line.c_str(), nullptr);
    EXPECT_EQ(back, value);
    EXPECT_EQ(std::signbit(back), std::signbit(value));
  }
}

TEST(Csv, QuotesTextThatWouldBreakALineAndWritesOtherTextUnchanged) {
  EXPECT_EQ(whole(rows_of_texts(
                      {"plain", "a,b", "say \"no\"", "two\nlines", "one\rtwo", "\x1b[2J\u202e"}),
                  Format::kCsv),
            "text\nplain\n\"a,b\"\n\"say \"\"no\"\"\"\n\"two\nlines\"\n\"one\rtwo\"\n"
            "\x1b[2J\u202e\n");
}

TEST(Csv, DistinguishesNullFromEmptyTextInSeveralColumns) {
  const protocol::Table rows{.columns = {"text", "number"},
                             .rows = {{std::string(), std::int64_t{1}}, {{}, std::int64_t{1}}}};
  EXPECT_EQ(whole(rows, Format::kCsv), "text,number\n\"\",1\n,1\n");
}

TEST(Json, WritesEveryNumberToTheLastBitAndKeepsTheOrderOfColumns) {
  protocol::Table rows{.columns = {"z", "a"}};
  for (const double value : kAwkward) {
    rows.rows.push_back({value, std::int64_t{7}});
  }
  const auto text = whole(rows, Format::kJson);
  EXPECT_LT(text.find("\"z\""), text.find("\"a\""));
  const auto back = nlohmann::json::parse(text);
  ASSERT_EQ(back.size(), kAwkward.size());
  for (std::size_t i = 0; i < kAwkward.size(); ++i) {
    EXPECT_EQ(back[i]["z"].get<double>(), kAwkward[i]);
    EXPECT_TRUE(back[i]["a"].is_number_integer());
  }
}

TEST(Json, IsValidForAnyTextForNullAndWithoutRows) {
  const std::vector<std::string> texts{"say \"no\"", "two\nlines", "\x1b[2J\u009b1m\u202ex\x7f",
                                       "\u2066µ🙂"};
  auto rows = rows_of_texts(texts);
  rows.rows.push_back({std::string("broken \xff utf-8")});
  rows.rows.push_back({protocol::Value()});
  rows.rows.push_back({std::nan("")});
  const auto text = whole(rows, Format::kJson);
  EXPECT_EQ(text.find_first_of("\x1b\x7f"), std::string::npos) << text;
  const auto back = nlohmann::json::parse(text);
  for (std::size_t i = 0; i < texts.size(); ++i) {
    EXPECT_EQ(back[i]["text"], texts[i]);
  }
  EXPECT_TRUE(back[5]["text"].is_null());
  EXPECT_TRUE(back[6]["text"].is_null());
  EXPECT_EQ(nlohmann::json::parse(whole(rows_of_texts({}), Format::kJson)),
            nlohmann::json::array());
}

TEST(Json, GivesColumnsOfTheSameNameDifferentKeys) {
  const std::int64_t one = 1;
  const protocol::Table rows{.columns = {"a", "b", "a", "a", "a_2"},
                             .rows = {{one, one + 1, one + 2, one + 3, one + 4}}};
  EXPECT_EQ(whole(rows, Format::kJson), "[\n{\"a\":1,\"b\":2,\"a_3\":3,\"a_4\":4,\"a_2\":5}\n]\n");
}

TEST(Table, ShowsNullAsADashAndUsesOneLinePerRow) {
  auto rows = rows_of_texts({"two\nlines"});
  rows.rows.emplace_back().emplace_back();
  EXPECT_EQ(whole(rows, Format::kTable), "text\n---------\ntwo lines\n-\n");
  EXPECT_EQ(whole(rows_of_texts({"µ", "ab"}), Format::kTable), "text\n----\nµ\nab\n");
}

TEST(Table, RoundsNumbersToReadableDigits) {
  const protocol::Table rows{.columns = {"x"}, .rows = {{-0.0}, {0.1 + 0.2}, {14300.0}, {7e10}}};
  EXPECT_EQ(whole(rows, Format::kTable), "      x\n-------\n    0\n    0.3\n14300\n7e+10\n");
}

}  // namespace
}  // namespace oblique::client
