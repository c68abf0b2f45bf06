// Tables, CSV and JSON as rows come.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/rows_of_tests.h"

namespace oblique::client {
namespace {

using test::chunk_of;
using test::printed;

protocol::QueryReply points(std::int64_t from, std::int64_t to) {
  test::TestRows rows;
  for (std::int64_t i = from; i < to; ++i) {
    rows.push_back({i, 0.5 * static_cast<double>(i)});
  }
  return chunk_of({"point", "H"}, rows);
}

TEST(Formats, PrintTheSameWhateverTheChunks) {
  const auto whole = points(0, 100);
  const std::vector parts{points(0, 1), points(1, 1), points(1, 60), points(60, 100)};
  for (const Format format : {Format::kTable, Format::kCsv, Format::kJson, Format::kJsonLines}) {
    EXPECT_EQ(printed(format, {whole}), printed(format, parts)) << static_cast<int>(format);
  }
}

TEST(Formats, OfNoRowsHaveWhatTheyMustHave) {
  const std::vector none{chunk_of({"a", "b"}, {})};
  EXPECT_EQ(printed(Format::kTable, none), "a  b\n-  -\n");
  EXPECT_EQ(printed(Format::kCsv, none), "a,b\n");
  EXPECT_EQ(printed(Format::kJson, none), "[]\n");
  EXPECT_EQ(printed(Format::kJsonLines, none), "");
}

TEST(JsonLines, HaveAnObjectALine) {
  EXPECT_EQ(
      printed(Format::kJsonLines, {chunk_of({"n", "x", "s"}, {{std::int64_t{1}, 2.0, "a\nb"}}),
                                   chunk_of({"n", "x", "s"}, {{nullptr, 1e-300, "\""}})}),
      "{\"n\":1,\"x\":2.0,\"s\":\"a\\nb\"}\n"
      "{\"n\":null,\"x\":1e-300,\"s\":\"\\\"\"}\n");
}

TEST(Table, AlignsNumbersAtThePoint) {
  EXPECT_EQ(printed(Format::kTable,
                    {chunk_of({"fn_N", "kind"},
                              {{5057.63, "SC"}, {812.345, "sC"}, {-2.0, "SR"}, {nullptr, "-"}})}),
            "    fn_N  kind\n"
            "--------  ----\n"
            "5057.63   SC\n"
            " 812.345  sC\n"
            "  -2      SR\n"
            "       -  -\n");
}

TEST(Table, WithModesSaysWhatTheirLettersMean) {
  for (const char* column : {"mode", "major_mode"}) {
    EXPECT_TRUE(printed(Format::kTable, {chunk_of({column}, {{"SC"}})})
                    .ends_with("\n(S stick, s slip; C compression, R restitution)\n"));
  }
}

TEST(Table, KeepsTheWidthsOfItsFirstRows) {
  PrinterSettings settings;
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

TEST(Table, FitsATerminalAndSaysWhatItLeavesOut) {
  PrinterSettings settings;
  settings.width = 40;
  const std::string long_text(60, 'x');
  const auto rows = chunk_of({"point", "error", "a_long_heading", "last"},
                             {{std::int64_t{1}, long_text, 0.5, std::int64_t{7}}});
  EXPECT_EQ(printed(Format::kTable, {rows}, settings),
            "point  error         a_long_heading  …\n"
            "-----  ------------  --------------\n"
            "    1  xxxxxxxxxxx…             0.5\n"
            "Left out, for a width of 40 (csv and json have all):\nlast\n");
  settings.width = 3;
  EXPECT_THAT(printed(Format::kTable, {rows}, settings), testing::HasSubstr("    1\n"))
      << "a column stays, however narrow the terminal";
  settings.width = 0;
  EXPECT_THAT(printed(Format::kTable, {rows}, settings), testing::HasSubstr(long_text));
}

TEST(Table, ThatKeepsAllColumnsWrapsSentencesInTheLast) {
  PrinterSettings settings;
  settings.width = 40;
  settings.keeps_all = true;
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

TEST(Table, ShortensTextsBetweenCharacters) {
  PrinterSettings settings;
  settings.width = 12;
  EXPECT_EQ(printed(Format::kTable, {chunk_of({"s"}, {{"µµµµµµµµµµµµµ"}})}, settings),
            "s\n------------\nµµµµµµµµµµµ…\n");
}

TEST(Table, ShowsColumnsInTheirUnits) {
  PrinterSettings settings;
  settings.shown = {{"duration_s [us]", 1e6}, {"status"}};
  const auto rows = chunk_of({"duration_s", "status"}, {{0.000125, "solved"}});
  EXPECT_EQ(printed(Format::kTable, {rows}, settings),
            "duration_s [us]  status\n"
            "---------------  ------\n"
            "            125  solved\n");
}

}  // namespace
}  // namespace oblique::client
