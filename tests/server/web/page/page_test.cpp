// Tests of access to the page, and of its requests except for pictures, with a whole server.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/web/page/page.h"
#include "tests/server/web/page/page_server.h"

namespace oblique::server {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(PageAccess, ATokenIsExchangedForACookieAndRemovedFromTheAddress) {
  const PageServer page;
  const std::string answer = page.request("GET", std::string("/?token=") + kTestToken, "");
  EXPECT_EQ(status_of_answer(answer), 303);
  EXPECT_THAT(answer, HasSubstr("Location: ./\r\n"));
  EXPECT_THAT(answer, HasSubstr("; HttpOnly; SameSite=Strict\r\n"));
  EXPECT_THAT(answer, Not(HasSubstr("Path="))) << "a proxy may add a prefix to the path";
  EXPECT_THAT(answer, Not(HasSubstr(kTestToken)));
  EXPECT_EQ(page.json("/api/session")["may_change"], true);
  for (const std::string token :
       {"", "0", "0123456789abcdef0123456789abcdeg", "0123456789abcdef0123456789abcdef0", "%01"}) {
    const std::string refused = page.request("GET", "/?token=" + token, "");
    EXPECT_EQ(status_of_answer(refused), 403) << token;
    EXPECT_THAT(refused, Not(HasSubstr("Set-Cookie"))) << token;
  }
}

TEST(PageAccess, OnlyAViewOfAFileShowsTheFileNameAndOnlyWithAccess) {
  EXPECT_EQ(PageServer().json("/api/session")["file"], "");
  WebSettings web = page_settings();
  web.page.is_of_file = true;
  const PageServer page(web);
  EXPECT_EQ(page.json("/api/session")["file"], page.database());
  EXPECT_EQ(nlohmann::json::parse(body_of(page.request("GET", "/api/session", "")))["file"], "");
}

TEST(PageAccess, WithoutTheCookieNothingIsReadable) {
  const PageServer page;
  const std::string right = page.cookie_header();
  for (const std::string path :
       {"/api/events", "/api/studies", "/api/workers", "/api/studies/1", "/api/studies/1/rows",
        "/api/studies/1/slice?z=fn_peak_N&x=mu", "/api/studies/1/bins?x=mu&where=1",
        "/api/studies/1/points/0", "/api/studies/1/points/0/trace", "/api/anything"}) {
    for (const std::string& cookies :
         {std::string(), std::string("Cookie: oblique-1=1\r\n"),
          right.substr(0, right.size() - 3) + "\r\n",
          "Cookie: oblique-1" + right.substr(right.find('=')),
          "Cookie: x" + right.substr(std::string("Cookie: ").size())}) {
      const std::string answer = page.request("GET", path, cookies);
      EXPECT_EQ(status_of_answer(answer), 401) << path << ' ' << cookies;
      EXPECT_THAT(answer, HasSubstr("token")) << path;
    }
  }
  EXPECT_EQ(nlohmann::json::parse(body_of(page.request("GET", "/api/session", "")))["may_look"],
            false);
  const std::string pair = right.substr(std::string("Cookie: ").size(), right.size() - 10);
  for (const std::string& cookies : {"Cookie: a=b; " + pair, "Cookie: " + pair + "; a=b",
                                     "Cookie: a;;  " + pair + ";", "cookie: a=b;" + pair}) {
    EXPECT_EQ(status_of_answer(page.request("GET", "/api/studies", cookies + "\r\n")), 200)
        << cookies;
  }
}

TEST(PageAccess, ReadingMayBeAllowedWithoutTheToken) {
  const PageServer page(page_settings(true));
  const auto session = nlohmann::json::parse(body_of(page.request("GET", "/api/session", "")));
  EXPECT_EQ(session["may_look"], true);
  EXPECT_EQ(session["may_change"], false);
  EXPECT_EQ(status_of_answer(page.request("GET", "/api/studies", "")), 200);
  EXPECT_EQ(status_of_answer(page.request("POST", "/api/studies/1/pause",
                                          "Origin: " + page.url() + "\r\nContent-Length: 0\r\n")),
            401);
}

TEST(PageAccess, WrongRequestsAreRefused) {
  const PageServer page;
  const std::string origin = page.cookie_header() + "Origin: " + page.url() + "\r\n";
  const std::string own = origin + "Content-Length: 0\r\n";
  struct Row {
    std::string method;
    std::string path;
    std::string headers;
    int status;
  };
  std::vector<Row> rows{
      {"POST", "/api/studies/7/pause", own, 404},
      {"POST", "/api/studies/7/pause", page.cookie_header() + "Content-Length: 0\r\n", 403},
      {"POST", "/api/studies", origin + "Content-Length: 262145\r\n", 413},
  };
  for (const std::string path :
       {"/", "/page.css", "/metrics", "/api/session", "/api/studies/1", "/api/studies/1/rows",
        "/api/studies/1/delete", "/api/studies/0/pause", "/api/studies/x/pause",
        "/api/studies/1/pause/", "/api/studies/1/points/1/pause", "/api/studies/1/slice"}) {
    rows.push_back({"POST", path, own, 405});
  }
  for (const std::string path :
       {"/api/studies/0", "/api/studies/x", "/api/studies/1/", "/api/studies/1/pause",
        "/api/studies/1/points/", "/api/studies/1/points/x", "/api/studies/1/points/1/rows",
        "/api/studies/99999999999999999999", "/api/anything", "/page", "/README.md",
        "/../etc/passwd", "/%2e%2e/main.js", "//main.js", "/main.js/", "/Main.js"}) {
    rows.push_back({"GET", path, page.cookie_header(), 404});
  }
  for (const std::string path :
       {"/api/studies?limit=%ff", "/api/studies?%c3%28=1", "/api/studies?limit=x",
        "/api/studies/1/rows?where=%ff", "/api/studies/1/rows?format=xml",
        "/api/studies/1/slice?x=%ed%a0%80"}) {
    rows.push_back({"GET", path, page.cookie_header(), 400});
  }
  for (const Row& row : rows) {
    EXPECT_EQ(status_of_answer(page.request(row.method, row.path, row.headers)), row.status)
        << row.method << ' ' << row.path << ' ' << row.headers;
  }
  EXPECT_EQ(status_of_answer(page.post("/api/studies", std::string(262'144, ' '))), 400);
}

TEST_F(PageStudyTest, ATraceIsCancelledWhenItsBrowserDisconnects) {
  submit_grid();
  SimulatedWorker worker(page_.server().worker_endpoint());
  worker.hello();
  auto browser = page_.begin("/api/studies/1/points/3/trace");
  while (!worker.receive().has_trace_order()) {
    // Skips the welcome.
  }
  browser.reset();
  while (!worker.receive().has_trace_cancel()) {
    // Skips other messages.
  }
}

TEST(PageFiles, AreSentGzippedWithTheirTypesUnlessCached) {
  const PageServer page;
  const auto type_of = [&](const std::string& path) {
    const std::string answer = page.request("GET", path, "Accept-Encoding: gzip, deflate\r\n");
    EXPECT_EQ(status_of_answer(answer), 200) << path;
    EXPECT_THAT(answer, HasSubstr("Content-Encoding: gzip\r\n"));
    EXPECT_THAT(answer, HasSubstr("Vary: Accept-Encoding\r\n"));
    EXPECT_THAT(body_of(answer), StartsWith("\x1f\x8b"));
    const std::string name = "Content-Type: ";
    const std::size_t at = answer.find(name) + name.size();
    return answer.substr(at, answer.find('\r', at) - at);
  };
  EXPECT_EQ(type_of("/"), "text/html; charset=utf-8");
  EXPECT_EQ(type_of("/main.js"), "text/javascript; charset=utf-8");
  EXPECT_EQ(type_of("/page.css"), "text/css; charset=utf-8");
  EXPECT_EQ(type_of("/icon.svg"), "image/svg+xml");
  for (const PageFile& file : page_files()) {
    const std::string path(file.path);
    const std::string known = "If-None-Match: " + std::string(file.tag) + "\r\n";
    const std::string answer = page.request("GET", path, known);
    EXPECT_EQ(status_of_answer(answer), 304) << path;
    EXPECT_EQ(body_of(answer), "") << path;
    EXPECT_EQ(status_of_answer(page.request("GET", path, "If-None-Match: \"other\"\r\n")), 200)
        << path;
  }
}

TEST(PageFiles, ArePlainUnlessTheClientAcceptsGzip) {
  const PageServer page;
  for (const std::string accepted :
       {"", "Accept-Encoding: identity\r\n", "Accept-Encoding: gzip;q=0\r\n",
        "Accept-Encoding: *;q=0\r\n", "Accept-Encoding: br, gzip ; q=0.000 , identity\r\n",
        "Accept-Encoding:\r\n", "Accept-Encoding: gzipped\r\n", "Accept-Encoding: *\r\n"}) {
    for (const PageFile& file : page_files()) {
      const std::string answer = page.request("GET", std::string(file.path), accepted);
      EXPECT_EQ(body_of(answer), std::string(file.plain.begin(), file.plain.end())) << accepted;
      EXPECT_THAT(answer, Not(HasSubstr("Content-Encoding")));
      EXPECT_THAT(answer, HasSubstr("Vary: Accept-Encoding\r\n"));
    }
  }
  for (const std::string accepted :
       {"gzip", "br;q=1, gzip;q=0.5", "GZIP", "gzip;q=0.001", "x-gzip", "identity;q=0,gzip"}) {
    EXPECT_THAT(page.request("GET", "/main.js", "Accept-Encoding: " + accepted + "\r\n"),
                HasSubstr("Content-Encoding: gzip\r\n"))
        << accepted;
  }
}

TEST(PageFiles, ThePagePreloadsItsModules) {
  const std::string page = body_of(PageServer().request("GET", "/", ""));
  EXPECT_THAT(page, HasSubstr("\n<link rel=\"modulepreload\" href=\"study/study.js\">\n"));
  EXPECT_THAT(page, Not(HasSubstr("href=\"main.js\"")));
}

TEST(PageFiles, NameNoAddressFromTheRootOfTheHost) {
  for (const PageFile& file : page_files()) {
    const std::string text(file.plain.begin(), file.plain.end());
    if (!file.path.starts_with("/vendor/")) {
      EXPECT_THAT(text, Not(testing::ContainsRegex("(href|src)=\"/"))) << file.path;
      EXPECT_THAT(text, Not(testing::ContainsRegex("[\"'`]/api/"))) << file.path;
    }
  }
}

TEST(PageAccess, ChangesThroughAProxyComeFromTheHostThatItNames) {
  const PageServer page;
  const std::string proxied = page.cookie_header() + "Content-Length: 0\r\n" +
                              "Origin: https://hub.example\r\nSec-Fetch-Site: same-origin\r\n";
  const std::string path = "/api/studies/7/pause";
  EXPECT_EQ(
      status_of_answer(page.request("POST", path, proxied + "X-Forwarded-Host: hub.example\r\n")),
      404);
  EXPECT_EQ(status_of_answer(page.request("POST", path, proxied)), 403);
  EXPECT_EQ(
      status_of_answer(page.request("POST", path, proxied + "X-Forwarded-Host: other.example\r\n")),
      403);
}

TEST(PageFiles, AreSmall) {
  std::size_t bytes = 0;
  for (const PageFile& file : page_files()) {
    bytes += file.gzipped.size();
  }
  EXPECT_LE(bytes, 120'000U);
}

TEST(PageToken, TokensDifferAndACookieIsDerivedFromItsToken) {
  const PageToken one;
  const PageToken other;
  EXPECT_NE(one.text(), other.text());
  EXPECT_EQ(one.text().size(), 64U);
  EXPECT_TRUE(one.is(one.text()));
  EXPECT_FALSE(one.is(other.text()));
  EXPECT_EQ(PageToken(one.text()).cookie_for("localhost:1"), one.cookie_for("localhost:1"));
  EXPECT_THAT(one.cookie_for("[::1]:7602"), StartsWith("oblique-7602="));
  EXPECT_THAT(one.cookie_for("[::1]"), StartsWith("oblique-80="));
}

TEST(PageToken, ATokenFileIsCreatedForItsOwnerAndReadAgain) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("token");
  const std::string token = PageToken::from_file(path).text();
  EXPECT_EQ(token.size(), 64U);
  EXPECT_EQ(PageToken::from_file(path).text(), token);
  using std::filesystem::perms;
  EXPECT_EQ(std::filesystem::status(path).permissions(), perms::owner_read | perms::owner_write);
  std::filesystem::permissions(path, perms::group_read, std::filesystem::perm_options::add);
  EXPECT_THROW(PageToken::from_file(path), std::runtime_error);
  int number = 0;
  for (const std::string& text :
       {std::string(), std::string(31, 'a'), std::string(129, 'a'), std::string(40, ' '),
        std::string(32, 'a') + "\n" + std::string(8, 'b'), std::string(32, ';')}) {
    const std::string wrong = folder.file(std::to_string(++number));
    std::ofstream(wrong) << text << '\n';
    std::filesystem::permissions(wrong, perms::owner_read);
    EXPECT_THROW(PageToken::from_file(wrong), std::runtime_error) << text;
  }
  EXPECT_THROW(PageToken::from_file(folder.file("no/folder")), std::runtime_error);
}

// ---- Studies, points and rows -------------------------------------------------------------------

/// Returns a study with these values, encoded as the body of a request.
std::string body_with(const std::string& H, const std::string& others = "",
                      const std::string& model = "{}", const std::string& mu = R"("values":[1])",
                      const std::string& where = "") {
  return R"({"name":"made","model":)" + model + R"(,"recipe":{"errors":true,"blocks":[{"axes":[)" +
         others + R"({"key":"H",)" + H + R"(},{"key":"mu",)" + mu +
         R"(},{"key":"e","values":[1]}],"where":")" + where + R"("}]}})";
}

/// Returns the elements of a JSON array, each under the value of its member `member`.
std::map<std::string, json> named(const json& list, const char* member) {
  std::map<std::string, json> found;
  for (const json& element : list) {
    found[element[member]] = element;
  }
  return found;
}

TEST_F(PageStudyTest, TheOverviewIsSentOnceAndThenAfterChanges) {
  RawHttp tab(page_.url());
  tab.send("GET /api/events HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(status_of_answer(tab.read_to_the_end()), 401);
  const auto other = page_.begin("/api/events");
  const std::string first = other->read_until("\r\n\r\n");
  EXPECT_THAT(first, HasSubstr("Content-Type: text/event-stream"));
  const std::string empty = other->read_until("}\n\n");
  EXPECT_THAT(empty, HasSubstr("event: overview\ndata: {\"studies\":[]"));
  submit_grid();
  const std::string event = other->read_until("}\n\n");
  const json now = json::parse(event.substr(event.find("data: ") + 6));
  ASSERT_EQ(now["studies"].size(), 1U);
  EXPECT_EQ(now["studies"][0]["name"], "grid");
  EXPECT_EQ(now["studies"][0]["points"], 24);
  EXPECT_EQ(now["studies"][0]["waits_for"], "a worker");
  EXPECT_EQ(now["studies"][0]["left_s"], nullptr);
  EXPECT_EQ(now["studies_by_state"]["running"], 1);
}

TEST_F(PageStudyTest, TheAnswerForAStudyHasItsRecipeAndColumns) {
  submit_grid();
  const json study = page_.json("/api/studies/1");
  EXPECT_EQ(study["name"], "grid");
  EXPECT_EQ(study["points"], 24);
  auto model = named(study["model"], "key");
  EXPECT_EQ(model["E"]["value"], 70e9);
  EXPECT_EQ(model["E"]["unit"], "Pa");
  EXPECT_EQ(model["lengths"]["value"], json({0.4, 0.4, 0.4}));
  EXPECT_EQ(model["integrator"]["value"], "explicit");
  const json& block = study["blocks"][0];
  EXPECT_EQ(block["kind"], "grid");
  EXPECT_EQ(block["axes"][0]["list"], json({1.0, 0.9, 0.8}));
  EXPECT_EQ(block["axes"][1]["range"],
            json({{"from", 0.0}, {"to", 0.6}, {"count", 4}, {"spacing", "linear"}}));
  EXPECT_EQ(block["axes"][1]["stride"], 2);
  auto columns = named(study["columns"], "name");
  EXPECT_EQ(columns["fn_peak_N"]["unit"], "N");
  EXPECT_EQ(columns["fn_peak_N"]["picture"], "numbers");
  EXPECT_EQ(columns["mode"]["picture"], "categories");
}

TEST_F(PageStudyTest, StudiesAndWorkersAreListedAndUnknownOnesAreNotFound) {
  submit_grid();
  EXPECT_EQ(page_.json("/api/studies")["studies"][0]["name"], "grid");
  EXPECT_EQ(page_.json("/api/studies?after=1")["studies"].size(), 0U);
  EXPECT_EQ(page_.json("/api/workers")["workers"].size(), 0U);
  for (const std::string path :
       {"2/slice?z=mode&x=mu", "2/bins?x=mu", "2/points/0", "1/points/24"}) {
    EXPECT_EQ(page_.status("/api/studies/" + path), 404) << path;
  }
  for (const std::string& answer :
       {page_.get("/api/studies/2"), page_.get("/api/studies/2/rows"),
        page_.get("/api/studies/2/points/0/trace"), page_.post("/api/studies/2/pause")}) {
    EXPECT_EQ(status_of_answer(answer), 404);
    EXPECT_THAT(answer, HasSubstr("there is no such study"));
  }
}

TEST_F(PageStudyTest, RowsAreQueriedAsOnTheCommandLine) {
  solve_grid();
  const json rows = page_.json(
      "/api/studies/1/rows?select=point,fn_peak_N&where=mu%20%3C%200.1&order=point%20DESC&limit=2");
  EXPECT_EQ(rows["columns"], json({"point", "fn_peak_N"}));
  EXPECT_EQ(rows["units"], json({"", "N"}));
  ASSERT_EQ(rows["rows"].size(), 2U);
  EXPECT_EQ(rows["rows"][0][0], 17);
  const std::string csv = page_.get("/api/studies/1/rows?select=point,mode&limit=1&format=csv");
  EXPECT_EQ(body_of(csv), "point,mode\r\n0,SC SR sR\r\n");
  EXPECT_EQ(body_of(page_.get("/api/studies/1/rows?select=NULL+AS+x&limit=2&format=csv")),
            "x\r\n\"\"\r\n\"\"\r\n");
  const std::string wrong = page_.get("/api/studies/1/rows?where=muu%20%3E%201");
  EXPECT_EQ(status_of_answer(wrong), 400);
  EXPECT_THAT(wrong, HasSubstr("did you mean `mu`?"));
  EXPECT_EQ(page_.status("/api/studies/1/rows?where=1%3B%20DROP%20TABLE%20studies"), 400);
}

TEST_F(PageStudyTest, APointHasTheInputsOfItsRecipe) {
  submit("filtered", filtered_grid("mu < 0.5"));
  const json point = page_.json("/api/studies/1/points/7");
  EXPECT_EQ(point["left_out"], true);
  EXPECT_EQ(point["mu"], 0.6);
  EXPECT_EQ(point["fault"], "");
  EXPECT_EQ(page_.json("/api/studies/1/points/3")["left_out"], false);
  const std::string trace = page_.get("/api/studies/1/points/3/trace");
  EXPECT_EQ(status_of_answer(trace), 409);
  EXPECT_THAT(trace, HasSubstr("no worker is connected"));
}

TEST_F(PageStudyTest, AStudyIsSubmittedAndChangedFromThePage) {
  const std::string made = page_.post(
      "/api/studies", body_with(R"("values":[1])", "", "{}", R"("from":0,"to":1,"count":5)"));
  EXPECT_EQ(json::parse(body_of(made))["points"], 5);
  const auto state = [&] { return page_.json("/api/studies")["studies"][0]["state"]; };
  EXPECT_EQ(status_of_answer(page_.post("/api/studies/1/pause")), 200);
  EXPECT_EQ(state(), "paused");
  EXPECT_EQ(json::parse(body_of(page_.post("/api/studies/1/resume")))["study"]["state"], "running");
  EXPECT_EQ(status_of_answer(page_.post("/api/studies/1/cancel")), 200);
  EXPECT_EQ(state(), "cancelled");
  EXPECT_EQ(status_of_answer(page_.post("/api/studies/1/retry")), 200);
  for (const std::string body : {"", "{", "[]", "{\"nome\":1}", "\xff\xfe", "{\"name\":\"x\"}"}) {
    const int status = status_of_answer(page_.post("/api/studies", body));
    EXPECT_TRUE(status == 400 || status == 409) << body << ' ' << status;
  }
}

TEST_F(PageStudyTest, AModelIsGivenByPresetIntegratorAndKeys) {
  const auto body = [](const std::string& model) {
    return body_with(R"("values":[1])", "", model);
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
  auto model = named(study["model"], "key");
  EXPECT_EQ(model["elements_per_link"]["value"], 48);
  EXPECT_EQ(model["integrator"]["value"], "generalized-alpha");
  EXPECT_EQ(model["k"]["value"], 2.5e7);
}

// ---- Checks before a study is submitted ---------------------------------------------------------

TEST_F(PageStudyTest, AStudyIsCheckedBeforeItIsSubmitted) {
  const auto check = [&](const std::string& mu, const std::string& where) {
    return page_.post("/api/check", body_with(R"("values":[1])", "", "{}", mu, where));
  };
  const json all = json::parse(body_of(check(R"("from":0,"to":1,"count":11)", "")));
  EXPECT_EQ(all["points"], 11);
  EXPECT_EQ(all["models"], 1);
  EXPECT_EQ(all["falls"], 1);
  EXPECT_EQ(all["falls_estimated"], false);
  EXPECT_EQ(all["bytes"], 11 * 970 + 600) << "the same estimate as `oblique study check` gives";
  const json some = json::parse(body_of(check(R"("from":0,"to":1,"count":11)", "mu > 0.45")));
  EXPECT_EQ(some["points"], 6);
  const std::string wrong = check(R"("values":[-1])", "");
  EXPECT_EQ(status_of_answer(wrong), 400);
  EXPECT_THAT(wrong, HasSubstr("mu"));
  EXPECT_EQ(page_.json("/api/studies")["studies"].size(), 0U);
}

TEST_F(PageStudyTest, ADropAboveTheLengthIsRefusedAndAnUncertainOneIsReported) {
  const auto check = [&](const std::string& H, const std::string& others = {}) {
    return page_.post("/api/check", body_with(H, others));
  };
  const auto reached_m = [&](const std::string& H, const std::string& others = {}) {
    return json::parse(body_of(check(H, others)))["surely_reached_m"];
  };
  for (const std::string H : {R"("values":[1.0,1.25])", R"("from":0.1,"to":1.25,"count":9)"}) {
    EXPECT_EQ(status_of_answer(check(H)), 400) << H;
    EXPECT_THAT(check(H), HasSubstr("H = 1.25 m is not allowed: the tip drops at most the length "
                                    "of the chain, 1.2 m"));
  }
  EXPECT_EQ(reached_m(R"("from":0.1,"to":1.08,"count":9)"), json());
  EXPECT_DOUBLE_EQ(reached_m(R"("from":0.1,"to":1.19,"count":9)"), 1.08);
  EXPECT_DOUBLE_EQ(reached_m(R"("values":[0.75])", R"({"key":"links","values":[2,3]},)"), 0.72)
      << "the shortest finger limits the drop";
  EXPECT_DOUBLE_EQ(reached_m(R"("expression":"0.5 + 0.1 * e")"), 1.08);
}

TEST_F(PageStudyTest, ErrorsRepeatAtMostEightyCharactersOfAKey) {
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
