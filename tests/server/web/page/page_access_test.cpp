// Who is let in, and the files of the page: requests to a whole server.
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/web/page/page.h"
#include "server/web/page/page_token.h"
#include "tests/server/web/page/page_study.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(PageAccess, ATokenBecomesACookieAndGoesFromTheAddress) {
  const PageServer page;
  const std::string answer = page.ask("GET", std::string("/?token=") + kTestToken, "");
  EXPECT_EQ(status_of_answer(answer), 303);
  EXPECT_THAT(answer, HasSubstr("Location: /\r\n"));
  EXPECT_THAT(answer, HasSubstr("; Path=/; HttpOnly; SameSite=Strict\r\n"));
  EXPECT_THAT(answer, Not(HasSubstr(kTestToken)));
  EXPECT_EQ(page.json("/api/session")["may_change"], true);
  for (const std::string token :
       {"", "0", "0123456789abcdef0123456789abcdeg", "0123456789abcdef0123456789abcdef0", "%01"}) {
    const std::string refused = page.ask("GET", "/?token=" + token, "");
    EXPECT_EQ(status_of_answer(refused), 403) << token;
    EXPECT_THAT(refused, Not(HasSubstr("Set-Cookie"))) << token;
  }
}

TEST(PageAccess, OnlyTheServerOfAFileNamesItAndOnlyToThoseWhoAreIn) {
  EXPECT_EQ(PageServer().json("/api/session")["file"], "");
  WebSettings web = page_settings();
  web.page.is_of_file = true;
  const PageServer page(web);
  EXPECT_EQ(page.json("/api/session")["file"], page.database());
  EXPECT_EQ(nlohmann::json::parse(body_of(page.ask("GET", "/api/session", "")))["file"], "");
}

TEST(PageAccess, WithoutTheCookieNothingIsShown) {
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
      const std::string answer = page.ask("GET", path, cookies);
      EXPECT_EQ(status_of_answer(answer), 401) << path << ' ' << cookies;
      EXPECT_THAT(answer, HasSubstr("token")) << path;
    }
  }
  EXPECT_EQ(nlohmann::json::parse(body_of(page.ask("GET", "/api/session", "")))["may_look"], false);
  const std::string pair = right.substr(std::string("Cookie: ").size(), right.size() - 10);
  for (const std::string& cookies : {"Cookie: a=b; " + pair, "Cookie: " + pair + "; a=b",
                                     "Cookie: a;;  " + pair + ";", "cookie: a=b;" + pair}) {
    EXPECT_EQ(status_of_answer(page.ask("GET", "/api/studies", cookies + "\r\n")), 200) << cookies;
  }
}

TEST(PageAccess, AnOperatorMayLetAllLookAndNoneChange) {
  const PageServer page(page_settings(true));
  const auto session = nlohmann::json::parse(body_of(page.ask("GET", "/api/session", "")));
  EXPECT_EQ(session["may_look"], true);
  EXPECT_EQ(session["may_change"], false);
  EXPECT_EQ(status_of_answer(page.ask("GET", "/api/studies", "")), 200);
  EXPECT_EQ(status_of_answer(page.ask("POST", "/api/studies/1/pause",
                                      "Origin: " + page.url() + "\r\nContent-Length: 0\r\n")),
            401);
}

TEST(PageAccess, WrongRequestsAreRefused) {
  const PageServer page;
  const std::string origin = page.cookie_header() + "Origin: " + page.url() + "\r\n";
  const std::string own = origin + "Content-Length: 0\r\n";
  const std::string cross =
      "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\nSec-Fetch-Dest: document\r\n";
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
      {"POST", "/api/studies", origin + "Transfer-Encoding: chunked\r\n", 413},
      {"GET", "/?", cross, 200},  // a followed link opens the page and nothing else
      {"GET", std::string("/?token=") + kTestToken, cross, 403},
      {"GET", "/main.js", cross, 403},
      {"GET", "/api/studies", page.cookie_header() + cross, 403},
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
    EXPECT_EQ(status_of_answer(page.ask(row.method, row.path, row.headers)), row.status)
        << row.method << ' ' << row.path << ' ' << row.headers;
  }
  EXPECT_EQ(status_of_answer(page.post("/api/studies", std::string(262'144, ' '))), 400);
}

using PageFlowTest = PageStudyTest;

TEST_F(PageFlowTest, TheWorkerIsToldWhenTheBrowserOfATraceHasGone) {
  submit_grid();
  PretendedWorker worker(page_.server().worker_endpoint());
  worker.hello();
  {
    RawHttp browser(page_.url());
    browser.send("GET /api/studies/1/points/3/trace HTTP/1.1\r\nHost: " + page_.host() + "\r\n" +
                 page_.cookie_header() + "\r\n");
    while (!worker.receive().has_trace_order()) {
      // It was welcomed before.
    }
  }
  while (!worker.receive().has_trace_cancel()) {
    // Nothing else is awaited.
  }
}

TEST(PageFiles, ComeGzippedWithTheirTypesToEverybodyWhoDoesNotHaveThem) {
  const PageServer page;
  const auto type_of = [&](const std::string& path) {
    const std::string answer = page.ask("GET", path, "");
    EXPECT_EQ(status_of_answer(answer), 200) << path;
    EXPECT_THAT(answer, HasSubstr("Content-Encoding: gzip\r\n"));
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
    const std::string answer = page.ask("GET", path, known);
    EXPECT_EQ(status_of_answer(answer), 304) << path;
    EXPECT_EQ(body_of(answer), "") << path;
    EXPECT_EQ(status_of_answer(page.ask("GET", path, "If-None-Match: \"other\"\r\n")), 200) << path;
  }
}

TEST(PageFiles, AreSmallAndNameNoOtherServer) {
  std::size_t bytes = 0;
  for (const PageFile& file : page_files()) {
    bytes += file.gzipped.size();
    std::ifstream source(OBLIQUE_PAGE_SOURCES + std::string(file.path));
    std::ostringstream text;
    text << source.rdbuf();
    EXPECT_NE(text.str(), "") << file.path;
    // The namespace of SVG is an address, and comments of others contain some; tests/client/web
    // watches what a browser requests.
    if (file.path != "/icon.svg" && !file.path.starts_with("/vendor/")) {
      EXPECT_THAT(text.str(), Not(HasSubstr("\"http://"))) << file.path;
      EXPECT_THAT(text.str(), Not(HasSubstr("\"https://"))) << file.path;
    }
  }
  EXPECT_LE(bytes, 120'000U);
}

TEST(PageToken, TokensDifferAndACookieFollowsFromItsToken) {
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

TEST(PageToken, AFileIsMadeForItsOwnerAndReadAgain) {
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

}  // namespace
}  // namespace oblique::server
