// What the page asks a whole server with a pretended worker.
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/database/sqlite.h"
#include "tests/server/web/page/page_study.h"

namespace oblique::server {
namespace {

using nlohmann::json;
using testing::HasSubstr;

using PageAnswersTest = PageStudyTest;

TEST_F(PageAnswersTest, TheOverviewIsToldOnceAndThenWhatChanges) {
  RawHttp tab(page_.url());
  tab.send("GET /api/events HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(status_of_answer(tab.read_to_the_end()), 401);
  RawHttp other(page_.url());
  other.send("GET /api/events HTTP/1.1\r\nHost: " + page_.host() + "\r\n" + page_.cookie_header() +
             "\r\n");
  const std::string first = other.read_until("\r\n\r\n");
  EXPECT_THAT(first, HasSubstr("Content-Type: text/event-stream"));
  const std::string empty = other.read_until("}\n\n");
  EXPECT_THAT(empty, HasSubstr("event: overview\ndata: {\"studies\":[]"));
  submit_grid();
  const std::string event = other.read_until("}\n\n");
  const json now = json::parse(event.substr(event.find("data: ") + 6));
  ASSERT_EQ(now["studies"].size(), 1U);
  EXPECT_EQ(now["studies"][0]["name"], "grid");
  EXPECT_EQ(now["studies"][0]["points"], 24);
  EXPECT_EQ(now["studies"][0]["waits_for"], "a worker");
  EXPECT_EQ(now["studies"][0]["left_s"], nullptr);
  EXPECT_EQ(now["studies_by_state"]["running"], 1);
}

TEST_F(PageAnswersTest, ManyTabsAreToldAndMoreAreRefused) {
  std::vector<std::unique_ptr<RawHttp>> tabs;
  for (int i = 0; i < 32; ++i) {
    tabs.push_back(std::make_unique<RawHttp>(page_.url()));
    tabs.back()->send("GET /api/events HTTP/1.1\r\nHost: " + page_.host() + "\r\n" +
                      page_.cookie_header() + "\r\n");
    EXPECT_THAT(tabs.back()->read_until("}\n\n"), HasSubstr("data: {")) << i;
  }
  EXPECT_EQ(status_of_answer(page_.get("/api/events")), 503);
  EXPECT_EQ(status_of_answer(page_.get("/api/studies")), 200);  // a tab takes no room from requests
}

TEST_F(PageAnswersTest, StudiesAndWorkersAreListed) {
  submit_grid();
  EXPECT_EQ(page_.json("/api/studies")["studies"][0]["name"], "grid");
  EXPECT_EQ(page_.json("/api/studies?after=1")["studies"].size(), 0U);
  EXPECT_EQ(page_.json("/api/workers")["workers"].size(), 0U);
  EXPECT_EQ(status_of_answer(page_.get("/api/studies?limit=x")), 400);
}

TEST_F(PageAnswersTest, AStudyIsItsRecipeAndColumns) {
  submit_grid();
  const json study = page_.json("/api/studies/1");
  EXPECT_EQ(study["name"], "grid");
  EXPECT_EQ(study["points"], 24);
  std::map<std::string, json> model;
  for (const json& key : study["model"]) {
    model[key["key"]] = key;
  }
  EXPECT_EQ(model.at("E")["value"], 70e9);
  EXPECT_EQ(model.at("E")["unit"], "Pa");
  EXPECT_EQ(model.at("lengths")["value"], json({0.4, 0.4, 0.4}));
  EXPECT_EQ(model.at("integrator")["value"], "explicit");
  const json& block = study["blocks"][0];
  EXPECT_EQ(block["kind"], "grid");
  EXPECT_EQ(block["axes"][0]["list"], json({1.0, 0.9, 0.8}));
  EXPECT_EQ(block["axes"][1]["range"],
            json({{"from", 0.0}, {"to", 0.6}, {"count", 4}, {"spacing", "linear"}}));
  EXPECT_EQ(block["axes"][1]["stride"], 2);
  for (const json& column : study["columns"]) {
    if (column["name"] == "fn_peak_N") {
      EXPECT_EQ(column["unit"], "N");
      EXPECT_EQ(column["picture"], "numbers");
    }
    if (column["name"] == "mode") {
      EXPECT_EQ(column["picture"], "categories");
    }
  }
  for (const std::string path : {"/api/studies/2", "/api/studies/0", "/api/studies/99999999999999",
                                 "/api/studies/1/", "/api/studies/1/x", "/api/studies/1/points/"}) {
    const int status = status_of_answer(page_.get(path));
    EXPECT_TRUE(status == 404 || path == "/api/studies/1/") << path << ' ' << status;
  }
}

TEST_F(PageAnswersTest, AStudyThatDoesNotExistIsNotFound) {
  submit_grid();
  for (const std::string path : {"0", "2", "2/slice?z=mode&x=mu", "2/bins?x=mu", "2/points/0",
                                 "2/rows", "2/points/0/trace"}) {
    const std::string answer = page_.get("/api/studies/" + path);
    EXPECT_EQ(status_of_answer(answer), 404) << path;
  }
  const std::string sentence = "there is no such study";
  for (const std::string path : {"2", "2/rows", "2/points/0/trace"}) {
    EXPECT_THAT(page_.get("/api/studies/" + path), HasSubstr(sentence)) << path;
  }
  const std::string unchanged = page_.post("/api/studies/2/pause");
  EXPECT_EQ(status_of_answer(unchanged), 404);
  EXPECT_THAT(unchanged, HasSubstr(sentence));
}

TEST_F(PageAnswersTest, ASliceIsIndexArithmeticOnTheRecipe) {
  submit_grid();
  solve(24);
  const Numbers slice = page_.numbers("/api/studies/1/slice?z=fn_peak_N&x=mu&y=H&at=e@1");
  EXPECT_EQ(slice.head["nx"], 4);
  EXPECT_EQ(slice.head["ny"], 3);
  EXPECT_EQ(slice.head["at"][0]["value"], 0.5);
  EXPECT_EQ(slice.head["solved"], 12);
  EXPECT_EQ(slice.read<double>(0, 4)[3], 0.6);
  EXPECT_EQ(slice.read<double>(32, 3), (std::vector<double>{1.0, 0.9, 0.8}));
  const auto values = slice.read<float>(56, 12);
  for (std::uint64_t row = 0; row < 3; ++row) {
    for (std::uint64_t column = 0; column < 4; ++column) {
      EXPECT_EQ(values[row * 4 + column], force_of(row * 8 + column * 2 + 1)) << row << column;
    }
  }
  // The other way round it is the same, transposed.
  const Numbers turned = page_.numbers("/api/studies/1/slice?z=fn_peak_N&x=H&y=mu&at=e@1");
  EXPECT_EQ(turned.read<float>(56, 12)[1], values[4]);
}

TEST_F(PageAnswersTest, ALineHasOneRow) {
  submit_grid();
  solve(24);
  const Numbers line = page_.numbers("/api/studies/1/slice?z=fn_peak_N&x=mu&at=H@2,e@0");
  EXPECT_EQ(line.head["ny"], 1);
  EXPECT_EQ(line.head["y"], nullptr);
  EXPECT_EQ(line.read<float>(32, 4)[3], force_of(16 + 6));
}

TEST_F(PageAnswersTest, MorePixelsThanAskedForAreNeverGiven) {
  submit_grid();
  solve(24);
  const Numbers slice =
      page_.numbers("/api/studies/1/slice?z=fn_peak_N&x=mu&y=H&nx=2&ny=2&x0=1&at=e@0");
  EXPECT_EQ(slice.head["x"]["all_lines"], false);
  EXPECT_EQ(slice.head["x"]["first"], 1);
  const auto values = slice.read<float>(32, 4);
  EXPECT_EQ(values, (std::vector<float>{force_of(2), force_of(6), force_of(18), force_of(22)}));
}

TEST_F(PageAnswersTest, WhatIsNotSolvedAndWhatIsLeftOutIsMarked) {
  protocol::Recipe recipe =
      protocol::recipe_of({{protocol::listed("H", {1.0}), protocol::range("mu", 0.0, 0.9, 10),
                            protocol::listed("e", {1.0})}});
  recipe.mutable_blocks(0)->set_where("mu < 0.55");
  submit("filtered", recipe);
  const Numbers slice = page_.numbers("/api/studies/1/slice?z=mode&x=mu");
  EXPECT_EQ(slice.head["missing"], 6);
  EXPECT_EQ(slice.head["left_out"], 4);
  const auto codes = slice.read<std::uint16_t>(80, 10);
  EXPECT_EQ(codes[0], 0xffff);
  EXPECT_EQ(codes[9], 0xfffd);
  const Numbers numbers = page_.numbers("/api/studies/1/slice?z=slide_m&x=mu");
  EXPECT_EQ(numbers.read<std::uint32_t>(80, 10)[0], 0x7fc00000U);
  EXPECT_EQ(numbers.read<std::uint32_t>(80, 10)[9], 0x7fc00002U);
}

TEST_F(PageAnswersTest, WhatAStudyThatIsDoneHasNoRowOfWasLeftOutByItsWorker) {
  protocol::Recipe recipe = grid_recipe();
  recipe.mutable_blocks(0)->set_where("mu < 0.5");
  submit("filtered", recipe);
  solve(24);
  const auto edited = open_database(page_.database(), SQLITE_OPEN_READWRITE);
  sqlite3_busy_timeout(edited.get(), 10'000);
  const std::string slice = "/api/studies/1/slice?z=mode&x=mu&y=H&at=e@0";
  EXPECT_EQ(page_.numbers(slice).head["left_out"], 3);
  execute(edited.get(), "DELETE FROM results WHERE point = 4");  // as if its machine left it out
  EXPECT_EQ(page_.numbers(slice).head["left_out"], 4);
  EXPECT_EQ(page_.numbers(slice).head["missing"], 0);
  EXPECT_EQ(page_.json("/api/studies/1/points/4")["left_out"], true);
}

TEST_F(PageAnswersTest, AStudyOfABillionPointsIsLookedAtLikeASmallOne) {
  submit("huge", protocol::recipe_of(
                     {{protocol::range("H", 0.1, 1.0, 1000), protocol::range("mu", 0.0, 2.0, 1000),
                       protocol::range("e", 0.5, 1.0, 1000)}}));
  const Numbers slice =
      page_.numbers("/api/studies/1/slice?z=mode&x=mu&y=H&nx=256&ny=256&at=e@999");
  EXPECT_EQ(slice.head["nx"], 256);
  EXPECT_EQ(slice.head["missing"], 256 * 256);
  EXPECT_EQ(page_.numbers("/api/studies/1/bins?x=fn_peak_N").head["points"], 0);
}

TEST_F(PageAnswersTest, SolvedPointsAreFoundAmongManyThatAreNot) {
  submit("wide", protocol::recipe_of(
                     {{protocol::range("H", 0.1, 1.0, 40), protocol::range("mu", 0.0, 2.0, 40),
                       protocol::range("e", 0.5, 1.0, 40)}}));
  solve(200);
  std::set<std::uint64_t> solved;  // whole batches
  const json stored = page_.json("/api/studies/1/rows?select=point&limit=64000");
  for (const json& row : stored["rows"]) {
    solved.insert(row[0].get<std::uint64_t>());
  }
  EXPECT_GE(solved.size(), 200U);
  EXPECT_LT(solved.size(), 60'000U);
  for (const std::string view : {"x=e&y=mu&at=H@0", "x=mu&y=e&at=H@0", "x=e&y=mu&at=H@1",
                                 "x=mu&y=H&at=e@7", "x=e&at=mu@4,H@0", "x=e&at=mu@5,H@0"}) {
    const Numbers slice = page_.numbers("/api/studies/1/slice?z=fn_peak_N&" + view);
    const auto nx = slice.head["nx"].get<std::size_t>();
    const auto ny = slice.head["ny"].get<std::size_t>();
    const bool is_line = slice.head["y"].is_null();
    const auto values = slice.read<float>(8 * (nx + (is_line ? 0 : ny)), nx * ny);
    const auto first = slice.head["first_point"].get<std::uint64_t>();
    const auto x = slice.head["x"]["stride"].get<std::uint64_t>();
    const auto y = is_line ? 0 : slice.head["y"]["stride"].get<std::uint64_t>();
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::uint64_t point = first + i % nx * x + i / nx * y;
      EXPECT_EQ(std::isfinite(values[i]), solved.contains(point)) << view << ' ' << point;
      EXPECT_TRUE(!solved.contains(point) || values[i] == force_of(point)) << view << ' ' << point;
    }
  }
}

TEST_F(PageAnswersTest, ModesAreCodesWithADictionary) {
  submit_grid();
  solve(24);
  const Numbers slice = page_.numbers("/api/studies/1/slice?z=mode&x=mu&y=H");
  EXPECT_EQ(slice.head["dictionary"], json::parse(R"([{"text":"SC SR sR","cells":12}])"));
  EXPECT_EQ(slice.read<std::uint16_t>(56, 12), std::vector<std::uint16_t>(12, 0));
}

TEST_F(PageAnswersTest, WrongQuestionsAreToldWhatIsAllowed) {
  submit_grid();
  for (const std::string query :
       {"z=muu&x=mu", "z=peaks&x=mu", "z=mode", "z=mode&x=mu&y=mu", "z=mode&x=k",
        "z=mode&x=mu&nx=0", "z=mode&x=mu&nx=257", "z=mode&x=mu&x0=4", "z=mode&x=mu&at=e",
        "z=mode&x=mu&at=q@1", "z=mode&x=mu&at=e@2", "z=mode&x=mu&at=e@x", "z=mode&x=mu&block=1",
        "z=mode&x=mu&at=,"}) {
    const std::string answer = page_.get("/api/studies/1/slice?" + query);
    EXPECT_EQ(status_of_answer(answer), 400) << query;
    EXPECT_TRUE(json::parse(body_of(answer)).contains("error")) << query;
  }
}

TEST_F(PageAnswersTest, RowsAreAskedForAsOnTheCommandLine) {
  submit_grid();
  solve(24);
  const json rows = page_.json(
      "/api/studies/1/rows?select=point,fn_peak_N&where=mu%20%3C%200.1&order=point%20DESC&limit=2");
  EXPECT_EQ(rows["columns"], json({"point", "fn_peak_N"}));
  EXPECT_EQ(rows["units"], json({"", "N"}));
  ASSERT_EQ(rows["rows"].size(), 2U);
  EXPECT_EQ(rows["rows"][0][0], 17);
  const std::string csv = page_.get("/api/studies/1/rows?select=point,mode&limit=1&format=csv");
  EXPECT_EQ(body_of(csv), "point,mode\r\n0,SC SR sR\r\n");
  const std::string wrong = page_.get("/api/studies/1/rows?where=muu%20%3E%201");
  EXPECT_EQ(status_of_answer(wrong), 400);
  EXPECT_THAT(wrong, HasSubstr("did you mean `mu`?"));
  EXPECT_EQ(status_of_answer(page_.get("/api/studies/9/rows")), 404);
  EXPECT_EQ(status_of_answer(page_.get("/api/studies/1/rows?where=1%3B%20DROP%20TABLE%20studies")),
            400);
}

TEST_F(PageAnswersTest, APointHasTheInputsOfItsRecipe) {
  protocol::Recipe recipe = grid_recipe();
  recipe.mutable_blocks(0)->set_where("mu < 0.5");
  submit("filtered", recipe);
  const json point = page_.json("/api/studies/1/points/7");
  EXPECT_EQ(point["left_out"], true);
  EXPECT_EQ(point["mu"], 0.6);
  EXPECT_EQ(point["fault"], "");
  EXPECT_EQ(page_.json("/api/studies/1/points/3")["left_out"], false);
  EXPECT_EQ(status_of_answer(page_.get("/api/studies/1/points/24")), 404);
  const std::string trace = page_.get("/api/studies/1/points/3/trace");
  EXPECT_EQ(status_of_answer(trace), 409);
  EXPECT_THAT(trace, HasSubstr("no worker is connected"));
}

TEST_F(PageAnswersTest, AStudyIsStartedAndChangedFromThePage) {
  const std::string made = page_.post(
      "/api/studies",
      R"({"name":"made","model":{},"recipe":{"blocks":[{"axes":[{"key":"H","values":[1]},)"
      R"({"key":"mu","from":0,"to":1,"count":5},{"key":"e","values":[1]}]}]}})");
  EXPECT_EQ(json::parse(body_of(made))["points"], 5);
  const auto state = [&] { return page_.json("/api/studies")["studies"][0]["state"]; };
  EXPECT_EQ(status_of_answer(page_.post("/api/studies/1/pause")), 200);
  EXPECT_EQ(state(), "paused");
  EXPECT_EQ(json::parse(body_of(page_.post("/api/studies/1/resume")))["study"]["state"], "running");
  EXPECT_EQ(status_of_answer(page_.post("/api/studies/1/cancel")), 200);
  EXPECT_EQ(state(), "cancelled");
  EXPECT_EQ(status_of_answer(page_.post("/api/studies/1/retry")), 200);
  EXPECT_EQ(status_of_answer(page_.post("/api/studies/2/pause")), 404);
  for (const std::string body : {"", "{", "[]", "{\"nome\":1}", "\xff\xfe", "{\"name\":\"x\"}"}) {
    const int status = status_of_answer(page_.post("/api/studies", body));
    EXPECT_TRUE(status == 400 || status == 409) << body << ' ' << status;
  }
}

TEST_F(PageAnswersTest, TheModelOfAStudyIsSaidByPresetIntegratorAndKeys) {
  const auto body = [](const std::string& model) {
    return R"({"name":"made","model":)" + model +
           R"(,"recipe":{"errors":true,"blocks":[{"axes":[{"key":"H","values":[1]},)"
           R"({"key":"mu","values":[1]},{"key":"e","values":[1]}]}]}})";
  };
  const std::vector<std::string> wrong_ones{R"({"preset":"best"})",
                                            R"({"integrator":"verlet"})",
                                            R"({"kk":1})",
                                            R"({"k":-1})",
                                            R"({"k":"1"})",
                                            "7",
                                            std::string(100'000, '[')};
  for (const std::string& wrong : wrong_ones) {
    EXPECT_EQ(status_of_answer(page_.post("/api/check", body(wrong))), 400) << wrong;
    EXPECT_EQ(status_of_answer(page_.post("/api/studies", body(wrong))), 400) << wrong;
  }
  EXPECT_THAT(page_.post("/api/check", body(R"({"preset":"best"})")), HasSubstr("converged"));
  page_.post("/api/studies",
             body(R"({"preset":"converged","integrator":"generalized-alpha","k":2.5e7})"));
  const json study = page_.json("/api/studies/1");
  EXPECT_EQ(study["errors"], true);
  std::map<std::string, json> model;
  for (const auto& one : study["model"]) {
    model[one["key"]] = one["value"];
  }
  EXPECT_EQ(model["elements_per_link"], 48);
  EXPECT_EQ(model["integrator"], "generalized-alpha");
  EXPECT_EQ(model["k"], 2.5e7);
}

TEST_F(PageAnswersTest, ManyWhoGoBeforeTheirAnswerHarmNobody) {
  submit_grid();
  solve(24);
  for (int i = 0; i < 60; ++i) {
    RawHttp gone(page_.url());
    gone.send(std::string("GET /api/studies/1/") +
              (i % 3 == 0   ? "slice?z=mode&x=mu"
               : i % 3 == 1 ? "slice?z=mode&x=mu&where=mu%20%3C%200.1"
                            : "points/1/trace") +
              " HTTP/1.1\r\nHost: " + page_.host() + "\r\n" + page_.cookie_header() + "\r\n");
  }
  EXPECT_EQ(page_.json("/api/studies/1/rows?limit=5")["rows"].size(), 5U);
}

}  // namespace
}  // namespace oblique::server
