// Over real sockets of the loopback device, with what sound and hostile peers send.
#include "server/web/http/http_server.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/web/raw_http.h"

namespace oblique::server {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using testing::Not;

/// One that always, or never, has more.
class EndlessStream final : public HttpStream {
 public:
  explicit EndlessStream(bool has_more) : has_more_(has_more) {}
  bool has_news() override { return has_more_; }
  std::string next() override {
    constexpr std::size_t kPart = 100'000;
    return has_more_ ? std::string(kPart, 'x') : std::string();
  }

 private:
  bool has_more_;
};

/// With a clock that moves a nanosecond at each look. Repeats the path that it is asked for; to
/// /wait there is no answer before `is_open`, that to /long has more bytes than fit on their way,
/// and those to /loud and /quiet never end.
class EchoServer {
 public:
  explicit EchoServer(const HttpLimits& limits = {})
      : server_(
            {"127.0.0.1", "*"}, {}, limits,
            [this](const HttpServer::Question& question) -> std::optional<HttpAnswer> {
              slow_ = question.counts->ended_as_slow;
              crowded_ = question.counts->ended_for_others;
              asked_ += question.path == "/wait" || question.path == "/long" ? 1 : 0;
              if (question.path == "/wait" && !is_open_) {
                return std::nullopt;
              }
              if (question.path == "/loud" || question.path == "/quiet") {
                return HttpAnswer{200,
                                  "text/plain",
                                  {},
                                  {},
                                  std::make_shared<EndlessStream>(question.path == "/loud")};
              }
              return HttpAnswer{200, "text/plain",
                                question.path == "/long" ? std::string(kLong, 'x') : question.path};
            },
            rules()) {}

  static constexpr std::size_t kLong = std::size_t{64} << 20U;

  std::string url() const { return server_.url(); }
  void open() {
    is_open_ = true;
    server_.wake();
  }
  void jump(milliseconds time) {
    now_ = now_.load() + time;
    server_.wake();
  }
  std::uint64_t asked() const { return asked_; }
  std::uint64_t slow() const { return slow_; }
  std::uint64_t crowded() const { return crowded_; }
  std::uint64_t gone() const { return gone_; }

 private:
  HttpServer::Rules rules() {
    HttpServer::Rules rules;
    rules.gone = [this](std::uint64_t) { ++gone_; };
    rules.now = [this] { return now_.load() + std::chrono::nanoseconds(++looks_); };
    return rules;
  }

