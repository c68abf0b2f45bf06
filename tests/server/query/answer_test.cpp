#include "server/reading/answer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/chunk_rows.h"
#include "server/reading/reader.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Study "a" has points 0 to 9, of which 5 is not solved yet, and rows of a fourth of a chunk.
class AnswerTest : public testing::Test {
 protected:
  AnswerTest() : store_(path_), table_(table_of(10)) {
    std::vector<Change> changes{AddStudy{1, "a", table_, "2024-01-01T00:00:00.000Z"}};
    for (std::uint64_t point = 0; point < 10; ++point) {
      if (point != 5) {
        changes.emplace_back(result_of(point));
      }
    }
    store_.commit(changes);
  }

  AddResults result_of(std::uint64_t point) const {
    return {1, table_, 0, "", "", 1, "now", {solved_point(point)}};
  }
  static protocol::QueryRequest wide_rows() {
    protocol::QueryRequest request;
    request.mutable_question()->set_study("a");
    request.mutable_question()->add_select("point");
    request.mutable_question()->add_select("'" + std::string(kChunkBytes / 4, 'x') + "' AS x");
    return request;
  }
  /// Points of a chunk.
  static std::vector<std::int64_t> points_of(const protocol::QueryReply& chunk) {
    std::vector<std::int64_t> points;
    protocol::ChunkRows rows(chunk);
    while (rows.next()) {
      points.push_back(rows.cell(0).integer);
    }
    return points;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  Store store_;
  std::shared_ptr<const protocol::PointTable> table_;
};

TEST_F(AnswerTest, ComesInNumberedChunksOfOneMoment) {
  Reader reader(path_);
  Answer answer = reader.answer(wide_rows(), {});
  const auto first = answer.next();
  EXPECT_THAT(points_of(first), ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(first.chunk(), 1U);
  EXPECT_EQ(first.columns_size(), 2);
  const std::vector<Change> more{result_of(5)};
  store_.commit(more);
  const auto second = answer.next();
  EXPECT_THAT(points_of(second), ElementsAre(4, 6, 7, 8));
  EXPECT_EQ(second.chunk(), 2U);
  EXPECT_FALSE(second.ends());
  const auto last = answer.next();
  EXPECT_THAT(points_of(last), ElementsAre(9));
  EXPECT_TRUE(last.ends());
}

TEST_F(AnswerTest, ALimitHoldsOverAllChunks) {
  Reader reader(path_);
  auto request = wide_rows();
  request.mutable_question()->set_limit(6);
  Answer answer = reader.answer(request, {});
  EXPECT_THAT(points_of(answer.next()), ElementsAre(0, 1, 2, 3));
  const auto last = answer.next();
  EXPECT_THAT(points_of(last), ElementsAre(4, 6));
  EXPECT_TRUE(last.ends());
}

TEST_F(AnswerTest, HoldsNoTransactionOnceItHasEnded) {
  Reader reader(path_);
  Answer answer = reader.answer(wide_rows(), {});
  const DatabaseHandle other = open_database(path_, SQLITE_OPEN_READWRITE);
  execute(other.get(), "SELECT * FROM studies");
  const auto truncate_log = [&other] {
    return sqlite3_wal_checkpoint_v2(other.get(), nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr,
                                     nullptr);
  };
  answer.next();
  const std::vector<Change> more{result_of(5)};
  store_.commit(more);
  EXPECT_EQ(truncate_log(), SQLITE_BUSY);
  while (!answer.next().ends()) {
  }
  EXPECT_EQ(truncate_log(), SQLITE_OK);
}

TEST_F(AnswerTest, LikeIsCaseSensitive) {
  Reader reader(path_);
  EXPECT_EQ(reader.query("SELECT 'SC' LIKE 'sC'", {}).rows(0).values(0).integer(), 0);
  EXPECT_EQ(reader.query("SELECT 'SC' LIKE 'S%' ESCAPE '!'", {}).rows(0).values(0).integer(), 1);
  protocol::QueryRequest request;
  request.mutable_question()->set_study("a");
  request.mutable_question()->add_select("point");
  request.mutable_question()->set_where("mode LIKE lower(mode)");
  EXPECT_EQ(reader.answer(request, {}).next().chunk_rows(), 0U);
  request.mutable_question()->set_where("mode LIKE mode");
  EXPECT_EQ(reader.answer(request, {}).next().chunk_rows(), 9U);
}

TEST_F(AnswerTest, ToAQuestionNamesTheUnitsOfItsColumns) {
  Reader reader(path_);
  protocol::QueryRequest request;
  request.mutable_question()->set_study("a");
  request.mutable_question()->add_select("H, status");
  const auto chunk = reader.answer(request, {}).next();
  EXPECT_THAT(chunk.units(), ElementsAre("m", ""));
}

TEST_F(AnswerTest, ToAWrongQuestionIsWrongUsage) {
  Reader reader(path_);
  protocol::QueryRequest request;
  request.mutable_question()->set_study("no such");
  EXPECT_THROW(reader.answer(request, {}), solver::InputError);
}

TEST_F(AnswerTest, AFunctionThatIsGivenWhatItDoesNotTakeIsWrongUsage) {
  Reader reader(path_);
  protocol::QueryRequest request;
  request.mutable_question()->set_study("a");
  request.mutable_question()->add_select("percentile(mu, 100 + 20)");
  EXPECT_THROW(reader.answer(request, {}).next(), StatementError);
  EXPECT_THROW(reader.query("SELECT percentile(mu, 120) FROM runs", {}), StatementError);
}

}  // namespace
}  // namespace oblique::server
