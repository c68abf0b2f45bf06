#include "client/service/source.h"

#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;

ResultQuery with(const std::function<void(ResultQuery&)>& change) {
  ResultQuery query;
  query.study = "a";
  change(query);
  return query;
}

TEST(ResultQuery, IsAQuestionOfTheSameParts) {
  const auto request = request_for(with([](ResultQuery& q) {
    q.where = "mu > 1 OR 1";
    q.order = "mu DESC";
    q.limit = 5;
  }));
  EXPECT_EQ(request.question().study(), "a");
  EXPECT_EQ(request.question().where(), "mu > 1 OR 1");
  EXPECT_EQ(request.question().order(), "mu DESC");
  EXPECT_EQ(request.question().limit(), 5U);
  EXPECT_FALSE(request_for(with([](ResultQuery&) {})).question().has_limit());
}

TEST(ResultQuery, AGroupHasItsOwnColumnsAndOrderWhereNoneAreGiven) {
  const auto grouped = request_for(with([](ResultQuery& q) { q.group = "e"; })).question();
  EXPECT_EQ(grouped.group(), "e");
  EXPECT_TRUE(grouped.select().empty());
  EXPECT_EQ(grouped.order(), "");
  const auto chosen = request_for(with([](ResultQuery& q) {
                        q.group = "e";
                        q.select = "e, avg(mu)";
                        q.order = "avg(mu)";
                      })).question();
  EXPECT_EQ(chosen.select(0), "e, avg(mu)");
  EXPECT_EQ(chosen.order(), "avg(mu)");
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
  EXPECT_THAT(objection([](ResultQuery& q) { q.group = "mu ORDER BY 1"; }), HasSubstr("--group"));
  EXPECT_THAT(objection([](ResultQuery& q) { q.limit = -1; }), HasSubstr("--limit -1"));
}

}  // namespace
}  // namespace oblique::client
