// Who is let in: a matrix of hostile and sound requests against a whole server.
#include <filesystem>
#include <fstream>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/web/page/page_key.h"
#include "server/web/page/token_file.h"
#include "tests/server/web/page/page_server.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(PageAccess, ATokenBecomesACookieAndGoesFromTheAddress) {
  const PageServer page;
  const std::string answer = page.ask("GET", std::string("/?token=") + kTestToken, "");
  EXPECT_EQ(status_of_answer(answer), 303);
  EXPECT_THAT(answer, HasSubstr("Location: /\r\n"));
  EXPECT_THAT(answer, HasSubstr("; Path=/; HttpOnly; SameSite=Strict\r\n"));
  EXPECT_THAT(answer, Not(HasSubstr(kTestToken)));
  EXPECT_EQ(page.json("/api/session")["may_change"], true);
}

TEST(PageAccess, OnlyAServerThatShowsAFileTellsCommandsToReadItAndOnlyThoseWhoAreIn) {
  EXPECT_EQ(PageServer().json("/api/session")["file"], "");
  WebSettings web = page_settings();
  web.page.is_of_file = true;
  const PageServer page(web);
  EXPECT_EQ(page.json("/api/session")["file"], page.database());
  EXPECT_EQ(nlohmann::json::parse(body_of(page.ask("GET", "/api/session", "")))["file"], "");
}

TEST(PageAccess, AWrongTokenIsRefused) {
  const PageServer page;
  for (const std::string token :
       {"", "0", "0123456789abcdef0123456789abcdeg", "0123456789abcdef0123456789abcdef0", "%01"}) {
    const std::string answer = page.ask("GET", "/?token=" + token, "");
    EXPECT_EQ(status_of_answer(answer), 403) << token;
    EXPECT_THAT(answer, Not(HasSubstr("Set-Cookie"))) << token;
  }
}

