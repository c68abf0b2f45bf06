// Tests of the HTTP server on loopback sockets, with correct and malicious peers, and of the rules
// for requests.
#include "server/web/http/http_server.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/resource.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

#include "proto/text.h"
#include "server/web/http/request_rules.h"
#include "server/web/web.h"
#include "tests/server/web/raw_http.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kEnd = " HTTP/1.1\r\nHost: localhost\r\n\r\n";

/// Answers a request with its path. Special paths: /large has a long body; /wait is answered after
/// `open`; /wrong and /broken throw; /loud is an endless stream; /quiet is a stream without data.
class EchoServer {
 public:
  explicit EchoServer(const HttpLimits& limits = {})
      : server_({"127.0.0.1", "*"}, {}, limits,
                {[this](const HttpRequest& request) { return answer(request); },
                 [](const HttpRequest&) { return text_answer(405, "no changes"); },
                 [this] { return std::chrono::steady_clock::time_point() + passed_.load(); }}) {}

  const std::string& url() const { return server_.url(); }
  void open() {
    is_open_ = true;
    server_.wake();
  }
  void let_pass(std::chrono::seconds time) {
    passed_ = passed_.load() + time;
    server_.wake();
  }
  /// Returns the number of pending answers and streams.
  long in_progress() const { return token_.use_count() - 1; }
  static constexpr std::size_t kLargeBytes = 50'000'000;  // more than socket buffers hold
  /// Wakes the server repeatedly, as its owner does, until `count` answers and streams are pending.
  void wake_until_in_progress(long count) {
    while (in_progress() != count) {
      server_.wake();
    }
  }

 private:
  HttpOutcome answer(const HttpRequest& request) {
    const std::string& path = request.path;
    if (path == "/wrong") {
      throw std::invalid_argument("a wrong field");
    }
    if (path == "/broken") {
      throw std::runtime_error("a broken disk");
    }
    HttpAnswer answer = text_answer(200, path);
    if (path == "/large") {
      answer.body.resize(kLargeBytes, 'x');
    }
    if (path == "/wait") {
      return [this, answer, token = token_] {
        return is_open_ ? std::optional(answer) : std::nullopt;
      };
    }
    if (path == "/loud" || path == "/quiet") {
      constexpr std::size_t kPart = 100'000;
      answer.stream = [part = std::string(path == "/loud" ? kPart : 0, 'x'),
                       token = token_]() -> std::optional<std::string> { return part; };
    }
    return answer;
  }

  std::atomic<bool> is_open_ = false;
  std::atomic<std::chrono::seconds> passed_ = std::chrono::seconds(0);
  std::shared_ptr<int> token_ = std::make_shared<int>();
  HttpServer server_;  // the last member, because its thread uses the others
};

/// Returns a peer that has requested a path. The peer has read the answer's head if the path is a
/// stream or /large.
std::unique_ptr<RawHttp> begin(const EchoServer& server, const std::string& path) {
  auto peer = std::make_unique<RawHttp>(server.url());
  peer->send("GET " + path + kEnd);
  if (path == "/quiet" || path == "/loud" || path == "/large") {
    peer->read_until("\r\n\r\n");
  }
  return peer;
}

/// Returns peers that have sent only the beginning of a request.
std::vector<std::unique_ptr<RawHttp>> silent_peers(const EchoServer& server, int count,
                                                   const std::string& from = "127.0.0.1") {
  std::vector<std::unique_ptr<RawHttp>> peers;
  for (int i = 0; i < count; ++i) {
    peers.push_back(std::make_unique<RawHttp>(server.url(), from));
    peers.back()->send("GET ");
  }
  return peers;
}

TEST(HttpServer, AnswersHttp10AndHttp11AndEndsTheConnection) {
  const EchoServer server;
  const std::string answer = RawHttp(server.url()).exchange("GET /a?x=1&y=%01 HTTP/1.0\r\n\r\n");
  EXPECT_EQ(status_of_answer(answer), 200);
  EXPECT_EQ(body_of(answer), "/a\n");
  EXPECT_EQ(body_of(RawHttp(server.url()).exchange("GET /b" + kEnd + "GET /c" + kEnd)), "/b\n");
  const std::string head = RawHttp(server.url()).exchange("HEAD /abc" + kEnd);
  EXPECT_THAT(head, HasSubstr("Content-Length: 5\r\n"));
  EXPECT_EQ(body_of(head), "");
}

