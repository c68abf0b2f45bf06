#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/service/source.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

TEST(ResultQuery, IsARequestOfTheSameParts) {
  const auto plain = request_for({.study = "a"}).question();
  EXPECT_FALSE(plain.has_limit());
  EXPECT_TRUE(plain.select().empty());
  const auto full = request_for({"a", "mu > 1 OR 1", "e, avg(mu)", "e", "avg(mu)", 5}).question();
  EXPECT_EQ(full.study(), "a");
  EXPECT_EQ(full.where(), "mu > 1 OR 1");
  EXPECT_EQ(full.select(0), "e, avg(mu)");
  EXPECT_EQ(full.group(), "e");
  EXPECT_EQ(full.order(), "avg(mu)");
  EXPECT_EQ(full.limit(), 5U);
}

TEST(ResultQuery, EachFlagIsCheckedAndNamed) {
  const auto refusal = [](const ResultQuery& query) -> std::string {
    try {
      check(query);
    } catch (const solver::InputError& error) {
      return error.what();
    }
    return {};
  };
  using testing::HasSubstr;
  EXPECT_EQ(refusal({.study = "a"}), "");
  EXPECT_THAT(refusal({.where = "mu > 0.5 --"}), HasSubstr("--where"));
  EXPECT_THAT(refusal({.select = "mu FROM runs --"}), HasSubstr("--select"));
  EXPECT_THAT(refusal({.order = "mu LIMIT 1"}), HasSubstr("--order"));
  EXPECT_THAT(refusal({.group = "mu ORDER BY 1"}), HasSubstr("--group"));
  EXPECT_THAT(refusal({.limit = -1}), HasSubstr("--limit -1"));
}

}  // namespace
}  // namespace oblique::client
