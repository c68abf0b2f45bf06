// What the page asks of a study before it starts it, and what it is told of one that failed.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/database/sqlite.h"
#include "tests/server/web/page/page_study.h"

namespace oblique::server {
namespace {

using nlohmann::json;
using testing::HasSubstr;

using PageCheckTest = PageStudyTest;

TEST_F(PageCheckTest, AStudyIsJudgedBeforeItIsSubmitted) {
  const auto check = [&](const std::string& mu, const std::string& where) {
    return page_.post("/api/check",
                      R"({"recipe":{"blocks":[{"axes":[{"key":"H","values":[1]},{"key":"mu",)" +
                          mu + R"(},{"key":"e","values":[1]}],"where":")" + where + "\"}]}}");
  };
  const json all = json::parse(body_of(check(R"("from":0,"to":1,"count":11)", "")));
  EXPECT_EQ(all["points"], 11);
  EXPECT_EQ(all["models"], 1);
  const json some = json::parse(body_of(check(R"("from":0,"to":1,"count":11)", "mu > 0.45")));
  EXPECT_EQ(some["points"], 6);
  EXPECT_EQ(some["numbers"], 11);
  const std::string wrong = check(R"("values":[-1])", "");
  EXPECT_EQ(status_of_answer(wrong), 400);
  EXPECT_THAT(wrong, HasSubstr("mu"));
  EXPECT_EQ(page_.json("/api/studies")["studies"].size(), 0U);
}

TEST_F(PageCheckTest, TheFirstPointThatFailedIsToldWithItsReason) {
  submit_grid();
  solve(24);
  EXPECT_EQ(page_.json("/api/studies/1")["first_failure"], json());
  const auto database = open_database(page_.database(), SQLITE_OPEN_READWRITE);
  sqlite3_busy_timeout(database.get(), 10'000);
  execute(database.get(),
          "UPDATE packed_results SET checksum = NULL, error = 'failed as ' || point "
          "WHERE point IN (5, 17)");
  EXPECT_EQ(page_.json("/api/studies/1")["first_failure"],
            json({{"point", 5}, {"error", "failed as 5"}}));
}

}  // namespace
}  // namespace oblique::server
