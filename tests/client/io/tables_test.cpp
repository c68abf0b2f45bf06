#include "client/io/tables.h"

#include <charconv>
#include <cmath>
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

// Reads CSV back by RFC 4180: fields of one column.
std::vector<std::string> csv_fields(const std::string& text) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (quoted && text[i] == '"' && i + 1 < text.size() && text[i + 1] == '"') {
      fields.back() += text[i++];
    } else if (text[i] == '"') {
      quoted = !quoted;
    } else if (text[i] == '\n' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += text[i];
    }
  }
  fields.pop_back();
  return fields;
}

TEST(Csv, HoldsEveryNumberToTheLastBit) {
  protocol::Table rows{.columns = {"x"}};
  for (const double value : kAwkward) {
    rows.rows.push_back({value});
  }
  const auto fields = csv_fields(printed(rows, Format::kCsv));
  ASSERT_EQ(fields.size(), kAwkward.size() + 1);
  for (std::size_t i = 0; i < kAwkward.size(); ++i) {
    double back = 0.0;
    const auto& text = fields[i + 1];
    std::from_chars(text.data(), text.data() + text.size(), back);
    EXPECT_EQ(back, kAwkward[i]);
    EXPECT_EQ(std::signbit(back), std::signbit(kAwkward[i]));
  }
}

TEST(Csv, QuotesWhatWouldBreakALine) {
  const std::vector<std::string> texts{"plain", "a,b", "say \"no\"", "two\nlines", "one\rtwo", ""};
  auto fields = csv_fields(printed(rows_of_texts(texts), Format::kCsv));
  fields.erase(fields.begin());
  EXPECT_EQ(fields, texts);
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
  auto rows = rows_of_texts({"say \"no\"", "two\nlines", "broken \xff utf-8"});
  rows.rows.emplace_back().emplace_back();
  rows.rows.push_back({std::nan("")});
  const auto back = nlohmann::json::parse(printed(rows, Format::kJson));
  EXPECT_EQ(back[0]["text"], "say \"no\"");
  EXPECT_EQ(back[1]["text"], "two\nlines");
  EXPECT_TRUE(back[3]["text"].is_null());
  EXPECT_TRUE(back[4]["text"].is_null());
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
}

TEST(Table, ShowsNumbersForReading) {
  const protocol::Table rows{.columns = {"x"}, .rows = {{-0.0}, {0.1 + 0.2}, {14300.0}, {7e10}}};
  EXPECT_EQ(printed(rows, Format::kTable), "      x\n-------\n    0\n    0.3\n14300\n7e+10\n");
}

TEST(Table, CountsCharactersNotBytes) {
  EXPECT_EQ(printed(rows_of_texts({"µ", "ab"}), Format::kTable), "text\n----\nµ\nab\n");
}

constexpr const char* kSteering = "\x1b[2J\u009b1m\u202ex\x7f";

TEST(Table, ShowsControlCharactersOfTextsAndColumnsWrittenOut) {
  auto rows = rows_of_texts({kSteering});
  rows.columns[0] = "a\x1b";
  const auto text = printed(rows, Format::kTable);
  EXPECT_NE(text.find("a\\x1b"), std::string::npos) << text;
  EXPECT_NE(text.find("\\x1b[2J\\u009b1m\\u202ex\\x7f"), std::string::npos) << text;
  EXPECT_EQ(text.find_first_of("\x1b\x7f\xc2\xe2"), std::string::npos) << text;
}

TEST(Json, EscapesControlCharactersAndReadsBackTheSame) {
  auto rows = rows_of_texts({kSteering, "\u2066µ🙂"});
  rows.columns[0] = "a\u009b";
  const auto text = printed(rows, Format::kJson);
  EXPECT_EQ(text.find_first_of("\x1b\x7f"), std::string::npos) << text;
  EXPECT_EQ(text.find("\u009b"), std::string::npos) << text;
  EXPECT_EQ(text.find("\u202e"), std::string::npos) << text;
  EXPECT_NE(text.find("µ🙂"), std::string::npos) << text;
  const auto back = nlohmann::json::parse(text);
  EXPECT_EQ(back[0]["a\u009b"], kSteering);
  EXPECT_EQ(back[1]["a\u009b"], "\u2066µ🙂");
}

TEST(Csv, HoldsTextsByteForByteWhereNoTerminalShowsIt) {
  EXPECT_EQ(printed(rows_of_texts({"\x1b[2J\u202e"}), Format::kCsv), "text\n\x1b[2J\u202e\n");
}

TEST(Formats, OfOtherNamesAreRefused) {
  EXPECT_EQ(format_named("csv"), Format::kCsv);
  EXPECT_THROW(format_named("xml"), solver::InputError);
}

}  // namespace
}  // namespace oblique::client
