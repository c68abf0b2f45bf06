// Rows of answers gathered in cells and lines.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/gathered.h"
#include "proto/wire/chunk.h"

namespace oblique::client::plot {
namespace {

using testing::ElementsAre;

AnswerColumn numbers(std::vector<double> values) {
  return {.name = "v", .unit = {}, .numbers = std::move(values)};
}

/// Of one text a row; empty: none.
AnswerColumn texts(const std::vector<std::string>& values) {
  AnswerColumn column{.name = "t", .unit = {}};
  for (const auto& value : values) {
    column.numbers.push_back(std::nan(""));
    const auto found = std::find(column.words.begin(), column.words.end(), value);
    column.word_of_row.push_back(value.empty()
                                     ? AnswerColumn::kNoWord
                                     : static_cast<std::uint32_t>(found - column.words.begin()));
    if (!value.empty() && found == column.words.end()) {
      column.words.push_back(value);
    }
  }
  return column;
}

/// Chunks that were made before.
class Chunks : public RowStream {
 public:
  explicit Chunks(std::vector<protocol::QueryReply> chunks) : chunks_(std::move(chunks)) {
    chunks_.back().set_ends(true);
  }
  protocol::QueryReply next() override { return chunks_.at(next_++); }

 private:
  std::vector<protocol::QueryReply> chunks_;
  std::size_t next_ = 0;
};

TEST(AnswerColumns, AreTheSameWhateverTheChunks) {
  protocol::ChunkWriter writer({"mu", "mode"});
  const auto write = [&writer](std::optional<double> mu, const std::string& mode) {
    if (mu) {
      writer.real(*mu);
    } else {
      writer.null();
    }
    if (mode.empty()) {
      writer.null();
    } else {
      writer.text(mode);
    }
    writer.end_row();
  };
  std::vector<protocol::QueryReply> chunks;
  write(0.1, "");
  chunks.push_back(writer.take());
  write(0.2, "SC");
  write({}, "sC");
  chunks.push_back(writer.take());
  write(0.4, "");
  write(0.5, "SC");
  chunks.push_back(writer.take());
  Chunks stream(chunks);
  const auto columns = read_columns(stream);
  ASSERT_EQ(columns.size(), 2U);
  EXPECT_THAT(columns[0].numbers, ElementsAre(0.1, 0.2, testing::IsNan(), 0.4, 0.5));
  EXPECT_FALSE(columns[0].has_texts());
  EXPECT_TRUE(columns[0].is_null(2));
  EXPECT_TRUE(columns[1].is_null(0));
  EXPECT_THAT(columns[1].words, ElementsAre("SC", "sC"));
  EXPECT_EQ(columns[1].text(1), "SC");
  EXPECT_EQ(columns[1].text(3), "");
  EXPECT_EQ(columns[1].text(4), "SC");
}

TEST(Cells, OfAGridAreWhereTheirValuesAreAndUnsolvedOnesSaySo) {
  const auto x = numbers({1, 2, 1, 2});
  const auto y = numbers({10, 10, 20, 20});
  const auto value = numbers({5, std::nan(""), 7, std::nan("")});
  const auto status = texts({"solved", "failed", "solved", "solved"});
  const auto gathered = gathered_on({x, y, value, status}, {1, 2, 3}, {10, 20}, false, false);
  EXPECT_THAT(gathered.cells.states,
              ElementsAre(CellState::kSolved, CellState::kFailed, CellState::kNoResult,
                          CellState::kSolved, CellState::kNoValue, CellState::kNoResult));
  EXPECT_EQ(gathered.cells.values[0], 5.0);
  EXPECT_EQ(gathered.cells.values[3], 7.0);
  EXPECT_EQ(gathered.points, 4U);
  EXPECT_EQ(gathered.most_in_a_cell, 1U);
}

TEST(Cells, WithSeveralPointsHaveTheirMean) {
  const auto x = numbers({1, 1, 1});
  const auto y = numbers({1, 1, 1});
  const auto value = numbers({1, 3, std::nan("")});
  const auto status = texts({"solved", "solved", "failed"});
  const auto gathered = gathered_on({x, y, value, status}, {1}, {1}, false, false);
  EXPECT_EQ(gathered.cells.values[0], 2.0);
  EXPECT_EQ(gathered.most_in_a_cell, 2U);
  EXPECT_EQ(gathered.cells.states[0], CellState::kSolved);
}

TEST(Cells, OfTextsHaveNames) {
  const auto x = numbers({1, 2});
  const auto y = numbers({1, 1});
  const auto value = texts({"SC sR", ""});
  const auto status = texts({"solved", "solved"});
  const auto gathered = gathered_on({x, y, value, status}, {1, 2}, {1}, false, false);
  EXPECT_EQ(gathered.cells.names[0], "SC sR");
  EXPECT_EQ(gathered.mixed_cells, 0U);
  EXPECT_EQ(gathered.cells.states[1], CellState::kNoValue);
}

TEST(Cells, WithSeveralTextsHaveThatOfMostOfTheirPointsAndAreCounted) {
  const auto x = numbers({1, 1, 1, 1, 2, 2, 3});
  const auto y = numbers({1, 1, 1, 1, 1, 1, 1});
  const auto value = texts({"rare", "SC", "", "SC", "SC", "rare", "SC"});
  const auto status = texts(std::vector<std::string>(7, "solved"));
  const auto gathered = gathered_on({x, y, value, status}, {1, 2, 3}, {1}, false, false);
  EXPECT_THAT(gathered.cells.names, ElementsAre("SC", "rare", "SC"))
      << "of equally many the first met";
  EXPECT_EQ(gathered.mixed_cells, 2U);
  EXPECT_EQ(gathered.most_in_a_cell, 3U);
}

TEST(Cells, OfTextsCountThePointsOfEachTextAlsoWhereOthersHaveTheCell) {
  const auto x = numbers({1, 1, 1, 2});
  const auto y = numbers({1, 1, 1, 1});
  const auto value = texts({"SC", "SC", "rare", "SC"});
  const auto status = texts(std::vector<std::string>(4, "solved"));
  const auto gathered = gathered_on({x, y, value, status}, {1, 2}, {1}, false, false);
  EXPECT_THAT(gathered.cells.names, ElementsAre("SC", "SC"));
  EXPECT_EQ(gathered.points_of_name,
            (std::map<std::string, std::uint64_t>{{"SC", 3}, {"rare", 1}}));
}

TEST(Bins, HoldAllScatteredPointsThoseAtTheEndsIncluded) {
  std::vector<double> xs;
  std::vector<double> ys;
  for (int i = 0; i < 1000; ++i) {
    xs.push_back(std::fmod(i * 0.618, 1.0));
    ys.push_back(std::fmod(i * 0.414, 3.0));
  }
  const auto x = numbers(xs);
  const auto y = numbers(ys);
  const AnswerColumn no_status;
  const auto gathered =
      gathered_in_bins({x, y, x, no_status}, Scale(range_of(xs)), 8, Scale(range_of(ys)), 5);
  EXPECT_EQ(gathered.points, 1000U);
  EXPECT_EQ(std::accumulate(gathered.counts.begin(), gathered.counts.end(), 0U), 1000U);
  EXPECT_EQ(gathered.cells.states.size(), 40U);
}

TEST(Bins, WithoutARowHaveNoPoint) {
  const auto x = numbers({1.0, 2.0});
  const AnswerColumn no_status;
  const auto gathered =
      gathered_in_bins({x, x, x, no_status}, Scale({1.0, 2.0}), 2, Scale({1.0, 2.0}), 2);
  EXPECT_THAT(gathered.cells.states, ElementsAre(CellState::kSolved, CellState::kNoPoint,
                                                 CellState::kNoPoint, CellState::kSolved));
}

TEST(AxisValues, AreThoseOfTheStudyAndOthersThatRowsHave) {
  EXPECT_THAT(axis_values({3, 1}, numbers({2, 2, 3, std::nan(""), 1})), ElementsAre(1, 2, 3));
}

TEST(GatheredLines, RiseAndHaveGapsWherePointsFailedOrAreNotSolvedYet) {
  const auto x = numbers({4, 1, 2, 1, 4});
  const auto y = numbers({40, 10, std::nan(""), 1, 4});
  const auto by = numbers({0.5, 0.5, 0.5, 1, 1});
  const auto gathered = gathered_lines(x, y, &by, {1, 2, 3, 4, 5});
  ASSERT_EQ(gathered.curves.size(), 2U);
  EXPECT_EQ(gathered.curves[0].by, 0.5);
  EXPECT_THAT(gathered.curves[0].x, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(gathered.curves[0].y, ElementsAre(10, testing::IsNan(), testing::IsNan(), 40));
  EXPECT_EQ(gathered.gaps, 4U);
  EXPECT_EQ(gathered.most_at_a_place, 1U);
}

TEST(GatheredLines, OfSeveralPointsAtAPlaceHaveTheirMean) {
  const auto gathered = gathered_lines(numbers({1, 1, 2}), numbers({2, 4, 7}), nullptr, {});
  ASSERT_EQ(gathered.curves.size(), 1U);
  EXPECT_THAT(gathered.curves[0].y, ElementsAre(3, 7));
  EXPECT_EQ(gathered.most_at_a_place, 2U);
}

}  // namespace
}  // namespace oblique::client::plot
