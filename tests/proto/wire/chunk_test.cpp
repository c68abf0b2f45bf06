// Tests of writing and reading chunks of rows, and of the detection of inconsistent chunks.
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/chunk.h"

namespace oblique::protocol {
namespace {

QueryReply two_rows() {
  ChunkWriter writer({"point", "fn", "mode"});
  writer.integer(std::numeric_limits<std::int64_t>::min());
  writer.real(-0.0);
  writer.text("SC");
  writer.end_row();
  writer.integer(1);
  writer.null();
  writer.text("");
  writer.end_row();
  return writer.take();
}

TEST(Chunk, IsReadAsItWasWritten) {
  const QueryReply chunk = two_rows();
  ASSERT_TRUE(is_sound(chunk));
  ChunkRows rows(chunk);
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.cell(0).integer, std::numeric_limits<std::int64_t>::min());
  EXPECT_TRUE(std::signbit(rows.cell(1).real));
  EXPECT_EQ(rows.cell(2).text, "SC");
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.cell(0).integer, 1);
  EXPECT_EQ(rows.cell(1).kind, CellKind::kNull);
  EXPECT_EQ(rows.cell(2).kind, CellKind::kText);
  EXPECT_EQ(rows.cell(2).text, "");
  EXPECT_FALSE(rows.next());
  EXPECT_FALSE(rows.next());
}

TEST(Chunk, ContainsTheRowsOfItsTable) {
  Table whole;
  append_rows(two_rows(), whole);
  ASSERT_EQ(whole.rows.size(), 2U);
  Table back;
  append_rows(chunk_of(whole), back);
  EXPECT_EQ(back.columns, whole.columns);
  EXPECT_EQ(back.rows, whole.rows);
}

TEST(Chunk, WithInconsistentCellsIsNotSound) {
  const auto broken = [](auto&& breaking) {
    QueryReply chunk = two_rows();
    breaking(chunk);
    return is_sound(chunk);
  };
  EXPECT_TRUE(broken([](QueryReply&) {}));
  EXPECT_FALSE(broken([](QueryReply& chunk) { chunk.set_chunk_rows(3); }));
  EXPECT_FALSE(broken([](QueryReply& chunk) { chunk.set_chunk_rows(UINT64_MAX); }));
  EXPECT_FALSE(broken([](QueryReply& chunk) { chunk.add_columns("more"); }));
  EXPECT_FALSE(broken([](QueryReply& chunk) { chunk.clear_columns(); }));
  EXPECT_FALSE(broken([](QueryReply& chunk) { chunk.clear_cells(); }));
  EXPECT_FALSE(broken([](QueryReply& chunk) { chunk.mutable_cells()->pop_back(); }));
  EXPECT_FALSE(broken([](QueryReply& chunk) { chunk.mutable_cells()->push_back('\0'); }));
  EXPECT_FALSE(broken([](QueryReply& chunk) { chunk.mutable_cells()->front() = '\x7'; }));
  // The length of the last text is too large.
  EXPECT_FALSE(broken([](QueryReply& chunk) {
    chunk.mutable_cells()->replace(chunk.cells().size() - 4, 4, 4, '\xff');
  }));
  QueryReply endless;
  endless.set_chunk_rows(UINT64_MAX);
  EXPECT_FALSE(is_sound(endless));
}

}  // namespace
}  // namespace oblique::protocol
