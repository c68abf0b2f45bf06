#include "server/query/reader.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/chunk.h"
#include "tests/server/store/store_fixture.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kEndless =
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n";

class ReaderTest : public StoreFixture {
 protected:
  ReaderTest() {
    const auto study = study_of(4);
    commit({study, study_of(2, 2, "b"), worker(1), solved(study, {0, 2}), failed(study, {3})});
  }

  std::string refusal_of(const std::string& sql, const QueryLimits& limits = {}) {
    try {
      Reader(path_).query(sql, limits);
    } catch (const QueryError& error) {
      return error.what();
    }
    return "it ran";
  }
  /// Returns the values of the first row.
  protocol::Row row_of(const std::string& sql) { return Reader(path_).query(sql, {}).rows.at(0); }
};

TEST_F(ReaderTest, ValuesKeepTheirSqliteTypes) {
  const auto reply = Reader(path_).query(
      "SELECT 1 AS i, 0.5 AS r, CAST(x'c3a9' AS TEXT) AS t, NULL AS n, x'0aff' AS b,"
      " CAST(x'ff' AS TEXT), CAST(x'eda080' AS TEXT), 'SC' LIKE 'sC', 'SC' LIKE 'S%' ESCAPE '!'",
      {});
  EXPECT_EQ(reply.columns.at(1), "r");
  using Text = std::string;
  using Integer = std::int64_t;
  const protocol::Row expected{Integer{1},        0.5, Text("\xc3\xa9"), std::monostate{},
                               Text("x'0AFF'"),
                               Text("x'FF'"),      // not UTF-8
                               Text("x'EDA080'"),  // not UTF-8
                               Integer{0},         // LIKE is case-sensitive
                               Integer{1}};
  EXPECT_EQ(reply.rows.at(0), expected);
}

TEST_F(ReaderTest, AQueryOfAStudyIsAnsweredWithUnits) {
  Reader reader(path_);
  const auto first_chunk = [&](const std::string& study, const std::string& select) {
    protocol::QueryRequest request;
    request.mutable_question()->set_study(study);
    request.mutable_question()->add_select(select);
    return reader.answer(request, {}).next();
  };
  const auto chunk = first_chunk("a", "H, status");
  EXPECT_EQ(chunk.chunk_rows(), 3U);
  EXPECT_THAT(chunk.units(), ElementsAre("m", ""));
  EXPECT_THROW(first_chunk("no such", "H"), NoSuchStudy);
  EXPECT_THROW(first_chunk("a", "median(status)"), QueryError);
}

TEST_F(ReaderTest, StatementsThatWriteReachOutsideOrAreWrongAreRefusedWithTheReason) {
  const std::pair<const char*, const char*> wrong[] = {
      {"DELETE FROM results", "only reading is allowed"},
      {"INSERT INTO about VALUES ('x')", "only reading is allowed"},
      {"UPDATE studies SET name = 'z'", "only reading is allowed"},
      {"CREATE TEMP TABLE t (x)", "only reading is allowed"},
      {"ATTACH DATABASE '/tmp/elsewhere.db' AS other", "only reading is allowed"},
      {"PRAGMA writable_schema = 1", "only reading is allowed"},
      {"VACUUM INTO '/tmp/copy.db'", "only reading is allowed"},
      {"BEGIN", "only reading is allowed"},
      {"ANALYZE", "only reading is allowed"},
      {"SELECT fts3_tokenizer('simple')", "not authorized to use function"},
      {"SELECT load_extension('x')", "not authorized to use function"},
      {"SELECT rtreecheck('results')", "not authorized to use function"},
      {"SELECT 1 WHERE 1 > :mu", "a parameter"},
      {"SELECT 1; SELECT 2", "one statement"},
      {"  ", "the statement is empty"},
      {"SELECT count(*) FROM runs WHERE \"mux\" > 0.5", "mux"},
  };
  for (const auto& [sql, reason] : wrong) {
    EXPECT_THAT(refusal_of(sql), HasSubstr(reason)) << sql;
  }
  EXPECT_EQ(Reader(path_).query("SELECT * FROM results", {}).rows.size(), 3U);
}

TEST_F(ReaderTest, StatementsMayListTablesAndUseJson) {
  for (const char* sql : {"SELECT name FROM sqlite_schema", "SELECT 1 ; \n",
                          "SELECT json_extract('[1]', '$[0]'), abs(-1), randomblob(3), upper('x')",
                          "SELECT \"mu\" AS \"my mu\" FROM \"runs\" ORDER BY \"my mu\""}) {
    EXPECT_EQ(refusal_of(sql), "it ran") << sql;
  }
  EXPECT_EQ(row_of("SELECT sum(value) FROM json_each('[1, 2, 3]')"),
            protocol::Row{std::int64_t{6}});
  EXPECT_EQ(row_of("SELECT sum(atom) FROM json_tree('[1, [2, 3]]')"),
            protocol::Row{std::int64_t{6}});
}

TEST_F(ReaderTest, AFileWhoseViewOrIndexWasChangedIsRefusedByName) {
  close();
  const std::string sound = folder_.file("sound.db");
  std::filesystem::copy_file(path_, sound);
  for (const auto& [name, from, to] : {std::tuple{"runs", "m.E AS E_Pa", "m.A AS E_Pa"},
                                       {"peaks", "->> 1", "->> 2"},
                                       {"failed_points", "IS NOT NULL", "IS NULL"},
                                       {"studies", "counted ", "counteD "}}) {
    execute_sql(
        fmt::format("PRAGMA writable_schema = ON; UPDATE sqlite_schema SET"
                    " sql = replace(sql, '{1}', '{2}') WHERE name = '{0}'",
                    name, from, to));
    EXPECT_THAT([&] { Reader reader(path_); },
                testing::ThrowsMessage<StorageError>(
                    testing::AllOf(HasSubstr(path_), HasSubstr(name), HasSubstr("was changed"))));
    std::filesystem::copy_file(sound, path_, std::filesystem::copy_options::overwrite_existing);
  }
  EXPECT_EQ(refusal_of("SELECT 1"), "it ran");
}

