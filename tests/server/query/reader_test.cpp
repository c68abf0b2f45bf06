#include "server/reading/reader.h"

#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/result_message.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

class ReaderTest : public testing::Test {
 protected:
  ReaderTest() {
    Store store(path_);
    const auto table = table_of(4);
    const std::vector<Change> changes{
        AddStudy{1, "a", table, "2024-01-01T00:00:00.000Z"},
        AddStudy{2, "b", table_of(2), "2024-01-02T00:00:00.000Z"},
        AddResults{1,
                   table,
                   0,
                   "",
                   "",
                   1,
                   "now",
                   {solved_point(0), solved_point(2), protocol::failed_point(3, "no")}}};
    store.commit(changes);
  }

  std::string refusal_of(const std::string& sql, const QueryLimits& limits = {}) {
    try {
      Reader(path_).query(sql, limits);
    } catch (const QueryError& error) {
      return error.what();
    }
    return "it ran";
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
};

TEST_F(ReaderTest, AReplyHasColumnsAndTypedValues) {
  const auto reply =
      Reader(path_).query("SELECT 1 AS i, 0.5 AS r, 'x' AS t, NULL AS n, x'0aff' AS b", {});
  EXPECT_EQ(reply.columns_size(), 5);
  EXPECT_EQ(reply.columns(1), "r");
  const auto& row = reply.rows(0);
  EXPECT_EQ(row.values(0).integer(), 1);
  EXPECT_EQ(row.values(1).real(), 0.5);
  EXPECT_EQ(row.values(2).text(), "x");
  EXPECT_EQ(row.values(3).kind_case(), protocol::Value::KIND_NOT_SET);
  EXPECT_EQ(row.values(4).text(), "x'0AFF'");
}

TEST_F(ReaderTest, ATextThatIsNotUtf8ComesAsHexadecimal) {
  const auto reply = Reader(path_).query(
      "SELECT CAST(x'ff' AS TEXT), CAST(x'eda080' AS TEXT), CAST(x'c3a9' AS TEXT)", {});
  EXPECT_EQ(reply.rows(0).values(0).text(), "x'FF'");
  EXPECT_EQ(reply.rows(0).values(1).text(), "x'EDA080'");
  EXPECT_EQ(reply.rows(0).values(2).text(), "\xc3\xa9");
}

TEST_F(ReaderTest, StatementsThatWriteOrReachOutsideAreRefused) {
  for (const char* sql :
       {"DELETE FROM results", "INSERT INTO about VALUES ('x')", "UPDATE studies SET name = 'z'",
        "DROP TABLE results", "CREATE TABLE t (x)", "CREATE TEMP TABLE t (x)",
        "ATTACH DATABASE '/tmp/elsewhere.db' AS other", "DETACH DATABASE main",
        "PRAGMA user_version = 10", "PRAGMA journal_mode = DELETE", "PRAGMA writable_schema = 1",
        "VACUUM INTO '/tmp/copy.db'", "BEGIN", "SAVEPOINT s", "ANALYZE", "REINDEX",
        "SELECT load_extension('/tmp/x.so')"}) {
    EXPECT_NE(refusal_of(sql), "it ran") << sql;
  }
  EXPECT_EQ(Reader(path_).query("SELECT * FROM results", {}).rows_size(), 3);
}

TEST_F(ReaderTest, FunctionsThatReachOutOfTheDatabaseAreRefused) {
  for (const char* sql : {"SELECT fts3_tokenizer('simple')", "SELECT fts3_tokenizer('x', x'00')",
                          "SELECT load_extension('x')", "SELECT sqlite_log(1, 'x')",
                          "SELECT rtreecheck('results')"}) {
    EXPECT_THAT(refusal_of(sql), HasSubstr("not authorized to use function")) << sql;
  }
  EXPECT_EQ(refusal_of("SELECT json_extract('[1]', '$[0]'), abs(-1), randomblob(3), upper('x')"),
            "it ran");
}

TEST_F(ReaderTest, ANameInDoubleQuotesIsNeverAText) {
  EXPECT_THAT(
      refusal_of("SELECT count(*) FROM runs WHERE \"mux\" > 0.5"),
      testing::AllOf(HasSubstr("no such column: mux"), HasSubstr("in single quotes a text")));
  EXPECT_THAT(refusal_of("SELECT mux FROM runs"), testing::Not(HasSubstr("quotes")));
  EXPECT_EQ(refusal_of("SELECT \"mu\" AS \"my mu\" FROM \"runs\" ORDER BY \"my mu\""), "it ran");
}

TEST_F(ReaderTest, AParameterIsRefusedForItHasNoValue) {
  EXPECT_THAT(refusal_of("SELECT ?"), HasSubstr("the parameter ?,"));
  EXPECT_THAT(refusal_of("SELECT 1 WHERE 1 > :mu"), HasSubstr("the parameter :mu,"));
  EXPECT_THAT(refusal_of("SELECT $x"), HasSubstr("the parameter $x,"));
}

TEST_F(ReaderTest, ARowOverTheLimitOfAReplyIsAnError) {
  const QueryLimits limits{1000, 0, 1'000'000};
  EXPECT_THAT(refusal_of("SELECT zeroblob(499)", limits), HasSubstr("more than the 1000 bytes"));
  EXPECT_THAT(refusal_of("SELECT hex(zeroblob(501))", limits),
              HasSubstr("more than the 1000 bytes"));
  EXPECT_EQ(refusal_of("SELECT zeroblob(400)", limits), "it ran");
  EXPECT_THAT(refusal_of("SELECT 1 UNION ALL SELECT zeroblob(499)", limits),
              HasSubstr("more than the 1000 bytes"));
}

TEST_F(ReaderTest, AValueOverItsLimitIsAnErrorOnTheWayToo) {
  const QueryLimits limits{1000, 0, 1 << 20U};
  EXPECT_THAT(refusal_of("SELECT length(zeroblob(1048577))", limits),
              HasSubstr("more than the 1 MiB allowed"));
  EXPECT_EQ(refusal_of("SELECT length(zeroblob(1000000))", limits), "it ran");
}

TEST_F(ReaderTest, OneStatementAtATime) {
  EXPECT_THAT(refusal_of("SELECT 1; SELECT 2"), HasSubstr("one statement"));
  EXPECT_THAT(refusal_of("  "), HasSubstr("no statement"));
  EXPECT_EQ(refusal_of("SELECT 1 ; \n"), "it ran");
}

TEST_F(ReaderTest, AWrongStatementIsAnErrorThatSaysWhere) {
  EXPECT_THAT(refusal_of("SELECT nothing FROM results"), HasSubstr("nothing"));
}

TEST_F(ReaderTest, TablesCanBeListed) {
  EXPECT_EQ(refusal_of("PRAGMA table_info(results)"), "it ran");
  EXPECT_EQ(refusal_of("SELECT name FROM sqlite_schema"), "it ran");
}

TEST_F(ReaderTest, AnEndlessQueryEndsAtItsTimeLimit) {
  EXPECT_THAT(refusal_of("WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
                         "SELECT count(*) FROM n",
                         {1000, 50, 1'000'000}),
              HasSubstr("took too long (more than 0.05 s)"));
}

TEST_F(ReaderTest, ARunningQueryCanBeInterrupted) {
  Reader reader(path_);
  std::thread other([&] { reader.interrupt(); });
  EXPECT_THROW(reader.query("WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
                            "SELECT count(*) FROM n",
                            kNoLimits),
               QueryError);
  other.join();
}

TEST_F(ReaderTest, WhatTheServerCommitsIsSeenWhileItRuns) {
  Store store(path_);
  Reader reader(path_);
  const std::string count = "SELECT count(*) FROM results";
  EXPECT_EQ(reader.query(count, {}).rows(0).values(0).integer(), 3);
  const std::vector<Change> changes{
      AddResults{1, table_of(4), 0, "", "", 1, "now", {solved_point(1)}}};
  store.commit(changes);
  EXPECT_EQ(reader.query(count, {}).rows(0).values(0).integer(), 4);
}

TEST_F(ReaderTest, TheStatusOfStudiesIsDerivedFromTheRows) {
  const auto all = Reader(path_).study_status();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].name(), "a");
  EXPECT_EQ(all[0].points(), 4U);
  EXPECT_EQ(all[0].solved(), 2U);
  EXPECT_EQ(all[0].failed(), 1U);
  EXPECT_EQ(all[0].state(), "running");
  EXPECT_EQ(Reader(path_).study_status("b").at(0).solved(), 0U);
  EXPECT_THROW(Reader(path_).study_status("c"), QueryError);
}

