#include "server/web/http/request_rules.h"

#include <set>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

#include "server/web/http_options.h"

namespace oblique::server {
namespace {

using Headers = std::multimap<std::string, std::string>;

unsigned status_of(const std::string& method, const std::string& path, const Headers& headers,
                   const OwnNames& own = {}) {
  HttpRequest request;
  request.method = method;
  request.path = path.substr(0, path.find('?'));
  request.headers = headers;
  if (path.find('?') != std::string::npos) {
    request.fields = {{"token", "x"}};
  }
  const auto refusal = refuse(request, own);
  return refusal ? refusal->status : 200;
}

TEST(RequestRules, OnLoopbackOnlyNamesOfLoopbackAreAnswered) {
  for (const std::string host : {"127.0.0.1:7602", "localhost", "localhost:1", "localhost:",
                                 "[::1]:7602", "[::1]", "127.8.9.10:80", "LOCALHOST:7602"}) {
    EXPECT_EQ(status_of("GET", "/", {{"host", host}}), 200U) << host;
  }
  for (const std::string host : {"evil.example",
                                 "evil.example:7602",
                                 "localhost.evil.example",
                                 "127.0.0.1.evil.example:7602",
                                 "192.168.1.5:7602",
                                 "[2001:db8::1]:7602",
                                 "0.0.0.0:7602",
                                 "localhost.:7602",
                                 "2130706433",
                                 "127.1",
                                 "0x7f.1",
                                 "[::ffff:127.0.0.1]:7602",
                                 "",
                                 ":80",
                                 "[::1",
                                 "[]:80",
                                 "[localhost]:80",
                                 "[127.0.0.1]:80",
                                 "localhost:80:80",
                                 "localhost:80@evil.example",
                                 "localhost:x",
                                 "localhost:123456",
                                 "localhost evil.example",
                                 "localhost/evil",
                                 "user@localhost",
                                 "::1",
                                 "localhost\t",
                                 "[::1]evil",
                                 "[::1%25lo]:80"}) {
    EXPECT_EQ(status_of("GET", "/", {{"host", host}}), 403U) << host;
  }
}

TEST(RequestRules, BeyondLoopbackAnyAddressIsAnsweredAndOnlyNamesThatWereGiven) {
  const OwnNames own{false, {"oblique.lab"}};
  for (const std::string host : {"10.1.2.3:7602", "[2001:db8::1]:7602", "127.0.0.1", "localhost",
                                 "oblique.lab:7602", "Oblique.Lab"}) {
    EXPECT_EQ(status_of("GET", "/", {{"host", host}}, own), 200U) << host;
  }
  for (const std::string host : {"evil.example:7602", "sub.oblique.lab"}) {
    EXPECT_EQ(status_of("GET", "/", {{"host", host}}, own), 403U) << host;
  }
}

/// Every other refusal: requests to localhost:7602 with these headers, and their status.
TEST(RequestRules, RefuseWhatPagesOfOtherSitesSend) {
  const std::pair<std::string, std::string> host{"host", "localhost:7602"};
  const std::pair<std::string, std::string> origin{"origin", "http://localhost:7602"};
  const std::pair<std::string, std::string> same{"sec-fetch-site", "same-origin"};
  const std::pair<std::string, std::string> cross{"sec-fetch-site", "cross-site"};
  const std::pair<std::string, std::string> tab{"sec-fetch-mode", "navigate"};
  const std::pair<std::string, std::string> page{"sec-fetch-dest", "document"};
  struct Row {
    std::string method;
    std::string path;
    Headers headers;
    unsigned status;
  };
  std::vector<Row> rows{
      {"GET", "/", {}, 200},  // HTTP/1.0; every browser sends a Host
      {"GET", "/", {host, host}, 400},
      {"GET", "/", {host, {"host", "evil.example"}}, 400},
      // A body states its length.
      {"GET", "/", {host, {"content-length", "0"}}, 200},
      {"GET", "/", {host, {"content-length", "262145"}}, 413},
      {"GET", "/", {host, {"transfer-encoding", "chunked"}}, 413},
      {"POST", "/", {host, origin, {"content-length", "262144"}}, 200},
      {"POST", "/", {host, origin, {"content-length", "262145"}}, 413},
      {"POST", "/", {host, origin, {"content-length", "99999999999999999999"}}, 413},
      {"POST", "/", {host, origin, {"content-length", "x"}}, 413},
      {"POST", "/", {host, origin, {"transfer-encoding", "chunked"}}, 413},
      // Changes come from a page of this server.
      {"POST", "/", {host, origin}, 200},
      {"POST", "/", {host, origin, same}, 200},
      {"POST", "/", {host}, 403},
      {"POST", "/", {host, same}, 403},
      {"POST", "/", {host, origin, origin}, 403},
      {"POST", "/", {host, origin, {"sec-fetch-site", "none"}}, 403},
      {"POST", "/", {origin}, 403},
      // A link on another site opens the page and nothing else.
      {"GET", "/", {host, cross, tab, page}, 200},
      {"GET", "/", {host, {"sec-fetch-site", "same-site"}, tab, page}, 200},
      {"GET", "/?token", {host, cross, tab, page}, 403},
      {"GET", "/metrics", {host, cross, tab, page}, 403},
      {"HEAD", "/", {host, cross, tab, page}, 403},
      {"POST", "/", {host, cross, tab, page}, 403},
      {"GET", "/", {{"host", "evil.example"}, cross, tab, page}, 403},
      {"GET", "/", {host, cross, tab, page, {"origin", "null"}}, 403},
      {"GET", "/", {host, cross, page}, 403},
      {"GET", "/", {host, cross, tab}, 403},
      {"GET", "/", {host, cross, cross, tab, page}, 403},
      {"GET", "/", {host, cross, tab, tab, page}, 403},
      {"GET", "/", {host, cross, tab, page, page}, 403},
  };
  for (const std::string method : {"PUT", "DELETE", "OPTIONS", "TRACE", "get", "BREW"}) {
    rows.push_back({method, "/", {host, origin}, 405});
  }
  for (const std::string other : {"http://evil.example", "https://localhost:7602", "null",
                                  "http://localhost", "http://localhost:7603", ""}) {
    rows.push_back({"GET", "/", {host, {"origin", other}}, 403});
    rows.push_back({"POST", "/", {host, {"origin", other}}, 403});
  }
  for (const std::string site : {"cross-site", "same-site", "", "None", "Cross-Site"}) {
    rows.push_back({"GET", "/", {host, {"sec-fetch-site", site}}, 403});
    rows.push_back({"POST", "/", {host, origin, {"sec-fetch-site", site}}, 403});
  }
  for (const std::string site : {"none", "same-origin"}) {  // none: typed into the address bar
    rows.push_back({"GET", "/", {host, {"sec-fetch-site", site}}, 200});
  }
  for (const std::string mode : {"no-cors", "cors", "nested-navigate"}) {
    rows.push_back({"GET", "/", {host, cross, {"sec-fetch-mode", mode}, page}, 403});
  }
  for (const std::string target : {"iframe", "embed", "object", "script", "empty"}) {
    rows.push_back({"GET", "/", {host, cross, tab, {"sec-fetch-dest", target}}, 403});
  }
  for (const Row& row : rows) {
    EXPECT_EQ(status_of(row.method, row.path, row.headers), row.status)
        << row.method << ' ' << row.path << ' ' << testing::PrintToString(row.headers);
  }
}

TEST(HttpAddress, IsAddressAndPortOrOff) {
  EXPECT_FALSE(parse_http_address("off"));
  const auto text_of = [](const std::string& text) {
    const auto address = parse_http_address(text).value();
    return address.address + " " + address.port;
  };
  EXPECT_EQ(text_of("127.0.0.1:7602"), "127.0.0.1 7602");
  EXPECT_EQ(text_of("localhost:80"), "127.0.0.1 80");
  EXPECT_EQ(text_of("[::1]:7602"), "::1 7602");
  EXPECT_EQ(text_of("0.0.0.0:65535"), "0.0.0.0 65535");
  EXPECT_EQ(text_of("127.0.0.1:0"), "127.0.0.1 *");
  for (const std::string text : {"", "on", "OFF", "7602", ":7602", "127.0.0.1", "127.0.0.1:",
                                 "127.0.0.1:65536", "127.0.0.1:-1", "127.0.0.1:+1", "127.0.0.1: 1",
                                 "::1:7602", "[127.0.0.1]:7602", "[::1]", "example.org:7602"}) {
    EXPECT_THROW(parse_http_address(text), std::runtime_error) << text;
  }
}

WebSettings settings_of(const std::vector<std::string>& arguments) {
  CLI::App app;
  HttpOptions options;
  options.add_to(app);
  app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  return options.settings().value();
}

TEST(HttpOptions, OnlyTheDefaultAddressMayBeTaken) {
  EXPECT_EQ(settings_of({}).address.address, "127.0.0.1");
  EXPECT_EQ(settings_of({}).address.port, "7602");
  EXPECT_TRUE(settings_of({}).may_be_missing);
  EXPECT_FALSE(settings_of({"--http", "127.0.0.1:7602"}).may_be_missing);
}

TEST(HttpOptions, NamesAreInLowerCase) {
  const WebSettings settings =
      settings_of({"--http-name", "Oblique.Lab", "--http-name", "oblique-server"});
  EXPECT_EQ(settings.names, (std::set<std::string>{"oblique-server", "oblique.lab"}));
  for (const std::string name : {"oblique.lab:7602", "", "[::1]", "a b"}) {
    EXPECT_THROW(settings_of({"--http-name", name}), std::runtime_error) << name;
  }
}

}  // namespace
}  // namespace oblique::server