TEST_F(ReaderTest, ARowOrAValueOverItsLimitIsAnError) {
  const QueryLimits limits{1000, 0, 1'000'000};
  EXPECT_THAT(refusal_of("SELECT zeroblob(499)", limits), HasSubstr("more than the 1000 bytes"));
  EXPECT_THAT(refusal_of("SELECT hex(zeroblob(501))", limits),
              HasSubstr("more than the 1000 bytes"));
  EXPECT_EQ(refusal_of("SELECT zeroblob(400)", limits), "it ran");
  const QueryLimits of_values{1000, 0, 1 << 20U};
  EXPECT_THAT(refusal_of("SELECT length(zeroblob(1048577))", of_values),
              HasSubstr("exceeds the allowed 1 MiB"));
  EXPECT_EQ(refusal_of("SELECT length(zeroblob(1000000))", of_values), "it ran");
}

TEST_F(ReaderTest, AnEndlessQueryEndsAtItsTimeLimit) {
  EXPECT_THAT(refusal_of(kEndless, {1000, 50, 1'000'000}), HasSubstr("took more than 0.05 s"));
}

TEST_F(ReaderTest, ARunningQueryCanBeInterrupted) {
  Reader reader(path_);
  std::thread other([&] { reader.interrupt(); });
  EXPECT_THROW(reader.query(kEndless, kNoLimits), QueryError);
  other.join();
}

TEST_F(ReaderTest, TheStatusOfStudiesIsDerivedFromTheRows) {
  execute_sql("INSERT INTO reused_points VALUES (1, 'x', 1), (1, 'y', 2), (2, 'y', 5)");
  const auto all = Reader(path_).study_status();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].name(), "a");
  EXPECT_EQ(all[0].points(), 4U);
  EXPECT_EQ(all[0].solved(), 2U);
  EXPECT_EQ(all[0].failed(), 1U);
  EXPECT_EQ(all[0].state(), "running");
  EXPECT_EQ(all[0].reused().points(), 3U);
  ASSERT_EQ(all[0].reused().from_size(), 2);
  EXPECT_EQ(all[0].reused().from(0).study(), "y");
  EXPECT_EQ(Reader(path_).study_status("b").at(0).solved(), 0U);
  EXPECT_THROW(Reader(path_).study_status("c"), QueryError);
  commit({solved(study_of(4), {1})});
  EXPECT_EQ(Reader(path_).study_status("a").at(0).state(), "done");
}

/// Study "a" has points 0 to 9, of which 5 is not solved. Four rows of `wide_rows` fill a chunk.
class AnswerTest : public StoreFixture {
 protected:
  AnswerTest() { commit({study_, worker(1), solved(study_, {0, 1, 2, 3, 4, 6, 7, 8, 9})}); }

  /// Returns limits without a time limit for chunks, so that a reader sends only full chunks.
  static QueryLimits full_chunks() {
    QueryLimits limits;
    limits.longest_chunk_ms = INT64_MAX;
    return limits;
  }
  static protocol::QueryRequest wide_rows() {
    protocol::QueryRequest request;
    request.mutable_question()->set_study("a");
    request.mutable_question()->add_select("point");
    request.mutable_question()->add_select("'" + std::string(kChunkBytes / 4, 'x') + "' AS x");
    return request;
  }
  /// Returns the numbers of the points in a chunk.
  static std::vector<std::int64_t> points_of(const protocol::QueryReply& chunk) {
    std::vector<std::int64_t> points;
    protocol::ChunkRows rows(chunk);
    while (rows.next()) {
      points.push_back(rows.cell(0).integer);
    }
    return points;
  }

  const AddStudy study_ = study_of(10);
};

TEST_F(AnswerTest, HasNumberedChunksOfOneSnapshot) {
  Reader reader(path_);
  Answer answer = reader.answer(wide_rows(), full_chunks());
  const auto first = answer.next();
  EXPECT_THAT(points_of(first), ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(first.chunk(), 1U);
  EXPECT_EQ(first.columns_size(), 2);
  commit({solved(study_, {5})});
  const auto second = answer.next();
  EXPECT_THAT(points_of(second), ElementsAre(4, 6, 7, 8));
  EXPECT_EQ(second.chunk(), 2U);
  EXPECT_FALSE(second.ends());
  const auto last = answer.next();
  EXPECT_THAT(points_of(last), ElementsAre(9));
  EXPECT_TRUE(last.ends());
  EXPECT_EQ(reader.query("SELECT * FROM results", {}).rows.size(), 10U);
}

TEST_F(AnswerTest, HoldsNoTransactionOnceItHasEnded) {
  Reader reader(path_);
  Answer answer = reader.answer(wide_rows(), full_chunks());
  const DatabaseHandle other = open_database(path_, SQLITE_OPEN_READWRITE);
  execute(other.get(), "SELECT * FROM studies");
  const auto truncate_log = [&other] {
    return sqlite3_wal_checkpoint_v2(other.get(), nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr,
                                     nullptr);
  };
  answer.next();
  commit({solved(study_, {5})});
  EXPECT_EQ(truncate_log(), SQLITE_BUSY);
  while (!answer.next().ends()) {
  }
  EXPECT_EQ(truncate_log(), SQLITE_OK);
}

}  // namespace
}  // namespace oblique::server
