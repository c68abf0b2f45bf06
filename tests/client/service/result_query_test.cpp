#include "client/service/result_query.h"

#include <algorithm>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/asking/columns.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;

/// A server that answers from rows 0, 1, 2, ... and sends at most `page` of them at once.
class PagingSource final : public Source {
 public:
  PagingSource(int rows, int page) : rows_(rows), page_(page) {}

  protocol::QueryReply query(const std::string& sql) override {
    statements.push_back(sql);
    const auto tail = sql.substr(sql.rfind(" LIMIT ") + 7);
    const int limit = std::stoi(tail);
    const int offset = std::stoi(tail.substr(tail.find(" OFFSET ") + 8));
    const int end = limit < 0 ? rows_ : std::min(rows_, offset + limit);
    protocol::QueryReply reply;
    reply.add_columns("point");
    for (int row = offset; row < std::min(end, offset + page_); ++row) {
      reply.add_rows()->add_values()->set_integer(row);
    }
    reply.set_truncated(end > offset + page_);
    return reply;
  }
  std::vector<protocol::StudyStatus> status(const std::string&, const Tell&) override { return {}; }
  std::vector<protocol::StudyStatus> status_of(const std::string&, std::uint64_t,
                                               const Tell&) override {
    return {};
  }
  std::string place() const override { return "here"; }

  std::vector<std::string> statements;

 private:
  int rows_;
  int page_;
};

ResultQuery with(const std::function<void(ResultQuery&)>& change) {
  ResultQuery query;
  query.study = "a";
  change(query);
  return query;
}

std::vector<std::int64_t> points_of(const protocol::QueryReply& reply) {
  std::vector<std::int64_t> points;
  for (const auto& row : reply.rows()) {
    points.push_back(row.values(0).integer());
  }
  return points;
}

TEST(ResultQuery, ALongAnswerIsAskedForInParts) {
  PagingSource source(25, 10);
  const auto reply = all_rows(source, with([](ResultQuery&) {}), true);
  std::vector<std::int64_t> all(25);
  std::generate(all.begin(), all.end(), [i = 0]() mutable { return i++; });
  EXPECT_EQ(points_of(reply), all);
  EXPECT_FALSE(reply.truncated());
  EXPECT_EQ(source.statements.size(), 3U);
}

TEST(ResultQuery, PartsThatEndWithTheAnswerAskForNothingMore) {
  PagingSource source(20, 10);
  EXPECT_EQ(all_rows(source, with([](ResultQuery&) {}), true).rows_size(), 20);
  EXPECT_EQ(source.statements.size(), 2U);
}

TEST(ResultQuery, ALimitHoldsOverAllParts) {
  PagingSource source(100, 10);
  const auto query = with([](ResultQuery& q) { q.limit = 25; });
  const auto reply = all_rows(source, query, true);
  EXPECT_EQ(reply.rows_size(), 25);
  EXPECT_EQ(points_of(reply).back(), 24);
  EXPECT_FALSE(reply.truncated());
}

TEST(ResultQuery, TheAnswerOfAStudyAtWorkIsLeftCutOff) {
  PagingSource source(25, 10);
  const auto reply = all_rows(source, with([](ResultQuery&) {}), false);
  EXPECT_EQ(reply.rows_size(), 10);
  EXPECT_TRUE(reply.truncated());
}

TEST(ResultQuery, AConditionCannotWidenWhatItStandsIn) {
  const auto query = with([](ResultQuery& q) {
    q.study = "it's";
    q.where = "mu > 1 OR 1";
    q.order = "mu DESC";
    q.limit = 5;
  });
  EXPECT_THAT(statement_of(query, 2),
              HasSubstr(server::rows_of_queries() +
                        " WHERE study = 'it''s') WHERE (mu > 1 OR 1) ORDER BY mu DESC LIMIT 3 "
                        "OFFSET 2"));
}

TEST(ResultQuery, EachFlagIsCheckedAndNamed) {
  const auto objection = [](const std::function<void(ResultQuery&)>& change) -> std::string {
    try {
      check(with(change));
    } catch (const solver::InputError& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_EQ(objection([](ResultQuery&) {}), "");
  EXPECT_THAT(objection([](ResultQuery& q) { q.where = "mu > 0.5 --"; }), HasSubstr("--where"));
  EXPECT_THAT(objection([](ResultQuery& q) { q.select = "mu FROM runs --"; }),
              HasSubstr("--select"));
  EXPECT_THAT(objection([](ResultQuery& q) { q.order = "mu LIMIT 1"; }), HasSubstr("--order"));
  EXPECT_THAT(objection([](ResultQuery& q) { q.limit = -1; }), HasSubstr("--limit -1"));
}

}  // namespace
}  // namespace oblique::client
