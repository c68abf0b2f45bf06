// Studies that are made because somebody looks, and go when nobody does.
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/web/page/looks.h"
#include "server/web/page/page.h"
#include "tests/server/web/page/page_server.h"

namespace oblique::server {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::StartsWith;

std::string look_at(int count, double from = 0.0) {
  return json{{"model", {{"preset", "paper"}}},
              {"recipe",
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
  while (!names().empty()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_EQ(status_of_answer(page_.get("/api/studies/" + gone["id"].dump())), 404);
}

TEST_F(PageLooksTest, WhatSomebodyGaveANameStays) {
  const json named = look(look_at(5));
  PretendedClient client(page_.server().client_endpoint());
  ClientRequest request;
  request.mutable_change()->set_study(named["name"]);
  request.mutable_change()->set_change(protocol::STUDY_CHANGE_RENAME);
  request.mutable_change()->set_new_name("kept");
  ASSERT_TRUE(client.ask(request).has_change());
  const std::size_t kept = 1;
  for (int i = 1; i <= 5; ++i) {
    look(look_at(5 + i));  // until the oldest makes room
  }
  while (names().size() > kept + Looks::kMost) {
  }
  EXPECT_EQ(names().front(), "kept");
}

TEST_F(PageLooksTest, ItIsKeptUnderANameAndGoesBehindOthers) {
  const json made = look(look_at(5));
  const std::string path = "/api/look/" + made["id"].dump() + "/keep";
  EXPECT_EQ(status_of_answer(page_.post(path, "{}")), 400);
  EXPECT_EQ(json::parse(body_of(page_.post(path, R"({"name":"kept"})")))["name"], "kept");
  const json study = page_.json("/api/studies")["studies"][0];
  EXPECT_EQ(study["name"], "kept");
  EXPECT_EQ(study["priority"], 0);
  EXPECT_EQ(json::parse(body_of(page_.post(path, R"({"name":"kept"})")))["id"], made["id"]);
  const std::string other = page_.post(path, R"({"name":"again"})");
  EXPECT_EQ(status_of_answer(other), 409);
  EXPECT_THAT(other, HasSubstr(R"(kept as \"kept\" already)"));
  EXPECT_EQ(names(), std::vector<std::string>{"kept"});
}

TEST_F(PageLooksTest, ANameThatIsTakenLeavesItToBeKeptUnderAnother) {
  const json one = look(look_at(5));
  const json two = look(look_at(6));
  const auto keep = [this](const json& which, const std::string& name) {
    return status_of_answer(
        page_.post("/api/look/" + which["id"].dump() + "/keep", json{{"name", name}}.dump()));
  };
  EXPECT_EQ(keep(one, "kept"), 200);
  EXPECT_EQ(keep(two, "kept"), 409);
  EXPECT_EQ(keep(two, "another"), 200);
  EXPECT_EQ(names(), (std::vector<std::string>{"kept", "another"}));
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

TEST_F(PageLooksTest, ModelsWhosePointsTakeMinutesAreForStudies) {
  const auto look = [this](const std::string& axis) {
    return page_.post("/api/look",
                      R"({"model":{},"recipe":{"blocks":[{"axes":[)" + axis +
                          R"({"key":"H","values":[1]},)"
                          R"({"key":"mu","values":[1]},{"key":"e","values":[1]}]}]}})");
  };
  for (const std::string key :
       {R"("elements_per_link","values":[4,86])", R"("dt","values":[1e-10])",
        R"("tolerance","values":[1e-9])", R"("dt_fall","values":[1e-9])"}) {
    const std::string refused = look(R"({"key":)" + key + "},");
    EXPECT_EQ(status_of_answer(refused), 400) << key;
    EXPECT_THAT(refused, HasSubstr("submit it as a study")) << key;
  }
  EXPECT_EQ(status_of_answer(look(R"({"key":"elements_per_link","values":[4,85]},)")), 200);
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

TEST(PageLooks, AnEarlierServersAreKeptAsTheyAre) {
  const test::TemporaryFolder folder;
  constexpr const char* kName = "look-0123456789abcdef";
  {
    const RunningServer before(folder.file("a.db"));
    PretendedClient client(before.client_endpoint());
    ClientRequest request;
    request.mutable_submit()->set_name(kName);
    request.mutable_submit()->set_priority(1000);
    *request.mutable_submit()->mutable_recipe() = table_of(5)->recipe();
    client.ask(request);
  }
  const PageServer page(page_settings(), folder.file("a.db"));
  std::string answer;
  while (status_of_answer(answer = page.post("/api/look/1/keep", R"({"name":"kept"})")) == 404) {
    // It is searched for when the server has begun.
  }
  EXPECT_EQ(status_of_answer(answer), 200) << answer;
  PretendedClient client(page.server().client_endpoint());
  EXPECT_EQ(client.status("kept").priority(), 0);
  EXPECT_EQ(client.status("kept").points(), 5U);
}

/// The page and a browser that comes and goes, with what the service says played by the test.
class PageAloneTest : public testing::Test {
 protected:
  explicit PageAloneTest(std::chrono::milliseconds looks_kept = std::chrono::milliseconds(0)) {
    PageSettings settings;
    settings.token = kTestToken;
    settings.looks_kept = looks_kept;
    page_.emplace(settings, Page::Neighbours{line_, pool_, pool_, live_});
  }
  HttpQuestion posted(std::uint64_t number, const std::string& path, const std::string& body) {
    HttpQuestion question{};
    question.number = number;
    question.method = "POST";
    question.path = path;
    question.host = "localhost:1";
    const std::string cookie = page_->key().cookie_for(question.host);
    question.cookies = {cookie.substr(0, cookie.find(';'))};
    question.body = body;
    return question;
  }
  void post(std::uint64_t number, const std::string& path, const std::string& body) {
    EXPECT_FALSE(page_->answer(posted(number, path, body)));
  }
  /// What the page has asked since the last time, under that number.
  std::vector<ClientRequest> asked(std::uint64_t number) {
    std::vector<ClientRequest> all;
    for (auto frames = line_.take(); !frames.empty(); frames = line_.take()) {
      for (const std::string& frame : frames) {
        ClientRequest request;
        EXPECT_TRUE(protocol::decode(frame, request));
        if (number == 0 || request.request_id() == number) {
          all.push_back(request);
        }
      }
    }
    return all;
  }
  void say(std::uint64_t number, ClientReply reply) {
    reply.set_request_id(number);
    line_.put(protocol::encode(reply));
  }
  void is_submitted(std::uint64_t number) {
    ClientReply reply;
    reply.mutable_submit()->set_study_id(7);
    say(number, reply);
  }

  ServiceLine line_;
  AnswerPool pool_{line_, [] {}};
  LiveText live_{[] { return std::nullopt; }, 0};
  std::optional<Page> page_;
};

TEST_F(PageAloneTest, ALookGoesThoughItsBrowserWentBeforeItWasThere) {
  post(1, "/api/look", look_at(5));
  page_->gone(1);
  EXPECT_TRUE(page_->tick());
  is_submitted(1);
  EXPECT_TRUE(page_->tick());
  const auto requests = asked(0);
  const auto& last = requests.back().change();
  EXPECT_EQ(last.change(), protocol::STUDY_CHANGE_DELETE);
  EXPECT_EQ(last.study(), requests.front().submit().name());
}

class PageAloneForLongTest : public PageAloneTest {
 protected:
  PageAloneForLongTest() : PageAloneTest(std::chrono::hours(1)) {}
};

TEST_F(PageAloneForLongTest, WhatIsKeptIsKeptThoughTheBrowserGoesMeanwhile) {
  post(1, "/api/look", look_at(5));
  page_->gone(1);
  is_submitted(1);
  page_->tick();
  post(2, "/api/look/7/keep", R"({"name":"kept"})");
  EXPECT_EQ(asked(2).back().change().new_name(), "kept");
  page_->gone(2);
  ClientReply renamed;
  renamed.mutable_change();
  say(2, renamed);
  page_->tick();
  const auto next = asked(2);
  ASSERT_EQ(next.size(), 1U);
  EXPECT_EQ(next[0].submit().name(), "kept");
  EXPECT_EQ(next[0].submit().priority(), 0);
  EXPECT_EQ(next[0].submit().recipe().blocks_size(), 1);
}

TEST_F(PageAloneForLongTest, TwoThatKeepItAtOnceMakeNoSecondStudy) {
  post(1, "/api/look", look_at(5));
  is_submitted(1);
  page_->gone(1);
  page_->tick();
  post(2, "/api/look/7/keep", R"({"name":"kept"})");
  const HttpQuestion other = posted(3, "/api/look/7/keep", R"({"name":"other"})");
  const auto refused = page_->answer(other);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 409U);
  post(4, "/api/look/7/keep", R"({"name":"kept"})");
  EXPECT_TRUE(asked(3).empty());
}

}  // namespace
}  // namespace oblique::server
