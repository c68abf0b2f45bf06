#pragma once

#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <zmq.hpp>

#include "proto/frames.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// A server that answers each request with the result of `answer`. Its destructor ends all
/// connections, as a kill of the process does.
class ScriptedServer {
 public:
  /// Returns the replies to a request; none if the server ignores the request.
  using Answer = std::function<std::vector<std::string>(const protocol::ClientRequest&)>;

  explicit ScriptedServer(Answer answer, const std::string& endpoint = "tcp://127.0.0.1:*")
      : answer_(std::move(answer)), socket_(context_, zmq::socket_type::router) {
    socket_.set(zmq::sockopt::linger, 0);
    socket_.bind(endpoint);
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
      // The destructor has shut down the context, and waits until this thread closes the socket.
      socket_.close();
    }
  }

  Answer answer_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  std::string url_;
  std::thread thread_;
};

/// An empty reply to `request`.
inline protocol::ClientReply reply_to(const protocol::ClientRequest& request) {
  protocol::ClientReply reply;
  reply.set_request_id(request.request_id());
  return reply;
}

}  // namespace oblique::client
