// The files of the page, as a browser gets them.
#include "server/web/page/page_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/web/page/page_server.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(PageFiles, ComeWithTheirTypesToWhoeverAsks) {
  const PageServer page;
  const auto type_of = [&](const std::string& path) {
    const std::string answer = page.ask("GET", path, "");
    EXPECT_EQ(status_of_answer(answer), 200) << path;
    const std::string name = "Content-Type: ";
    const std::size_t at = answer.find(name) + name.size();
    return answer.substr(at, answer.find('\r', at) - at);
  };
  EXPECT_EQ(type_of("/"), "text/html; charset=utf-8");
  EXPECT_EQ(type_of("/index.html"), "text/html; charset=utf-8");
  EXPECT_EQ(type_of("/main.js"), "text/javascript; charset=utf-8");
  EXPECT_EQ(type_of("/page.css"), "text/css; charset=utf-8");
  EXPECT_EQ(type_of("/icon.svg"), "image/svg+xml");
}

TEST(PageFiles, AreGzippedForWhoTakesThat) {
  const PageServer page;
  const std::string packed = page.ask("GET", "/", "Accept-Encoding: br, gzip\r\n");
  EXPECT_THAT(packed, HasSubstr("Content-Encoding: gzip\r\n"));
  EXPECT_THAT(body_of(packed), StartsWith("\x1f\x8b"));
  const std::string plain = page.ask("GET", "/", "");
  EXPECT_THAT(plain, Not(HasSubstr("Content-Encoding")));
  EXPECT_THAT(body_of(plain), StartsWith("<!doctype html>"));
  EXPECT_LT(body_of(packed).size(), body_of(plain).size());
}

TEST(PageFiles, AreNotSentAgainToWhoHasThem) {
  const PageServer page;
  for (const PageFile& file : page_files()) {
    const std::string tag(file.tag);
    const std::string path(file.path);
    const std::string answer = page.ask("GET", path, "If-None-Match: " + tag + "\r\n");
    EXPECT_EQ(status_of_answer(answer), 304) << path;
    EXPECT_EQ(body_of(answer), "") << path;
    EXPECT_EQ(status_of_answer(page.ask("GET", path, "If-None-Match: \"other\"\r\n")), 200) << path;
  }
}

TEST(PageFiles, AreAllThereIs) {
  const PageServer page;
  for (const std::string path : {"/page", "/README.md", "/../etc/passwd", "/%2e%2e/main.js",
                                 "//main.js", "/main.js/", "/Main.js", "/main.js%00"}) {
    const int status = status_of_answer(page.get(path));
    EXPECT_TRUE(status == 404 || (status == 200 && path == "/main.js%00")) << path << ' ' << status;
  }
}

TEST(PageFiles, AreSmallAndAskNobodyElse) {
  std::size_t bytes = 0;
  const PageServer page;
  for (const PageFile& file : page_files()) {
    bytes += file.gzipped.size();
    const std::string text = body_of(page.get(std::string(file.path)));
    // The picture's namespace is an address, and others' comments have some; a browser is watched
    // for what it asks in tests/client/web.
    if (file.path != "/icon.svg" && !file.path.starts_with("/vendor/")) {
      EXPECT_THAT(text, Not(HasSubstr("http://"))) << file.path;
      EXPECT_THAT(text, Not(HasSubstr("https://"))) << file.path;
    }
  }
  EXPECT_LE(bytes, 120'000U);
}

}  // namespace
}  // namespace oblique::server