TEST(PageAccess, WithoutTheCookieNothingIsShown) {
  const PageServer page;
  const std::string right = page.cookie_header();
  for (const std::string path :
       {"/api/events", "/api/studies", "/api/workers", "/api/studies/1", "/api/studies/1/rows",
        "/api/studies/1/slice?z=fn_peak_N&x=mu", "/api/studies/1/slice?z=fn_peak_N&x=mu&where=1",
        "/api/studies/1/bins?x=mu&where=1", "/api/studies/1/points/0",
        "/api/studies/1/points/0/trace", "/api/anything"}) {
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
}

TEST(PageAccess, ACookieIsFoundAmongOthers) {
  const PageServer page;
  const std::string own = page.cookie_header().substr(std::string("Cookie: ").size());
  const std::string pair = own.substr(0, own.size() - 2);
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
  EXPECT_EQ(status_of_answer(page.get("/api/studies")), 200);
  EXPECT_EQ(status_of_answer(page.ask("POST", "/api/studies/1/pause",
                                      "Origin: " + page.url() + "\r\nContent-Length: 0\r\n")),
            401);
}

TEST(PageAccess, FieldsAreText) {
  const PageServer page;
  for (const std::string path :
       {"/api/studies?limit=%ff", "/api/studies?%c3%28=1", "/api/studies/1/rows?where=%ff",
        "/api/studies/1/slice?x=%ed%a0%80"}) {
    const std::string answer = page.get(path);
    EXPECT_EQ(status_of_answer(answer), 400) << path;
    EXPECT_THAT(answer, HasSubstr("UTF-8")) << path;
  }
}

TEST(PageAccess, HostilePagesGetAndChangeNothing) {
  const PageServer page;
  const std::string origin = "Origin: " + page.url() + "\r\n";
  struct Hostile {
    std::string headers;
    int get;
    int post;
  };
  const std::vector<Hostile> all{
      {"", 200, 403},  // a change says where it comes from
      {origin, 200, 404},
      {origin + "Sec-Fetch-Site: same-origin\r\n", 200, 404},
      {origin + "Sec-Fetch-Site: none\r\n", 200, 403},
      {"Sec-Fetch-Site: same-origin\r\n", 200, 403},
      {origin + "Sec-Fetch-Site: same-site\r\n", 403, 403},
      {origin + "Sec-Fetch-Site: cross-site\r\n", 403, 403},
      {"Origin: http://evil.example\r\n", 403, 403},
      {"Origin: null\r\n", 403, 403},
      {"Origin: http://localhost\r\n", 403, 403},
      {"Origin: https://" + page.host() + "\r\n", 403, 403},
      {origin + origin, 200, 403},
      {origin + "Origin: http://evil.example\r\n", 403, 403},
  };
  for (const Hostile& one : all) {
    for (const std::string path : {"/", "/api/events", "/api/studies/1/slice?z=mode&x=mu&where=1",
                                   "/api/studies/1/bins?x=mu", "/api/studies/1/rows?where=1",
                                   "/api/studies/1/points/0/trace"}) {
      // Without an answer to its end, which a stream has not.
      RawHttp browser(page.url());
      browser.send("GET " + path + " HTTP/1.1\r\nHost: " + page.host() + "\r\n" +
                   page.cookie_header() + one.headers + "\r\n");
      const int status = status_of_answer(browser.read_until("\r\n"));
      EXPECT_EQ(status == 403, one.get == 403) << path << ' ' << status << one.headers;
    }
    EXPECT_EQ(status_of_answer(page.ask("GET", "/api/studies", page.cookie_header() + one.headers)),
              one.get)
        << one.headers;
    EXPECT_EQ(status_of_answer(
                  page.ask("POST", "/api/studies/7/pause",
                           page.cookie_header() + one.headers + "Content-Length: 2\r\n", "{}")),
              one.post)
        << one.headers;
  }
  for (const std::string host : {"evil.example", "evil.example:7602", "127.0.0.1.evil.example",
                                 "192.168.0.1:7602", "localhost.:7602"}) {
    EXPECT_EQ(status_of_answer(RawHttp(page.url())
                                   .ask("GET / HTTP/1.1\r\nHost: " + host + "\r\n" +
                                        page.cookie_header() + "\r\n")),
              403)
        << host;
  }
}

TEST(PageAccess, ALinkOfAnotherSiteOpensThePageAndNothingElse) {
  const PageServer page;
  const std::string link =
      "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\nSec-Fetch-Dest: document\r\n";
  const std::string frame = page.ask("GET", "/", link);
  EXPECT_EQ(status_of_answer(frame), 200);
  EXPECT_EQ(body_of(frame), body_of(page.ask("GET", "/", "")));
  const std::string with_token = page.ask("GET", std::string("/?token=") + kTestToken, link);
  EXPECT_EQ(status_of_answer(with_token), 403);
  EXPECT_THAT(with_token, Not(HasSubstr("Set-Cookie")));
  for (const std::string path :
       {"/?", "/?x=1", "/main.js", "/page.css", "/metrics", "/healthz", "/api/session",
        "/api/studies", "/api/studies/1/rows", "//", "/index.html"}) {
    const bool is_frame = path == "/?";
    EXPECT_EQ(status_of_answer(page.ask("GET", path, page.cookie_header() + link)),
              is_frame ? 200 : 403)
        << path;
  }
  EXPECT_EQ(status_of_answer(page.ask("POST", "/api/studies/7/pause",
                                      page.cookie_header() + "Origin: http://evil.example\r\n" +
                                          link + "Content-Length: 2\r\n",
                                      "{}")),
            403);
}

TEST(PageAccess, OnlyChangesHaveAnotherMethod) {
  const PageServer page;
  const std::string headers =
      page.cookie_header() + "Origin: " + page.url() + "\r\nContent-Length: 0\r\n";
  for (const std::string path :
       {"/", "/page.css", "/metrics", "/api/session", "/api/studies/1", "/api/studies/1/rows",
        "/api/studies/1/delete", "/api/studies/0/pause", "/api/studies/x/pause",
        "/api/studies/1/pause/", "/api/studies/1/points/1/pause", "/api/studies/1/slice",
        "/api/studies/1/bins"}) {
    EXPECT_EQ(status_of_answer(page.ask("POST", path, headers)), 405) << path;
  }
  for (const std::string method : {"PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "get"}) {
    EXPECT_EQ(status_of_answer(page.ask(method, "/api/studies/1/pause", headers)), 405) << method;
  }
}

TEST(PageAccess, ABodyIsBoundedBeforeItComes) {
  const PageServer page;
  const std::string headers = page.cookie_header() + "Origin: " + page.url() + "\r\n";
  for (const std::string length : {"Content-Length: 262145\r\n", "Content-Length: 99999999999\r\n",
                                   "Transfer-Encoding: chunked\r\n"}) {
    EXPECT_EQ(status_of_answer(page.ask("POST", "/api/studies", headers + length)), 413) << length;
  }
  const std::string large(262'144, ' ');
  EXPECT_EQ(status_of_answer(page.post("/api/studies", large)), 400);
}

TEST(PageAccess, EveryAnswerKeepsOthersOut) {
  const PageServer page;
  for (const std::string path : {"/", "/main.js", "/api/session", "/api/studies", "/nothing"}) {
    const std::string answer = page.get(path);
    for (const std::string header :
         {"Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; ",
          "frame-ancestors 'none'\r\n", "X-Content-Type-Options: nosniff\r\n",
          "Referrer-Policy: no-referrer\r\n", "Cross-Origin-Resource-Policy: same-origin\r\n",
          "Cross-Origin-Opener-Policy: same-origin\r\n"}) {
      EXPECT_THAT(answer, HasSubstr(header)) << path;
    }
    EXPECT_THAT(answer, Not(HasSubstr("unsafe"))) << path;
  }
}

TEST(PageKey, TokensDifferAndACookieFollowsFromItsToken) {
  const PageKey one;
  const PageKey other;
  EXPECT_NE(one.token(), other.token());
  EXPECT_EQ(one.token().size(), 64U);
  EXPECT_TRUE(one.is_token(one.token()));
  EXPECT_FALSE(one.is_token(other.token()));
  EXPECT_EQ(PageKey(one.token()).cookie_for("localhost:1"), one.cookie_for("localhost:1"));
  EXPECT_THAT(one.cookie_for("[::1]:7602"), testing::StartsWith("oblique-7602="));
  EXPECT_THAT(one.cookie_for("[::1]"), testing::StartsWith("oblique-80="));
}

TEST(TokenFile, IsMadeForItsOwnerAndReadAgain) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("token");
  const std::string token = token_of_file(path);
  EXPECT_EQ(token.size(), 64U);
  EXPECT_EQ(token_of_file(path), token);
  using std::filesystem::perms;
  EXPECT_EQ(std::filesystem::status(path).permissions(), perms::owner_read | perms::owner_write);
  std::filesystem::permissions(path, perms::group_read, std::filesystem::perm_options::add);
  EXPECT_THROW(token_of_file(path), std::runtime_error);
}

TEST(TokenFile, HasLettersAndDigitsEnough) {
  const test::TemporaryFolder folder;
  int number = 0;
  for (const std::string& text :
       {std::string(), std::string(31, 'a'), std::string(129, 'a'), std::string(40, ' '),
        std::string(32, 'a') + "\n" + std::string(8, 'b'), std::string(32, ';')}) {
    const std::string path = folder.file(std::to_string(++number));
    std::ofstream(path) << text << '\n';
    std::filesystem::permissions(path, std::filesystem::perms::owner_read);
    EXPECT_THROW(token_of_file(path), std::runtime_error) << text;
  }
  EXPECT_THROW(token_of_file(folder.file("no/folder")), std::runtime_error);
}

}  // namespace
}  // namespace oblique::server