TEST(HttpServer, SendsHeadersThatKeepBrowsersFromMisusingAnswers) {
  const EchoServer server;
  for (const std::string path : {"/", "/wrong", "/quiet"}) {
    RawHttp peer(server.url());
    peer.send("GET " + path + kEnd);
    const std::string head = peer.read_until("\r\n\r\n");
    for (const std::string header :
         {"Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; ",
          "frame-ancestors 'none'\r\n", "X-Content-Type-Options: nosniff\r\n",
          "Cache-Control: no-store\r\n", "Referrer-Policy: no-referrer\r\n",
          "Cross-Origin-Resource-Policy: same-origin\r\n",
          "Cross-Origin-Opener-Policy: same-origin\r\n"}) {
      EXPECT_THAT(head, HasSubstr(header)) << path;
    }
    EXPECT_THAT(head, Not(HasSubstr("unsafe"))) << path;
    EXPECT_THAT(head, Not(HasSubstr("Access-Control-Allow-Origin"))) << path;
  }
}

TEST(HttpServer, ARefusalContainsASentence) {
  const EchoServer server;
  const std::string rebound =
      RawHttp(server.url()).exchange("GET / HTTP/1.1\r\nHost: evil.example:7602\r\n\r\n");
  EXPECT_EQ(status_of_answer(rebound), 403);
  EXPECT_THAT(body_of(rebound), HasSubstr("evil.example"));
  EXPECT_EQ(status_of_answer(get(server.url(), "/?a=b%00c")), 400);
  EXPECT_EQ(status_of_answer(RawHttp(server.url()).exchange("GET / HTTP/1.1\r\n\r\n")), 400);
  const std::string post =
      RawHttp(server.url())
          .exchange(
              "POST / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\n"
              "Content-Length: 3\r\n\r\nabc");
  EXPECT_EQ(status_of_answer(post), 405);
  EXPECT_THAT(post, HasSubstr("Allow: GET, HEAD\r\n"));
  const std::string wrong = get(server.url(), "/wrong");
  EXPECT_EQ(status_of_answer(wrong), 400);
  EXPECT_EQ(body_of(wrong), "{\"error\":\"a wrong field\"}\n");
  EXPECT_EQ(status_of_answer(get(server.url(), "/broken")), 500);
}

TEST(HttpServer, EndsConnectionsThatSendMoreThanAHead) {
  const EchoServer server;
  for (const std::string& bytes :
       {"GET /" + std::string(1'000'000, 'a') + kEnd,
        "GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(1'000'000, 'a') + "\r\n\r\n",
        "GET / HTTP/1.1\r\n" + std::string(1'000'000, 'a')}) {
    RawHttp peer(server.url());
    peer.send(bytes);
    const int status = status_of_answer(peer.read_to_the_end());
    EXPECT_TRUE(status == 0 || (status >= 400 && status < 500)) << status;
  }
  EXPECT_EQ(body_of(get(server.url(), "/after")), "/after\n");
}

TEST(HttpServer, SurvivesAnyBytes) {
  const EchoServer server;
  std::mt19937 random(7);  // a fixed seed, so every run sends the same bytes
  const std::vector<std::string> stems{"", "GET /%", "GET / HTTP/1.1\r\nContent-Length: ",
                                       "HEAD / HTTP/1.1\r\nHost: localhost\r\nCookie: ",
                                       "GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"};
  for (int i = 0; i < 400; ++i) {
    std::string bytes = stems.at(random() % stems.size());
    for (auto count = random() % 300; count > 0; --count) {
      constexpr std::string_view kLikely = "\r\n :/%\0-9\"=;,?#";
      bytes += random() % 3 == 0 ? kLikely.at(random() % kLikely.size())
                                 : static_cast<char>(random() % 256);
    }
    RawHttp(server.url()).send(bytes + (random() % 2 == 0 ? "\r\n\r\n" : ""));
  }
  EXPECT_EQ(body_of(get(server.url(), "/after")), "/after\n");
}

TEST(HttpServer, SlowHeadsOfAnyNumberOfAddressesDelayNobody) {
  HttpLimits limits;
  limits.idle = test::kHangLimit;
  limits.connections = 100;
  EchoServer server(limits);
  std::vector<std::unique_ptr<RawHttp>> slow;
  for (unsigned i = 0; i < 3 * limits.connections; ++i) {
    slow.push_back(std::make_unique<RawHttp>(server.url(), "127.0.0." + std::to_string(i % 9 + 1)));
    slow.back()->send("GET / HTTP/1.1\r\n");
    if (i == 0) {
      get(server.url(), "/a");  // this answer shows that the first head was accepted
      server.let_pass(std::chrono::seconds(1));
    }
    if (i % 64 == 63) {
      EXPECT_EQ(body_of(get(server.url(), "/a")), "/a\n") << "after " << i + 1 << " slow heads";
    }
  }
  EXPECT_EQ(slow.front()->read_to_the_end(), "") << "the oldest head has made room";
}

