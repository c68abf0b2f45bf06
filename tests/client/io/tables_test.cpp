#include "client/io/tables.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

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

std::string printed(const protocol::Table& rows, Format format) {
  std::ostringstream out;
  print(out, rows, format);
  return out.str();
}

TEST(Csv, HoldsEveryNumberToTheLastBit) {
  protocol::Table rows{.columns = {"x"}};
  for (const double value : kAwkward) {
    rows.rows.push_back({value});
  }
  std::istringstream lines(printed(rows, Format::kCsv));
  std::string line;
  std::getline(lines, line);
  for (const double value : kAwkward) {
    std::getline(lines, line);
    const double back = std::strtod(line.c_str(), nullptr);
    EXPECT_EQ(back, value);
    EXPECT_EQ(std::signbit(back), std::signbit(value));
  }
}

TEST(Csv, QuotesWhatWouldBreakALineAndHoldsOtherTextsByteForByte) {
  EXPECT_EQ(printed(rows_of_texts(
                        {"plain", "a,b", "say \"no\"", "two\nlines", "one\rtwo", "\x1b[2J\u202e"}),
                    Format::kCsv),
            "text\nplain\n\"a,b\"\n\"say \"\"no\"\"\"\n\"two\nlines\"\n\"one\rtwo\"\n"
            "\x1b[2J\u202e\n");
}

TEST(Csv, TellsNullFromAnEmptyText) {
  auto rows = rows_of_texts({""});
  rows.rows.emplace_back().emplace_back();
  EXPECT_EQ(printed(rows, Format::kCsv), "text\n\"\"\n\n");
}

TEST(Json, HoldsEveryNumberToTheLastBitAndKeepsTheOrderOfColumns) {
  protocol::Table rows{.columns = {"z", "a"}};
  for (const double value : kAwkward) {
    rows.rows.push_back({value, std::int64_t{7}});
  }
  const auto text = printed(rows, Format::kJson);
  EXPECT_LT(text.find("\"z\""), text.find("\"a\""));
  const auto back = nlohmann::json::parse(text);
  ASSERT_EQ(back.size(), kAwkward.size());
  for (std::size_t i = 0; i < kAwkward.size(); ++i) {
    EXPECT_EQ(back[i]["z"].get<double>(), kAwkward[i]);
    EXPECT_TRUE(back[i]["a"].is_number_integer());
  }
}

TEST(Json, IsValidForTextsOfAllSortsForNullAndForNoRows) {
  const std::vector<std::string> texts{"say \"no\"", "two\nlines", "\x1b[2J\u009b1m\u202ex\x7f",
                                       "\u2066µ🙂"};
  auto rows = rows_of_texts(texts);
  rows.rows.push_back({std::string("broken \xff utf-8")});
  rows.rows.push_back({protocol::Value()});
  rows.rows.push_back({std::nan("")});
  const auto text = printed(rows, Format::kJson);
  EXPECT_EQ(text.find_first_of("\x1b\x7f"), std::string::npos) << text;
  const auto back = nlohmann::json::parse(text);
  for (std::size_t i = 0; i < texts.size(); ++i) {
    EXPECT_EQ(back[i]["text"], texts[i]);
  }
  EXPECT_TRUE(back[5]["text"].is_null());
  EXPECT_TRUE(back[6]["text"].is_null());
  EXPECT_EQ(nlohmann::json::parse(printed(rows_of_texts({}), Format::kJson)),
            nlohmann::json::array());
}

TEST(Json, GivesEachColumnAKeyOfItsOwn) {
  const std::int64_t one = 1;
  const protocol::Table rows{.columns = {"a", "b", "a", "a", "a_2"},
                             .rows = {{one, one + 1, one + 2, one + 3, one + 4}}};
  EXPECT_EQ(printed(rows, Format::kJson),
            "[\n{\"a\":1,\"b\":2,\"a_3\":3,\"a_4\":4,\"a_2\":5}\n]\n");
}

TEST(Table, ShowsNullAsADashAndKeepsToOneLineARow) {
  auto rows = rows_of_texts({"two\nlines"});
  rows.rows.emplace_back().emplace_back();
  EXPECT_EQ(printed(rows, Format::kTable), "text\n---------\ntwo lines\n-\n");
  EXPECT_EQ(printed(rows_of_texts({"µ", "ab"}), Format::kTable), "text\n----\nµ\nab\n");
}

TEST(Table, ShowsNumbersForReading) {
  const protocol::Table rows{.columns = {"x"}, .rows = {{-0.0}, {0.1 + 0.2}, {14300.0}, {7e10}}};
  EXPECT_EQ(printed(rows, Format::kTable), "      x\n-------\n    0\n    0.3\n14300\n7e+10\n");
}

}  // namespace
}  // namespace oblique::client
