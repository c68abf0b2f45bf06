// Answers in chunks: what rests goes on, and what cannot says so.
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

TEST_F(AnswerTest, InTheOrderOfPointsGoesOnAfterARestWithWhatWasAddedBehind) {
  Reader reader(path_);
  Answer answer = reader.answer(wide_rows(), {});
  EXPECT_TRUE(answer.can_go_on());
  const auto first = answer.next();
  EXPECT_THAT(points_of(first), ElementsAre(0, 1, 2, 3));
  EXPECT_FALSE(first.ends());
  EXPECT_EQ(first.columns_size(), 2) << "the point by which it goes on is not shown";
  answer.rest();
  const std::vector<Change> more{result_of(5)};
  store_.commit(more);
  const auto second = answer.next();
  EXPECT_THAT(points_of(second), ElementsAre(4, 5, 6, 7));
  EXPECT_EQ(second.chunk(), 2U);
  answer.rest();
  const auto last = answer.next();
  EXPECT_THAT(points_of(last), ElementsAre(8, 9));
  EXPECT_TRUE(last.ends());
  EXPECT_EQ(answer.given().rows(), 10U);
}

TEST_F(AnswerTest, OfAFilteredStudyGoesOnAfterARestBehindItsLastPoint) {
  protocol::PointTable surveyed(protocol::recipe_of_blocks(
      {protocol::filtered({protocol::listed("H", {1.0}), protocol::range("mu", 0.0, 1.0, 11),
                           protocol::listed("e", {1.0})},
                          "mu < 0.15 || mu > 0.35")}));
  surveyed.survey([] { return true; });
  const auto table = std::make_shared<const protocol::PointTable>(std::move(surveyed));
  AddResults results{2, table, 0, "", "", 1, "now", {}};
  for (const std::uint64_t point : {0U, 1U, 4U, 5U, 6U, 7U, 8U, 9U, 10U}) {
    results.results.push_back(solved_point(point));
  }
  const std::vector<Change> changes{AddStudy{2, "filtered", table, "2024-01-01T00:00:00.000Z"},
                                    std::move(results)};
  store_.commit(changes);
  auto request = wide_rows();
  request.mutable_question()->set_study("filtered");
  Reader reader(path_);
  Answer answer = reader.answer(request, {});
  EXPECT_THAT(points_of(answer.next()), ElementsAre(0, 1, 4, 5));
  answer.rest();
  EXPECT_THAT(points_of(answer.next()), ElementsAre(6, 7, 8, 9));
  answer.rest();
  EXPECT_THAT(points_of(answer.next()), ElementsAre(10));
}

TEST_F(AnswerTest, HoldsNoTransactionWhileItRests) {
  Reader reader(path_);
  Answer answer = reader.answer(wide_rows(), {});
  answer.next();
  answer.rest();
  // A checkpoint that truncates the log needs that nobody reads it.
  sqlite3* raw = nullptr;
  ASSERT_EQ(sqlite3_open(path_.c_str(), &raw), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(raw, "SELECT * FROM studies", nullptr, nullptr, nullptr), SQLITE_OK);
  const auto checkpoint = [raw] {
    return sqlite3_wal_checkpoint_v2(raw, nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
  };
  EXPECT_EQ(checkpoint(), SQLITE_OK);
  const std::vector<Change> more{result_of(5)};
  store_.commit(more);
  answer.next();
  const std::vector<Change> yet_more{AddStudy{2, "b", table_, "2024-01-01T00:00:00.000Z"}};
  store_.commit(yet_more);
  EXPECT_EQ(checkpoint(), SQLITE_BUSY) << "while it does not rest it reads";
  sqlite3_close(raw);
}

TEST_F(AnswerTest, ALimitHoldsOverAllChunksAndRests) {
  Reader reader(path_);
  auto request = wide_rows();
  request.mutable_question()->set_limit(6);
  Answer answer = reader.answer(request, {});
  EXPECT_THAT(points_of(answer.next()), ElementsAre(0, 1, 2, 3));
  answer.rest();
  const auto last = answer.next();
  EXPECT_THAT(points_of(last), ElementsAre(4, 6));
  EXPECT_TRUE(last.ends());
}

TEST_F(AnswerTest, ALimitThatEndsWithAChunkEndsTheAnswer) {
  Reader reader(path_);
  auto request = wide_rows();
  request.mutable_question()->set_limit(4);
  Answer answer = reader.answer(request, {});
  std::uint64_t rows = 0;
  for (bool ends = false; !ends;) {
    const auto chunk = answer.next();
    rows += chunk.chunk_rows();
    ends = chunk.ends();
    answer.rest();
  }
  EXPECT_EQ(rows, 4U);
}

TEST_F(AnswerTest, GoesOnInAnotherProcessFromWhatWasGiven) {
  protocol::QueryRequest request = wide_rows();
  {
    Reader reader(path_);
    Answer answer = reader.answer(request, {});
    answer.next();
    *request.mutable_after() = answer.given();
  }
  Reader reader(path_);
  Answer answer = reader.answer(request, {});
  const auto chunk = answer.next();
  EXPECT_EQ(chunk.chunk(), 2U);
  EXPECT_THAT(points_of(chunk), ElementsAre(4, 6, 7, 8));
}

TEST_F(AnswerTest, InAnotherOrderCannotGoOnAfterARest) {
  Reader reader(path_);
  auto request = wide_rows();
  request.mutable_question()->set_order("point DESC");
  Answer answer = reader.answer(request, {});
  EXPECT_FALSE(answer.can_go_on());
  EXPECT_THAT(points_of(answer.next()), ElementsAre(9, 8, 7, 6));
  answer.rest();
  try {
    answer.next();
    FAIL();
  } catch (const QueryError& error) {
    EXPECT_THAT(error.what(), HasSubstr("was ended in the middle"));
  }
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

TEST_F(AnswerTest, LikeTellsCapitalsApartInAQuestionAndNotInSqlWhicheverComesFirst) {
  Reader reader(path_);
  const auto found = [&](const protocol::QueryRequest& request) {
    const auto chunk = reader.answer(request, {}).next();
    protocol::ChunkRows rows(chunk);
    return rows.next() ? rows.cell(0).integer : -1;
  };
  const auto asked = [](const std::string& condition) {
    protocol::QueryRequest request;
    request.mutable_question()->set_study("a");
    request.mutable_question()->add_select("count(*)");
    request.mutable_question()->set_where(condition);
    return request;
  };
  protocol::QueryRequest sql;
  sql.set_sql("SELECT count(*) FROM runs WHERE mode LIKE lower(mode)");
  for (int times = 0; times < 2; ++times) {
    EXPECT_EQ(found(asked("mode LIKE lower(mode)")), 0);
    EXPECT_EQ(found(asked("mode LIKE mode AND mode LIKE 'S%' ESCAPE '!'")), 9);
    EXPECT_EQ(found(sql), 9);
    EXPECT_EQ(reader.query(sql.sql(), {}).rows(0).values(0).integer(), 9);
  }
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
