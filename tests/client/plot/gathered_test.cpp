// Rows of query results, grouped into the cells of maps and the points of lines.
#include "client/plot/figure.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/chunk.h"

namespace oblique::client::plot {
namespace {

using testing::ElementsAre;
using testing::Pair;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

AnswerColumn numbers(std::vector<double> values) {
  return {.name = "v", .unit = {}, .numbers = std::move(values)};
}

/// A column with one text per row; an empty text means no value.
AnswerColumn texts(const std::vector<std::string>& values) {
  AnswerColumn column{.name = "t", .unit = {}};
  for (const auto& value : values) {
    column.add(value.empty() ? protocol::Cell{}
                             : protocol::Cell{.kind = protocol::CellKind::kText, .text = value});
  }
  return column;
}

/// A stream that returns prepared chunks of rows.
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

TEST(GatheredData, DoesNotDependOnHowAnswersAreSplitIntoChunks) {
  std::vector<protocol::QueryReply> chunks;
  protocol::Table table{.columns = {"mu", "mode"}};
  table.rows = {{0.1, {}}};
  chunks.push_back(protocol::chunk_of(table));
  table.rows = {{0.2, "SC"}, {{}, "sC"}};
  chunks.push_back(protocol::chunk_of(table));
  table.rows = {{0.4, {}}, {0.5, "SC"}};
  chunks.push_back(protocol::chunk_of(table));
  for (auto& chunk : chunks) {
    chunk.set_ends(false);
  }
  Chunks stream(chunks);
  const auto columns = read_columns(stream);
  ASSERT_EQ(columns.size(), 2U);
  EXPECT_THAT(columns[0].numbers, ElementsAre(0.1, 0.2, testing::IsNan(), 0.4, 0.5));
  EXPECT_FALSE(columns[0].has_texts());
  EXPECT_TRUE(columns[0].is_null(2));
  EXPECT_TRUE(columns[1].is_null(0));
  EXPECT_THAT(columns[1].words, ElementsAre("SC", "sC"));
  EXPECT_THAT(columns[1].word_of_row,
              ElementsAre(AnswerColumn::kNoWord, 0U, 1U, AnswerColumn::kNoWord, 0U));
}

TEST(Cells, OfAGridAreAtItsAxisValuesAndMarkUnsolvedPoints) {
  const Answer answer{numbers({1, 2, 1, 2, 2}), numbers({10, 10, 20, 20, 20}),
                      numbers({5, kNone, 7, kNone, kNone}),
                      texts({"solved", "failed", "solved", "solved", "solved"})};
  const auto gathered =
      gathered_in(answer, cells_around({1, 2, 3}, false), cells_around({10, 20}, false));
  EXPECT_THAT(gathered.cells.states,
              ElementsAre(CellState::kSolved, CellState::kFailed, CellState::kNoResult,
                          CellState::kSolved, CellState::kNoValue, CellState::kNoResult));
  EXPECT_EQ(gathered.cells.values[0], 5.0);
  EXPECT_EQ(gathered.cells.values[3], 7.0);
  EXPECT_EQ(gathered.points, 5U);
  EXPECT_EQ(gathered.most_in_a_cell, 1U);
}

TEST(Cells, WithSeveralPointsHaveTheMean) {
  const Answer answer{numbers({1, 1, 1}), numbers({1, 1, 1}), numbers({1, 3, kNone}),
                      texts({"solved", "solved", "failed"})};
  const auto gathered = gathered_in(answer, cells_around({1}, false), cells_around({1}, false));
  EXPECT_EQ(gathered.cells.values[0], 2.0);
  EXPECT_EQ(gathered.most_in_a_cell, 2U);
  EXPECT_EQ(gathered.cells.states[0], CellState::kSolved);
}

TEST(Cells, ShowTheMostFrequentTextWithCounts) {
  const Answer answer{numbers({1, 1, 1, 1, 2, 2, 3, 4}), numbers({1, 1, 1, 1, 1, 1, 1, 1}),
                      texts({"rare", "SC", "", "SC", "SC", "rare", "SC", ""}),
                      texts(std::vector<std::string>(8, "solved"))};
  const auto gathered =
      gathered_in(answer, cells_around({1, 2, 3, 4}, false), cells_around({1}, false));
  EXPECT_THAT(gathered.cells.names, ElementsAre("SC", "rare", "SC", ""))
      << "of equally frequent texts the first is taken";
  EXPECT_EQ(gathered.cells.states[3], CellState::kNoValue);
  EXPECT_EQ(gathered.most_in_a_cell, 3U);
  EXPECT_THAT(gathered.points_of_name, ElementsAre(Pair("SC", 4U), Pair("rare", 2U)));
}

TEST(Cells, OfEqualSizeContainAllScatteredPoints) {
  std::vector<double> xs;
  std::vector<double> ys;
  for (int i = 0; i < 1000; ++i) {
    xs.push_back(std::fmod(i * 0.618, 1.0));
    ys.push_back(std::fmod(i * 0.414, 3.0));
  }
  const auto gathered = gathered_in({numbers(xs), numbers(ys), numbers(xs)},
                                    cells_between({.range = range_of(xs)}, 8),
                                    cells_between({.range = range_of(ys)}, 5));
  EXPECT_EQ(gathered.points, 1000U);
  EXPECT_EQ(std::accumulate(gathered.counts.begin(), gathered.counts.end(), 0U), 1000U);
  EXPECT_EQ(gathered.cells.states.size(), 40U);
}

TEST(AxisValues, AreThoseOfTheStudyAndOfAdditionalRows) {
  EXPECT_THAT(axis_values({1, 3}, numbers({2, 2, 3, kNone, 1})), ElementsAre(1, 2, 3));
  EXPECT_THAT(axis_values({0.3}, numbers({std::nextafter(0.3, 1.0)})), ElementsAre(0.3))
      << "values that differ by rounding are one value";
}

TEST(GatheredLines, AreSortedAndHaveGapsForFailedAndUnsolvedPoints) {
  const Answer answer{numbers({4, 1, 2, 1, 4}), numbers({40, 10, kNone, 1, 4}),
                      numbers({0.5, 0.5, 0.5, 1, 1})};
  const auto gathered = gathered_lines(answer, {1, 2, 3, 4, 5});
  ASSERT_EQ(gathered.curves.size(), 2U);
  EXPECT_EQ(gathered.curves[0].by, 0.5);
  EXPECT_THAT(gathered.curves[0].x, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(gathered.curves[0].y, ElementsAre(10, testing::IsNan(), testing::IsNan(), 40));
  EXPECT_EQ(gathered.gaps, 4U);
  EXPECT_EQ(gathered.most_at_a_place, 1U);
}

TEST(GatheredLines, UseTheMeanOfPointsWithTheSameX) {
  const auto gathered = gathered_lines({numbers({1, 1, 2}), numbers({2, 4, 7})}, {});
  ASSERT_EQ(gathered.curves.size(), 1U);
  EXPECT_THAT(gathered.curves[0].y, ElementsAre(3, 7));
  EXPECT_EQ(gathered.most_at_a_place, 2U);
}

TEST(GatheredLines, MergeValuesThatDifferByRoundingAndHaveNoGapBesideThem) {
  const double after_2 = std::nextafter(2.0, 3.0);
  const Answer answer{numbers({1, after_2, 3, 1, 2}), numbers({10, 20, 30, 1, 2}),
                      numbers({0.5, std::nextafter(0.5, 1.0), 0.5, 1, 1})};
  const auto gathered = gathered_lines(answer, {1, 2, 3});
  ASSERT_EQ(gathered.curves.size(), 2U);
  EXPECT_THAT(gathered.curves[0].y, ElementsAre(10, 20, 30));
  EXPECT_EQ(gathered.gaps, 0U);
}

}  // namespace
}  // namespace oblique::client::plot
