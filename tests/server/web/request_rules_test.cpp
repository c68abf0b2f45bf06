#include "server/web/http/request_rules.h"

#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

#include "proto/text.h"
#include "server/web/web.h"

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
  for (const auto host : protocol::split(
           "127.0.0.1:7602 localhost localhost:1 localhost: [::1]:7602 [::1] 127.8.9.10:80"
           " LOCALHOST:7602",
           ' ')) {
    EXPECT_EQ(status_of("GET", "/", {{"host", std::string(host)}}), 200U) << host;
  }
  auto others = protocol::split(
      "evil.example evil.example:7602 localhost.evil.example 127.0.0.1.evil.example:7602"
      " 192.168.1.5:7602 [2001:db8::1]:7602 0.0.0.0:7602 localhost.:7602 2130706433 127.1 0x7f.1"
      " [::ffff:127.0.0.1]:7602 :80 [::1 []:80 [localhost]:80 [127.0.0.1]:80 localhost:80:80"
      " localhost:80@evil.example localhost:x localhost:123456 localhost/evil user@localhost ::1"
      " [::1]evil [::1%25lo]:80",
      ' ');
  others.insert(others.end(), {"", "localhost evil.example", "localhost\t"});
  for (const auto host : others) {
    EXPECT_EQ(status_of("GET", "/", {{"host", std::string(host)}}), 403U) << host;
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

using Header = std::pair<std::string, std::string>;
const Header kHost{"host", "localhost:7602"};
const Header kOrigin{"origin", "http://localhost:7602"};

/// A request to this server.
struct RequestRow {
  std::string method;
  std::string path;
  Headers headers;
  unsigned status;
};

void expect_statuses(const std::vector<RequestRow>& rows) {
  for (const RequestRow& row : rows) {
    EXPECT_EQ(status_of(row.method, row.path, row.headers), row.status)
        << row.method << ' ' << row.path << ' ' << testing::PrintToString(row.headers);
  }
}

TEST(RequestRules, RefuseOtherMethodsAndBodiesWithoutABound) {
  expect_statuses({
      {"GET", "/", {}, 200},  // HTTP/1.0; every browser sends a Host
      {"HEAD", "/", {kHost}, 200},
      {"GET", "/", {kHost, kHost}, 400},
      {"GET", "/", {kHost, {"host", "evil.example"}}, 400},
      {"GET", "/", {kHost, {"content-length", "0"}}, 200},
      {"GET", "/", {kHost, {"content-length", "262145"}}, 413},
      {"GET", "/", {kHost, {"transfer-encoding", "chunked"}}, 413},
      {"POST", "/", {kHost, kOrigin, {"content-length", "262144"}}, 200},
      {"POST", "/", {kHost, kOrigin, {"content-length", "262145"}}, 413},
      {"POST", "/", {kHost, kOrigin, {"content-length", "99999999999999999999"}}, 413},
      {"POST", "/", {kHost, kOrigin, {"content-length", "x"}}, 413},
      {"POST", "/", {kHost, kOrigin, {"transfer-encoding", "chunked"}}, 413},
  });
  for (const std::string method : {"PUT", "DELETE", "OPTIONS", "TRACE", "get", "BREW"}) {
    expect_statuses({{method, "/", {kHost, kOrigin}, 405}});
  }
}

TEST(RequestRules, RefuseWhatPagesOfOtherSitesSend) {
  const Header same{"sec-fetch-site", "same-origin"};
  expect_statuses({
      {"POST", "/", {kHost, kOrigin}, 200},
      {"POST", "/", {kHost, kOrigin, same}, 200},
      {"POST", "/", {kHost}, 403},
      {"POST", "/", {kHost, same}, 403},
      {"POST", "/", {kHost, kOrigin, kOrigin}, 403},
      {"POST", "/", {kHost, kOrigin, {"sec-fetch-site", "none"}}, 403},
      {"POST", "/", {kOrigin}, 403},
      {"GET", "/", {kHost, kOrigin}, 200},
      {"GET", "/", {kHost, same}, 200},
      {"GET", "/", {kHost, {"sec-fetch-site", "none"}}, 200},  // typed into the address bar
  });
  for (const std::string other : {"http://evil.example", "https://localhost:7602", "null",
                                  "http://localhost", "http://localhost:7603", ""}) {
    expect_statuses({{"GET", "/", {kHost, {"origin", other}}, 403},
                     {"POST", "/", {kHost, {"origin", other}}, 403},
                     {"GET", "/", {kHost, kOrigin, {"origin", other}}, 403}});
  }
  for (const std::string site : {"cross-site", "same-site", "", "None", "Cross-Site"}) {
    expect_statuses({{"GET", "/", {kHost, {"sec-fetch-site", site}}, 403},
                     {"POST", "/", {kHost, kOrigin, {"sec-fetch-site", site}}, 403}});
  }
}

TEST(RequestRules, OfOtherSitesOnlyAFollowedLinkToThePageIsAnswered) {
  const Header cross{"sec-fetch-site", "cross-site"};
  const Header tab{"sec-fetch-mode", "navigate"};
  const Header page{"sec-fetch-dest", "document"};
  expect_statuses({
      {"GET", "/", {kHost, cross, tab, page}, 200},
      {"GET", "/", {kHost, {"sec-fetch-site", "same-site"}, tab, page}, 200},
      {"GET", "/?token", {kHost, cross, tab, page}, 403},
      {"GET", "/metrics", {kHost, cross, tab, page}, 403},
      {"HEAD", "/", {kHost, cross, tab, page}, 403},
      {"POST", "/", {kHost, cross, tab, page}, 403},
      {"GET", "/", {{"host", "evil.example"}, cross, tab, page}, 403},
      {"GET", "/", {kHost, cross, tab, page, {"origin", "null"}}, 403},
      {"GET", "/", {kHost, cross, page}, 403},
      {"GET", "/", {kHost, cross, tab}, 403},
      {"GET", "/", {kHost, cross, cross, tab, page}, 403},
      {"GET", "/", {kHost, cross, tab, tab, page}, 403},
      {"GET", "/", {kHost, cross, tab, page, page}, 403},
  });
  for (const std::string mode : {"no-cors", "cors", "nested-navigate"}) {
    expect_statuses({{"GET", "/", {kHost, cross, {"sec-fetch-mode", mode}, page}, 403}});
  }
  for (const std::string target : {"iframe", "embed", "object", "script", "empty"}) {
    expect_statuses({{"GET", "/", {kHost, cross, tab, {"sec-fetch-dest", target}}, 403}});
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