TEST(HttpServer, AFullServerKeepsPendingAnswersAndStreams) {
  HttpLimits limits;
  limits.connections = 4;
  limits.idle = test::kHangLimit;
  EchoServer server(limits);
  const auto waiting = begin(server, "/wait");
  const auto quiet = begin(server, "/quiet");
  server.wake_until_in_progress(2);
  const auto silent = silent_peers(server, 10);
  EXPECT_EQ(body_of(get(server.url(), "/a")), "/a\n");
  EXPECT_EQ(server.in_progress(), 2);
  server.open();
  EXPECT_EQ(body_of(waiting->read_to_the_end()), "/wait\n");
  EXPECT_FALSE(quiet->has_news());
}

TEST(HttpServer, AnswersAgainWhenTooManyConnectionsHaveEnded) {
  HttpLimits limits;
  limits.connections = 4;
  limits.idle = test::kHangLimit;
  const EchoServer server(limits);
  for (int round = 0; round < 3; ++round) {
    silent_peers(server, 10).clear();
    EXPECT_EQ(body_of(get(server.url(), "/a")), "/a\n");
  }
}

TEST(HttpServer, AnIdleConnectionEnds) {
  HttpLimits limits;
  limits.idle = std::chrono::seconds(1);
  EchoServer server(limits);
  RawHttp silent(server.url());
  RawHttp halting(server.url());
  halting.send("GET / HTTP/1.1\r\n");
  const auto quiet = begin(server, "/quiet");
  const auto taking_nothing = begin(server, "/loud");
  silent.read_to_the_end();
  halting.read_to_the_end();
  server.wake_until_in_progress(1);
  EXPECT_FALSE(quiet->has_news()) << "a stream whose client reads everything was ended";
}

TEST(HttpServer, ATooSlowTransferEnds) {
  HttpLimits limits;
  limits.idle = test::kHangLimit;
  EchoServer server(limits);
  const auto waiting = begin(server, "/wait");
  const auto quiet = begin(server, "/quiet");
  server.wake_until_in_progress(2);
  std::vector<std::unique_ptr<RawHttp>> uploading;
  for (int i = 0; i < 2; ++i) {
    uploading.push_back(std::make_unique<RawHttp>(server.url()));
    uploading.back()->send(
        "GET /a HTTP/1.1\r\nHost: localhost\r\nExpect: 100-continue\r\nContent-Length: 8192\r\n"
        "\r\n");
    uploading.back()->read_until("\r\n\r\n");
  }
  const auto large = begin(server, "/large");
  RawHttp halting(server.url());
  halting.send("GET / HTTP/1.1\r\n");
  get(server.url(), "/a");  // this answer shows that all earlier connections were accepted
  server.let_pass(limits.idle);
  EXPECT_EQ(halting.read_to_the_end(), "");
  EXPECT_EQ(body_of(uploading.front()->exchange(std::string(8192, 'x'))), "/a\n");
  uploading.back()->send("x");
  server.let_pass(std::chrono::seconds(2));
  EXPECT_EQ(uploading.back()->read_to_the_end(), "");
  server.let_pass(std::chrono::seconds(EchoServer::kLargeBytes / limits.least_bytes_a_second));
  EXPECT_LT(large->read_to_the_end().size(), EchoServer::kLargeBytes);
  EXPECT_EQ(server.in_progress(), 2);
  EXPECT_FALSE(waiting->has_news());
  EXPECT_FALSE(quiet->has_news());
}

TEST(HttpServer, AClientThatDisconnectsEndsItsPendingAnswerAndItsStream) {
  EchoServer server;
  const auto staying = begin(server, "/wait");
  server.wake_until_in_progress(1);
  for (const std::string path : {"/wait", "/quiet", "/loud"}) {
    auto closing = begin(server, path);
    server.wake_until_in_progress(2);
    closing.reset();
    server.wake_until_in_progress(1);
  }
  // Browsers may close their sending direction before they have received the answer.
  for (const std::string path : {"/wait", "/quiet"}) {
    const auto halving = begin(server, path);
    server.wake_until_in_progress(2);
    ::shutdown(halving->number(), SHUT_WR);
    server.wake_until_in_progress(1);
  }
  EXPECT_FALSE(staying->has_news());
}

