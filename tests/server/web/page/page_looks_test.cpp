// Studies that are made because somebody looks, and go when nobody does.
#include <chrono>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/web/page/looks.h"
#include "tests/server/web/page/page_server.h"

namespace oblique::server {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::StartsWith;

std::string look_at(int count, double from = 0.0) {
  return json{{"recipe",
               {{"blocks",
                 {{{"axes",
                    {{{"key", "H"}, {"values", {1}}},
                     {{"key", "mu"}, {"from", from}, {"to", 2}, {"count", count}},
                     {{"key", "e"}, {"values", {1}}}}}}}}}}}
      .dump();
}

class PageLooksTest : public testing::Test {
 protected:
  explicit PageLooksTest(const WebSettings& settings = page_settings()) : page_(settings) {}
  json look(const std::string& body) { return json::parse(body_of(page_.post("/api/look", body))); }
  std::vector<std::string> names() {
    std::vector<std::string> names;
    const json all = page_.json("/api/studies");
    for (const json& study : all["studies"]) {
      names.push_back(study["name"]);
    }
    return names;
  }

  PageServer page_;
};

TEST_F(PageLooksTest, WhatIsLookedAtComesBeforeAllElseAndIsOneStudy) {
  const json first = look(look_at(9));
  EXPECT_EQ(first["points"], 9);
  EXPECT_THAT(first["name"].get<std::string>(), StartsWith("look-"));
  EXPECT_EQ(look(look_at(9))["id"], first["id"]);
  EXPECT_NE(look(look_at(5))["id"], first["id"]);
  EXPECT_EQ(page_.json("/api/studies")["studies"][0]["priority"], 1000);
  PretendedWorker worker(page_.server().worker_endpoint());
  worker.hello();
  worker.work(14);
  const std::string path = "/api/studies/" + first["id"].dump() + "/slice?z=fn_peak_N&x=mu";
  while (page_.numbers(path).head["missing"] != 0) {
    // What was stored is seen soon after.
  }
}

TEST_F(PageLooksTest, TheOneThatWasSeenLongestAgoMakesRoom) {
  std::vector<std::string> made;
  for (int i = 0; i < 5; ++i) {
    made.push_back(look(look_at(5 + i))["name"]);
  }
  while (names().size() > Looks::kMost) {
  }
  EXPECT_EQ(names(), (std::vector<std::string>(made.begin() + 1, made.end())));
}

WebSettings impatient() {
  WebSettings settings = page_settings();
  settings.page.looks_kept = std::chrono::milliseconds(600);
  return settings;
}

class PageShortLooksTest : public PageLooksTest {
 protected:
  PageShortLooksTest() : PageLooksTest(impatient()) {}
};

TEST_F(PageShortLooksTest, ItGoesWhenNobodyLooks) {
  const json gone = look(look_at(5));
  const json seen = look(look_at(6));
  const std::string path = "/api/studies/" + seen["id"].dump();
  while (names().size() > 1) {
    EXPECT_EQ(status_of_answer(page_.get(path)), 200);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_EQ(names().front(), seen["name"]);
  EXPECT_EQ(status_of_answer(page_.get("/api/studies/" + gone["id"].dump())), 404);
}

TEST_F(PageLooksTest, ItIsKeptUnderANameAndGoesBehindOthers) {
  const json made = look(look_at(5));
  const std::string path = "/api/look/" + made["id"].dump() + "/keep";
  EXPECT_EQ(status_of_answer(page_.post(path, "{}")), 400);
  EXPECT_EQ(json::parse(body_of(page_.post(path, R"({"name":"kept"})")))["name"], "kept");
  const json study = page_.json("/api/studies")["studies"][0];
  EXPECT_EQ(study["name"], "kept");
  EXPECT_EQ(study["priority"], 0);
  EXPECT_EQ(status_of_answer(page_.post(path, R"({"name":"again"})")), 404);
}

TEST_F(PageLooksTest, WhatIsTooLargeOrNoRecipeIsRefused) {
  const std::string large = page_.post("/api/look", look_at(20'000));
  EXPECT_EQ(status_of_answer(large), 400);
  EXPECT_THAT(large, HasSubstr("20000 points; 16641 are looked at"));
  for (const std::string body : {"", "{}", "{\"recipe\":{}}", "[1]"}) {
    EXPECT_EQ(status_of_answer(page_.post("/api/look", body)), 400) << body;
  }
  EXPECT_EQ(status_of_answer(page_.post("/api/look", look_at(5, -1.0))), 400);
  EXPECT_EQ(status_of_answer(page_.get("/api/look")), 404);
}

TEST(PageLooks, AnEarlierServersAreFound) {
  const test::TemporaryFolder folder;
  const auto named = [](const std::string& name, std::int32_t priority) {
    ClientRequest request;
    request.mutable_submit()->set_name(name);
    request.mutable_submit()->set_priority(priority);
    *request.mutable_submit()->mutable_recipe() = table_of(5)->recipe();
    return request;
  };
  {
    const RunningServer before(folder.file("a.db"));
    PretendedClient client(before.client_endpoint());
    client.ask(named("look-0123456789abcdef", 1000));
    client.ask(named("look-0123456789abcdee", 0));
    client.ask(named("look-at-this", 1000));
  }
  const RunningServer server(folder.file("a.db"), {}, {}, {}, {}, impatient());
  PretendedClient client(server.client_endpoint());
  ClientRequest request;
  request.mutable_status();
  while (client.ask(request).status().studies_size() > 2) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_EQ(client.status("look-at-this").points(), 5U);
}

}  // namespace
}  // namespace oblique::server
