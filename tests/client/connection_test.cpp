#include "client/connection.h"

#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "proto/frames.h"
#include "worker/solver/parameters.h"

namespace oblique::client {
namespace {

// A server that answers each request with what `answer` makes of it, until destroyed.
class ScriptedServer {
 public:
  using Answer = std::function<std::vector<std::string>(const protocol::ClientRequest&)>;

  explicit ScriptedServer(Answer answer)
      : answer_(std::move(answer)), socket_(context_, zmq::socket_type::router) {
    socket_.set(zmq::sockopt::linger, 0);
    socket_.bind("tcp://127.0.0.1:*");
    url_ = socket_.get(zmq::sockopt::last_endpoint);
    thread_ = std::thread([this] { serve(); });
  }
  ~ScriptedServer() {
    context_.shutdown();
    thread_.join();
  }
  ScriptedServer(const ScriptedServer&) = delete;
  ScriptedServer& operator=(const ScriptedServer&) = delete;

  const std::string& url() const { return url_; }

 private:
  void serve() {
    try {
      for (;;) {
        zmq::message_t peer;
        zmq::message_t frame;
        static_cast<void>(socket_.recv(peer));
        static_cast<void>(socket_.recv(frame));
        protocol::ClientRequest request;
        ASSERT_TRUE(protocol::decode(frame.to_string_view(), request));
        for (const auto& reply : answer_(request)) {
          socket_.send(zmq::buffer(peer.to_string()), zmq::send_flags::sndmore);
          socket_.send(zmq::buffer(reply));
        }
      }
    } catch (const zmq::error_t&) {
      // The context was shut down; it waits until its socket is closed.
      socket_.close();
    }
  }

  Answer answer_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  std::string url_;
  std::thread thread_;
};

protocol::ClientReply reply_to(const protocol::ClientRequest& request) {
  protocol::ClientReply reply;
  reply.set_request_id(request.request_id());
  return reply;
}

ConnectionSettings at(const std::string& url, std::int64_t timeout_ms) {
  return {.server_url = url, .timeout_ms = timeout_ms};
}

constexpr std::int64_t kLong_ms = 30'000;

// An address at which nobody listens: bound for a moment, so that it is nobody else's.
std::string dead_address() {
  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::router);
  socket.bind("tcp://127.0.0.1:*");
  return socket.get(zmq::sockopt::last_endpoint);
}

TEST(Connection, SaysWhereItLookedAndWhatToDoWhenNobodyAnswers) {
  const auto url = dead_address();
  Connection connection(at(url, 100));
  try {
    connection.status("");
    FAIL();
  } catch (const ConnectionError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("no answer from " + url + " within 0.1 s"), std::string::npos)
        << message;
    EXPECT_NE(message.find("oblique-server"), std::string::npos) << message;
    EXPECT_NE(message.find("--server"), std::string::npos) << message;
  }
}

TEST(Connection, RefusesAnAddressThatIsNone) {
  EXPECT_THROW(Connection(at("localhost", 100)), solver::InputError);
}

TEST(Connection, StopsWaitingWhenToldTo) {
  int asked = 0;
  Connection connection(at(dead_address(), kLong_ms), [&asked] { return ++asked < 3; });
  EXPECT_THROW(connection.workers(), Interrupted);
}

TEST(Connection, SendsTheStudyAndReadsTheReply) {
  const ScriptedServer server([](const protocol::ClientRequest& request) {
    auto reply = reply_to(request);
    EXPECT_EQ(request.protocol_version(), protocol::kProtocolVersion);
    EXPECT_EQ(request.submit().name(), "sweep");
    reply.mutable_submit()->set_points(7);
    return std::vector{protocol::encode(reply)};
  });
  Connection connection(at(server.url(), kLong_ms));
  EXPECT_EQ(connection.submit({.name = "sweep", .recipe = {}}).points(), 7U);
}

TEST(Connection, HandsOnTheServersOwnErrors) {
  const ScriptedServer server([](const protocol::ClientRequest& request) {
    auto reply = reply_to(request);
    reply.mutable_error()->set_message("no study called \"x\"");
    return std::vector{protocol::encode(reply)};
  });
  Connection connection(at(server.url(), kLong_ms));
  try {
    connection.change("x", protocol::STUDY_CHANGE_CANCEL);
    FAIL();
  } catch (const ServerError& error) {
    EXPECT_STREQ(error.what(), "no study called \"x\"");
  }
}

TEST(Connection, PassesOverAnswersToEarlierQuestions) {
  const ScriptedServer server([](const protocol::ClientRequest& request) {
    protocol::ClientReply stale;
    stale.set_request_id(request.request_id() + 1000);
    stale.mutable_status()->set_workers(1);
    auto reply = reply_to(request);
    reply.mutable_status()->set_workers(2);
    return std::vector{protocol::encode(stale), protocol::encode(reply)};
  });
  Connection connection(at(server.url(), kLong_ms));
  EXPECT_EQ(connection.status("").workers(), 2U);
}

TEST(Connection, TellsAForeignServerFromOurs) {
  const ScriptedServer server(
      [](const protocol::ClientRequest&) { return std::vector<std::string>{"HTTP/1.1 400"}; });
  Connection connection(at(server.url(), kLong_ms));
  try {
    connection.query("SELECT 1");
    FAIL();
  } catch (const ConnectionError& error) {
    EXPECT_NE(std::string(error.what()).find("does not speak"), std::string::npos);
  }
}

}  // namespace
}  // namespace oblique::client
