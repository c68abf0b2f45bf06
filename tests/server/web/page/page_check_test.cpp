// What the page asks of a study before it starts it.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/web/page/page_study.h"

namespace oblique::server {
namespace {

using nlohmann::json;
using testing::HasSubstr;

using PageCheckTest = PageStudyTest;

TEST_F(PageCheckTest, AStudyIsJudgedBeforeItIsSubmitted) {
  const auto check = [&](const std::string& mu, const std::string& where) {
    return page_.post("/api/check",
                      R"({"model":{},"recipe":{"blocks":[{"axes":[{"key":"H","values":[1]},)"
                      R"({"key":"mu",)" +
                          mu + R"(},{"key":"e","values":[1]}],"where":")" + where + "\"}]}}");
  };
  const json all = json::parse(body_of(check(R"("from":0,"to":1,"count":11)", "")));
  EXPECT_EQ(all["points"], 11);
  EXPECT_EQ(all["models"], 1);
  EXPECT_EQ(all["falls"], 1);
  EXPECT_EQ(all["falls_estimated"], false);
  EXPECT_EQ(all["bytes"], 11 * 970 + 600) << "as of oblique study check";
  const json some = json::parse(body_of(check(R"("from":0,"to":1,"count":11)", "mu > 0.45")));
  EXPECT_EQ(some["points"], 6);
  const std::string wrong = check(R"("values":[-1])", "");
  EXPECT_EQ(status_of_answer(wrong), 400);
  EXPECT_THAT(wrong, HasSubstr("mu"));
  EXPECT_EQ(page_.json("/api/studies")["studies"].size(), 0U);
}

/// A study of these H, as the body of a check.
std::string body_with(const std::string& H, const std::string& others = "",
                      const std::string& model = "{}") {
  return R"({"model":)" + model + R"(,"recipe":{"blocks":[{"axes":[)" + others + R"({"key":"H",)" +
         H + R"(},{"key":"mu","values":[1]},{"key":"e","values":[1]}]}]}})";
}

TEST_F(PageCheckTest, AStudyWithoutAModelIsRefused) {
  std::string body = body_with(R"("values":[1])");
  body.replace(1, body.find("\"recipe\"") - 1, R"("name":"a",)");
  for (const char* path : {"/api/check", "/api/studies"}) {
    const std::string refused = page_.post(path, body);
    EXPECT_NE(status_of_answer(refused), 200) << path;
    EXPECT_THAT(refused, HasSubstr("the recipe has no model")) << path;
  }
}

TEST_F(PageCheckTest, ADropBeyondTheLengthOfTheFingerIsRefusedWithKeyValueAndRange) {
  for (const std::string H : {R"("values":[1.0,1.25])", R"("from":0.1,"to":1.25,"count":9)"}) {
    const std::string refused = page_.post("/api/check", body_with(H));
    EXPECT_EQ(status_of_answer(refused), 400) << H;
    EXPECT_THAT(refused, HasSubstr("H = 1.25 m is not allowed: the tip drops at most the length of "
                                   "the chain, 1.2 m"));
  }
}

TEST_F(PageCheckTest, WhatOnlyAFallTellsOfADropIsSaid) {
  const auto reached_m = [&](const std::string& body) {
    return json::parse(body_of(page_.post("/api/check", body)))["surely_reached_m"];
  };
  EXPECT_EQ(reached_m(body_with(R"("from":0.1,"to":1.08,"count":9)")), json());
  EXPECT_DOUBLE_EQ(reached_m(body_with(R"("from":0.1,"to":1.19,"count":9)")), 1.08);
  const std::string links = R"({"key":"links","values":[2,3]},)";
  EXPECT_DOUBLE_EQ(reached_m(body_with(R"("values":[0.75])", links)), 0.72)
      << "of the shortest finger";
  EXPECT_DOUBLE_EQ(reached_m(body_with(R"("expression":"0.5 + 0.1 * e")")), 1.08);
}

TEST_F(PageCheckTest, AtMostEightyCharactersOfAWrongKeyAreRepeated) {
  const std::string key(10'000, 'k');
  for (const std::string& body :
       {"{\"" + key + "\":1}", "{\"recipe\":{},\"model\":{\"" + key + "\":1}}",
        body_with(R"("values":[1])", R"({"key":")" + key + R"(","values":[1]},)")}) {
    const std::string refused = page_.post("/api/check", body);
    EXPECT_EQ(status_of_answer(refused), 400);
    EXPECT_THAT(refused, HasSubstr(key.substr(0, 20)));
    EXPECT_EQ(refused.find(key.substr(0, 81)), std::string::npos) << refused;
  }
}

}  // namespace
}  // namespace oblique::server