TEST_F(ReaderTest, EachStudyHasThePointsThatItTookOver) {
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "INSERT INTO origins VALUES (7, 'x'), (8, 'y');"
          "INSERT INTO taken_points VALUES (1, 7, 1), (1, 8, 2), (2, 8, 5)");
  const auto all = Reader(path_).study_status();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].taken().points(), 3U);
  ASSERT_EQ(all[0].taken().from_size(), 2);
  EXPECT_EQ(all[0].taken().from(0).study(), "y");
  EXPECT_EQ(all[1].taken().points(), 5U);
  ASSERT_EQ(all[1].taken().from_size(), 1);
  EXPECT_EQ(all[1].taken().from(0).study(), "y");
}

TEST_F(ReaderTest, AStudyWithAllItsRowsIsDone) {
  {
    Store store(path_);
    const std::vector<Change> changes{
        AddResults{1, table_of(4), 0, "", "", 1, "now", {solved_point(1)}}};
    store.commit(changes);
  }
  EXPECT_EQ(Reader(path_).study_status("a").at(0).state(), "done");
}

TEST_F(ReaderTest, AStatementMayUnfoldListsItself) {
  { const Store store(path_); }
  for (const char* sql : {"SELECT sum(value) FROM json_each('[1, 2, 3]')",
                          "SELECT sum(atom) FROM json_tree('[1, [2, 3]]')"}) {
    EXPECT_EQ(Reader(path_).query(sql, kNoLimits).rows(0).values(0).integer(), 6) << sql;
  }
}

TEST_F(ReaderTest, WhatIsNoDatabaseOfOursIsRefusedByItsKind) {
  const auto message_of = [](const std::string& path) -> std::string {
    try {
      const Reader reader(path);
    } catch (const StorageError& error) {
      return error.what();
    }
    return "it opened";
  };
  EXPECT_THAT(message_of(folder_.file("none.db")), HasSubstr("there is no database"));
  EXPECT_THAT(message_of(folder_.file("")), HasSubstr("is a directory"));
  std::ofstream(folder_.file("empty.db")) << "";
  EXPECT_THAT(message_of(folder_.file("empty.db")), HasSubstr("is empty"));
  std::ofstream(folder_.file("text.db")) << std::string(5000, 'x');
  EXPECT_THAT(message_of(folder_.file("text.db")), HasSubstr("is not a database"));
}

}  // namespace
}  // namespace oblique::server