  std::atomic<bool> is_open_ = false;
  std::atomic<std::uint64_t> asked_ = 0;
  std::atomic<std::uint64_t> slow_ = 0;
  std::atomic<std::uint64_t> crowded_ = 0;
  std::atomic<std::uint64_t> gone_ = 0;
  std::atomic<std::int64_t> looks_ = 0;
  std::atomic<std::chrono::steady_clock::time_point> now_{std::chrono::steady_clock::now()};
  HttpServer server_;  // last: its thread uses the others
};

TEST(HttpServer, AnswersBothVersionsAndEndsTheConnection) {
  const EchoServer server;
  const std::string answer = RawHttp(server.url()).ask("GET /a HTTP/1.0\r\n\r\n");
  EXPECT_EQ(status_of_answer(answer), 200);
  EXPECT_EQ(body_of(answer), "/a");
  // The second request on a connection has no answer.
  const std::string both =
      "GET /b HTTP/1.1\r\nHost: localhost\r\n\r\nGET /c HTTP/1.1\r\nHost: localhost\r\n\r\n";
  EXPECT_EQ(body_of(RawHttp(server.url()).ask(both)), "/b");
}

TEST(HttpServer, LeavesTheBodyOutForHead) {
  const EchoServer server;
  const std::string answer =
      RawHttp(server.url()).ask("HEAD /abc HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(status_of_answer(answer), 200);
  EXPECT_THAT(answer, HasSubstr("Content-Length: 4\r\n"));
  EXPECT_EQ(body_of(answer), "");
}

TEST(HttpServer, PassesOverWhatFollowsAQuestionMark) {
  const EchoServer server;
  EXPECT_EQ(body_of(get(server.url(), "/metrics?name[]=x&y=%01")), "/metrics");
}

TEST(HttpServer, KeepsBrowsersFromTakingItForMoreThanItIs) {
  const EchoServer server;
  const std::string answer = get(server.url(), "/");
  EXPECT_THAT(answer, HasSubstr("Content-Security-Policy: default-src 'none'"));
  EXPECT_THAT(answer, HasSubstr("X-Content-Type-Options: nosniff\r\n"));
  EXPECT_THAT(answer, HasSubstr("Cache-Control: no-store\r\n"));
  EXPECT_THAT(answer, Not(HasSubstr("Access-Control-Allow-Origin")));
}

TEST(HttpServer, RefusesInWords) {
  const EchoServer server;
  const auto ask = [&](const std::string& bytes) { return RawHttp(server.url()).ask(bytes); };
  const std::string post =
      ask("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\n\r\nabc");
  EXPECT_EQ(status_of_answer(post), 405);
  EXPECT_THAT(post, HasSubstr("Allow: GET, HEAD\r\n"));
  const std::string rebound = ask("GET / HTTP/1.1\r\nHost: evil.example:7602\r\n\r\n");
  EXPECT_EQ(status_of_answer(rebound), 403);
  EXPECT_THAT(body_of(rebound), HasSubstr("evil.example"));
  EXPECT_EQ(status_of_answer(get(server.url(), "/?a=b%00c")), 400);
  EXPECT_EQ(
      status_of_answer(ask("GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n")),
      400);
  EXPECT_EQ(status_of_answer(ask("GET / HTTP/1.1\r\n\r\n")), 400);
  EXPECT_EQ(status_of_answer(
                ask("GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n\r\n")),
            403);
  EXPECT_EQ(status_of_answer(
                ask("GET / HTTP/1.1\r\nHost: localhost\r\nsec-fetch-site: cross-site\r\n\r\n")),
            403);
  EXPECT_EQ(status_of_answer(
                ask("GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000000\r\n\r\n")),
            413);
  EXPECT_EQ(status_of_answer(
                ask("GET / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n")),
            413);
}

TEST(HttpServer, EndsConnectionsThatSendMoreThanAHead) {
  const EchoServer server;
  for (const std::string& bytes :
       {"GET /" + std::string(1'000'000, 'a') + " HTTP/1.1\r\nHost: localhost\r\n\r\n",
        "GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(1'000'000, 'a') + "\r\n\r\n",
        "GET / HTTP/1.1\r\n" + std::string(1'000'000, 'a')}) {
    RawHttp peer(server.url());
    peer.send(bytes);
    const int status = status_of_answer(peer.read_to_the_end());
    EXPECT_TRUE(status == 0 || (status >= 400 && status < 500)) << status;
  }
  EXPECT_EQ(body_of(get(server.url(), "/after")), "/after");
}

TEST(HttpServer, SurvivesAnyBytes) {
  const EchoServer server;
  std::mt19937 random(7);  // the same bytes in every run
  const std::vector<std::string> stems{"GET / HTTP/1.1\r\nHost: localhost\r\n",
                                       "GET / HTTP/1.1\r\nHost: ",
                                       "GET ",
                                       "",
                                       "GET / HTTP/1.1\r\nContent-Length: ",
                                       "HEAD / HTTP/1.1\r\nHost: localhost\r\nCookie: ",
                                       "GET /%",
                                       "GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"};
  for (int i = 0; i < 400; ++i) {
    std::string bytes = stems.at(random() % stems.size());
    const std::size_t count = random() % 300;
    for (std::size_t k = 0; k < count; ++k) {
      constexpr std::string_view kLikely = "\r\n :/%\0-9\"=;,?#";
      bytes += random() % 3 == 0 ? kLikely.at(random() % kLikely.size())
                                 : static_cast<char>(random() % 256);
    }
    RawHttp peer(server.url());
    peer.send(bytes + (random() % 2 == 0 ? "\r\n\r\n" : ""));
  }
  EXPECT_EQ(body_of(get(server.url(), "/after")), "/after");
}

TEST(HttpServer, ManyWhoSayNothingMakeRoomForOneWhoAsks) {
  EchoServer server;
  std::vector<std::unique_ptr<RawHttp>> slow;
  for (int i = 0; i < 200; ++i) {
    slow.push_back(std::make_unique<RawHttp>(server.url()));
    slow.back()->send("GET / HTTP/1.1\r\nHo");
  }
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(body_of(get(server.url(), "/a")), "/a");
  }
  EXPECT_GE(server.crowded(), 200U - 32U);
  // The first of them is told why.
  EXPECT_THAT(slow.front()->read_to_the_end(), testing::StartsWith("HTTP/1.1 503 "));
}

TEST(HttpServer, AnAddressTakesNoRoomFromAnother) {
  HttpLimits limits;
  limits.connections_of_one_address = 4;
  limits.connections = 8;
  EchoServer server(limits);
  RawHttp patient(server.url(), "127.0.0.9");
  patient.send("GET /patient HTTP/1.1\r\n");
  std::vector<std::unique_ptr<RawHttp>> crowd;
  for (int i = 0; i < 40; ++i) {
    crowd.push_back(
        std::make_unique<RawHttp>(server.url(), "127.0.0." + std::to_string(2 + i % 2)));
    crowd.back()->send("GET ");
  }
  EXPECT_EQ(body_of(get(server.url(), "/a")), "/a");  // of a third address, with eight there
  EXPECT_EQ(body_of(patient.ask("Host: localhost\r\n\r\n")), "/patient");
}

TEST(HttpServer, WhoTakesTooLongIsEnded) {
  EchoServer server;
  RawHttp silent(server.url());
  RawHttp halting(server.url());
  halting.send("GET / HTTP/1.1\r\n");
  RawHttp reading_nothing(server.url());
  reading_nothing.send("GET /long HTTP/1.1\r\nHost: localhost\r\n\r\n");
  while (server.asked() < 1) {
    get(server.url(), "/");
  }
  server.jump(HttpLimits().longest);
  EXPECT_THAT(silent.read_to_the_end(), testing::StartsWith("HTTP/1.1 408 "));
  EXPECT_THAT(halting.read_to_the_end(), testing::StartsWith("HTTP/1.1 408 "));
  while (server.slow() < 3) {
    get(server.url(), "/");
  }
  EXPECT_LT(reading_nothing.read_to_the_end().size(), EchoServer::kLong);
}

TEST(HttpServer, AStreamThatIsNotTakenIsEndedAndAQuietOneIsNot) {
  EchoServer server;
  const std::string rest = " HTTP/1.1\r\nHost: localhost\r\n\r\n";
  RawHttp quiet(server.url());
  quiet.send("GET /quiet" + rest);
  quiet.read_until("\r\n\r\n");
  RawHttp taking(server.url());
  taking.send("GET /loud" + rest);
  taking.read_until("\r\n\r\n");
  RawHttp taking_nothing(server.url());
  taking_nothing.send("GET /loud" + rest);
  std::string some(std::size_t{1} << 20U, '\0');
  while (server.slow() < 1) {
    ASSERT_GT(::recv(taking.number(), some.data(), some.size(), 0), 0) << "it takes what comes";
    get(server.url(), "/");  // after which the server has sent more
    server.jump(HttpLimits().longest / 10);
  }
  EXPECT_FALSE(quiet.has_news()) << "it takes all that there is";
  while (::recv(taking_nothing.number(), some.data(), some.size(), 0) > 0) {
    // What was on its way comes, and then the end.
  }
}

TEST(HttpServer, WhoGoesBeforeTheAnswerIsNoticed) {
  EchoServer server;
  const std::string question = "GET /wait HTTP/1.1\r\nHost: localhost\r\n\r\n";
  RawHttp staying(server.url());
  staying.send(question);
  for (const bool closes : {true, false}) {
    auto going = std::make_unique<RawHttp>(server.url());
    going->send(question);
    const std::uint64_t asked = server.asked();
    while (server.asked() < asked + 4) {
      get(server.url(), "/");
    }
    const std::uint64_t gone = server.gone();
    if (closes) {
      going.reset();
    } else {
      ::shutdown(going->number(), SHUT_WR);
    }
    while (server.gone() == gone) {
      get(server.url(), "/");
    }
  }
  EXPECT_EQ(server.gone(), 2U);
  EXPECT_FALSE(staying.has_news());
}

TEST(HttpServer, WhoWaitsForAnAnswerHoldsUpNobody) {
  EchoServer server;
  std::vector<std::unique_ptr<RawHttp>> waiting;
  for (int i = 0; i < 20; ++i) {
    waiting.push_back(std::make_unique<RawHttp>(server.url()));
    waiting.back()->send("GET /wait HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  while (server.asked() < 20) {
    EXPECT_EQ(body_of(get(server.url(), "/a")), "/a");
  }
  waiting.pop_back();  // one has gone
  EXPECT_FALSE(waiting.front()->has_news());
  server.open();
  for (const auto& peer : waiting) {
    EXPECT_EQ(body_of(peer->read_to_the_end()), "/wait");
  }
}

TEST(HttpServer, EndsAlsoWhileSomeWait) {
  auto server = std::make_unique<EchoServer>();
  RawHttp waiting(server->url());
  waiting.send("GET /wait HTTP/1.1\r\nHost: localhost\r\n\r\n");
  RawHttp silent(server->url());
  while (server->asked() == 0) {
    get(server->url(), "/");
  }
  server.reset();
  EXPECT_EQ(waiting.read_to_the_end(), "");
  EXPECT_EQ(silent.read_to_the_end(), "");
}

TEST(HttpServer, SaysWhichAddressIsTaken) {
  const EchoServer server;
  const std::string url = server.url();
  const std::string port = url.substr(url.rfind(':') + 1);
  try {
    const HttpServer second({"127.0.0.1", port}, {}, {}, {});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("127.0.0.1:" + port));
  }
}

}  // namespace
}  // namespace oblique::server
