#include "server/web/http/request_rules.h"

#include <set>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

#include "server/web/http/http_address.h"
#include "server/web/http_options.h"

namespace oblique::server {
namespace {

unsigned status_of(const RequestHead& head, const OwnNames& own = {}) {
  const auto refusal = objection_to(head, own);
  return refusal ? refusal->status : 200;
}

RequestHead request_for(const std::string& host) {
  return {"GET", false, {host}, {}, {}};
}

TEST(RequestRules, AHostIsWhatStandsBeforeThePort) {
  EXPECT_EQ(host_without_port("127.0.0.1:7602"), "127.0.0.1");
  EXPECT_EQ(host_without_port("LocalHost"), "localhost");
  EXPECT_EQ(host_without_port("[::1]:7602"), "::1");
  EXPECT_EQ(host_without_port("[::1]"), "::1");
  EXPECT_EQ(host_without_port("localhost:"), "localhost");
  for (const std::string header :
       {"", ":80", "[::1", "[]:80", "[localhost]:80", "[127.0.0.1]:80", "localhost:80:80",
        "localhost:80@evil.example", "localhost:x", "localhost:123456", "localhost evil.example",
        "localhost/evil", "user@localhost", "::1", "localhost\t", "[::1]evil", "[::1%25lo]:80"}) {
    EXPECT_EQ(host_without_port(header), std::nullopt) << header;
  }
}

TEST(RequestRules, OnLoopbackOnlyNamesOfLoopbackAreAnswered) {
  for (const std::string host : {"127.0.0.1:7602", "localhost", "localhost:1", "[::1]:7602",
                                 "127.8.9.10:80", "LOCALHOST:7602"}) {
    EXPECT_EQ(status_of(request_for(host)), 200U) << host;
  }
  for (const std::string host :
       {"evil.example", "evil.example:7602", "localhost.evil.example",
        "127.0.0.1.evil.example:7602", "192.168.1.5:7602", "[2001:db8::1]:7602", "0.0.0.0:7602",
        "localhost.:7602", "2130706433", "127.1", "0x7f.1", "[::ffff:127.0.0.1]:7602"}) {
    EXPECT_EQ(status_of(request_for(host)), 403U) << host;
  }
}

TEST(RequestRules, BeyondLoopbackAnyAddressIsAnsweredAndOnlyNamesThatWereGiven) {
  const OwnNames own{false, {"oblique.lab"}};
  for (const std::string host : {"10.1.2.3:7602", "[2001:db8::1]:7602", "127.0.0.1", "localhost",
                                 "oblique.lab:7602", "Oblique.Lab"}) {
    EXPECT_EQ(status_of(request_for(host), own), 200U) << host;
  }
  EXPECT_EQ(status_of(request_for("evil.example:7602"), own), 403U);
  EXPECT_EQ(status_of(request_for("sub.oblique.lab"), own), 403U);
}

TEST(RequestRules, OneHostOrNone) {
  EXPECT_EQ(status_of({"GET", false, {}, {}, {}}), 200U);  // HTTP/1.0; no browser leaves it out
  EXPECT_EQ(status_of({"GET", false, {"localhost", "localhost"}, {}, {}}), 400U);
  EXPECT_EQ(status_of({"GET", false, {"localhost", "evil.example"}, {}, {}}), 400U);
  EXPECT_EQ(status_of(request_for("")), 400U);
}

TEST(RequestRules, PagesOfOthersGetNothing) {
  const std::string host = "localhost:7602";
  const auto with_origin = [&](const std::string& origin) {
    return status_of({"GET", false, {host}, {origin}, {}});
  };
  EXPECT_EQ(with_origin("http://localhost:7602"), 200U);
  for (const std::string origin : {"http://evil.example", "https://localhost:7602", "null",
                                   "http://localhost", "http://localhost:7603", ""}) {
    EXPECT_EQ(with_origin(origin), 403U) << origin;
  }
  const auto with_site = [&](const std::string& site) {
    return status_of({"GET", false, {host}, {}, {site}});
  };
  EXPECT_EQ(with_site("none"), 200U);  // typed into the address bar
  EXPECT_EQ(with_site("same-origin"), 200U);
  for (const std::string site : {"cross-site", "same-site", "", "None"}) {
    EXPECT_EQ(with_site(site), 403U) << site;
  }
}

TEST(RequestRules, OfOtherSitesOnlyALinkThatIsFollowedIsAnswered) {
  RequestHead link = request_for("localhost:7602");
  link.fetch_sites = {"cross-site"};
  link.fetch_modes = {"navigate"};
  link.fetch_targets = {"document"};
  EXPECT_EQ(status_of(link), 403U) << "nothing may be linked to but what says so";
  link.may_be_linked_to = true;
  EXPECT_EQ(status_of(link), 200U);
  const auto with = [&link](auto change) {
    RequestHead changed = link;
    change(changed);
    return status_of(changed);
  };
  EXPECT_EQ(with([](RequestHead& head) { head.fetch_sites = {"same-site"}; }), 200U);
  EXPECT_EQ(with([](RequestHead& head) { head.hosts = {"evil.example"}; }), 403U);
  EXPECT_EQ(with([](RequestHead& head) { head.method = "HEAD"; }), 403U);
  EXPECT_EQ(with([](RequestHead& head) { head.method = "POST"; }), 403U);
  EXPECT_EQ(with([](RequestHead& head) { head.origins = {"http://evil.example"}; }), 403U);
  EXPECT_EQ(with([](RequestHead& head) { head.origins = {"null"}; }), 403U);
  EXPECT_EQ(with([](RequestHead& head) { head.has_body = true; }), 413U);
  using Words = std::vector<std::string>;
  for (const Words& sites : {Words{""}, Words{"cross-site", "cross-site"}, Words{"Cross-Site"}}) {
    EXPECT_EQ(with([&](RequestHead& head) { head.fetch_sites = sites; }), 403U);
  }
  for (const Words& modes : {Words{}, Words{"no-cors"}, Words{"cors"}, Words{"nested-navigate"},
                             Words{"navigate", "navigate"}}) {
    EXPECT_EQ(with([&](RequestHead& head) { head.fetch_modes = modes; }), 403U);
  }
  for (const Words& targets : {Words{}, Words{"iframe"}, Words{"embed"}, Words{"object"},
                               Words{"script"}, Words{"empty"}, Words{"document", "document"}}) {
    EXPECT_EQ(with([&](RequestHead& head) { head.fetch_targets = targets; }), 403U);
  }
}

TEST(RequestRules, OnlyReadingIsAnswered) {
  EXPECT_EQ(status_of({"HEAD", false, {"localhost"}, {}, {}}), 200U);
  for (const std::string method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "get", "BREW"}) {
    EXPECT_EQ(status_of({method, false, {"localhost"}, {}, {}}), 405U) << method;
  }
  EXPECT_EQ(status_of({"GET", true, {"localhost"}, {}, {}}), 413U);
}

TEST(HttpAddress, IsAddressAndPortOrOff) {
  EXPECT_FALSE(http_address_of("off"));
  const auto text_of = [](const std::string& text) {
    const auto address = http_address_of(text).value();
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
    EXPECT_THROW(http_address_of(text), std::runtime_error) << text;
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