TEST(HttpServer, APendingAnswerDelaysNoOther) {
  EchoServer server;
  std::vector<std::unique_ptr<RawHttp>> waiting;
  for (int i = 0; i < 20; ++i) {
    waiting.push_back(begin(server, "/wait"));
  }
  server.wake_until_in_progress(20);
  EXPECT_EQ(body_of(get(server.url(), "/a")), "/a\n");
  EXPECT_FALSE(waiting.front()->has_news());
  server.open();
  for (const auto& peer : waiting) {
    EXPECT_EQ(body_of(peer->read_to_the_end()), "/wait\n");
  }
}

TEST(HttpServer, StreamsAreLimited) {
  HttpLimits limits;
  limits.streams = 2;
  EchoServer server(limits);
  const auto staying = begin(server, "/quiet");
  auto leaving = begin(server, "/quiet");
  EXPECT_EQ(status_of_answer(get(server.url(), "/quiet")), 503);
  EXPECT_EQ(status_of_answer(get(server.url(), "/a")), 200)
      << "streams take no room from other requests";
  leaving.reset();
  server.wake_until_in_progress(1);
  RawHttp next(server.url());
  next.send("GET /quiet" + kEnd);
  EXPECT_EQ(status_of_answer(next.read_until("\r\n\r\n")), 200);
}

TEST(HttpServer, StopsWhileRequestsWait) {
  auto server = std::make_unique<EchoServer>();
  const auto waiting = begin(*server, "/wait");
  const auto streaming = begin(*server, "/quiet");
  RawHttp silent(server->url());
  server->wake_until_in_progress(2);
  server.reset();
  EXPECT_EQ(waiting->read_to_the_end(), "");
  EXPECT_EQ(silent.read_to_the_end(), "");
  EXPECT_EQ(streaming->read_to_the_end(), "");
}

TEST(HttpServer, ReportsAFailureToListenWithoutFreeDescriptors) {
  rlimit usual{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &usual), 0);
  rlimit one = usual;
  {
    const protocol::Descriptor next(::fcntl(0, F_DUPFD_CLOEXEC, 0));
    one.rlim_cur = static_cast<rlim_t>(next.number()) + 1;
  }
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &one), 0);
  std::string fault;
  try {
    const EchoServer server;
  } catch (const std::runtime_error& error) {
    fault = error.what();
  }
  ::setrlimit(RLIMIT_NOFILE, &usual);
  EXPECT_THAT(fault, HasSubstr("cannot listen at http://127.0.0.1:"));
}

// ---- Which requests are refused -----------------------------------------------------------------

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

TEST(RequestRules, OnLoopbackOnlyLoopbackNamesAreAccepted) {
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

TEST(RequestRules, BeyondLoopbackAnyAddressAndTheGivenNamesAreAccepted) {
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

/// A request and its expected status.
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

TEST(RequestRules, RefuseOtherMethodsAndBodiesWithoutALimit) {
  expect_statuses({
      {"GET", "/", {}, 200},  // Host may be missing, as in HTTP/1.0
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

TEST(RequestRules, RefuseRequestsOfOtherSites) {
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
      {"GET", "/", {kHost, {"sec-fetch-site", "none"}}, 200},  // the user typed the address
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

TEST(RequestRules, OtherSitesMayOnlyLinkToThePage) {
  const Header cross{"sec-fetch-site", "cross-site"};
  const Header tab{"sec-fetch-mode", "navigate"};
  const Header page{"sec-fetch-dest", "document"};
  expect_statuses({
      {"GET", "/", {kHost, cross, tab, page}, 200},
      {"GET", "/", {kHost, {"sec-fetch-site", "same-site"}, tab, page}, 200},
      {"GET", "/?token", {kHost, cross, tab, page}, 403},
      {"GET", "/metrics", {kHost, cross, tab, page}, 403},
      {"HEAD", "/", {kHost, cross, tab, page}, 403},
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

TEST(HttpOptions, OnlyTheDefaultAddressMayBeInUseAndNamesAreInLowerCase) {
  EXPECT_EQ(settings_of({}).address.address, "127.0.0.1");
  EXPECT_EQ(settings_of({}).address.port, "7602");
  EXPECT_TRUE(settings_of({}).may_be_missing);
  EXPECT_FALSE(settings_of({"--http", "127.0.0.1:7602"}).may_be_missing);
  const WebSettings settings =
      settings_of({"--http-name", "Oblique.Lab", "--http-name", "oblique-server"});
  EXPECT_EQ(settings.names, (std::set<std::string>{"oblique-server", "oblique.lab"}));
  for (const std::string name : {"oblique.lab:7602", "", "[::1]", "a b"}) {
    EXPECT_THROW(settings_of({"--http-name", name}), std::runtime_error) << name;
  }
}

}  // namespace
}  // namespace oblique::server
