// The network with keys against sockets of libzmq, which workers and clients use.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.hpp>

#include "proto/frames.h"
#include "proto/socket/limits.h"
#include "tests/server/network/network_fixture.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// A DEALER of libzmq with a monitor of its handshakes.
class Dealer {
 public:
  explicit Dealer(zmq::context_t& context) : socket_(context, zmq::socket_type::dealer) {
    const std::string where = "inproc://monitor" + std::to_string(++monitors_);
    zmq_socket_monitor(socket_.handle(), where.c_str(), ZMQ_EVENT_ALL);
    monitor_ = zmq::socket_t(context, zmq::socket_type::pair);
    monitor_.connect(where);
    monitor_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::maxmsgsize,
                static_cast<std::int64_t>(protocol::kMaxFrameBytes) + protocol::kSealBytes);
  }
  void use_keys(const protocol::KeyPair& own, const protocol::CurveKey& server) {
    socket_.set(zmq::sockopt::curve_publickey, zmq::buffer(own.public_key));
    socket_.set(zmq::sockopt::curve_secretkey, zmq::const_buffer(own.secret_key.data(), kKeyBytes));
    socket_.set(zmq::sockopt::curve_serverkey, zmq::buffer(server));
  }
  zmq::socket_t& socket() { return socket_; }
  void send(const std::string& body) { socket_.send(zmq::buffer(body), zmq::send_flags::dontwait); }
  std::optional<std::string> receive() {
    zmq::message_t message;
    if (!socket_.recv(message, zmq::recv_flags::dontwait)) {
      return std::nullopt;
    }
    return message.to_string();
  }
  /// Events since the last call, with their values.
  std::vector<std::pair<int, int>> events() {
    std::vector<std::pair<int, int>> events;
    zmq::message_t event;
    while (monitor_.recv(event, zmq::recv_flags::dontwait)) {
      const auto* const bytes = static_cast<const char*>(event.data());
      std::uint16_t kind = 0;
      std::uint32_t value = 0;
      std::memcpy(&kind, bytes, sizeof kind);
      std::memcpy(&value, bytes + sizeof kind, sizeof value);
      events.emplace_back(kind, static_cast<int>(value));
      zmq::message_t address;
      static_cast<void>(monitor_.recv(address));
    }
    return events;
  }

 private:
  static inline int monitors_ = 0;
  zmq::socket_t socket_;
  zmq::socket_t monitor_;
};

class LibzmqPeersTest : public NetworkFixture {
 protected:
  std::unique_ptr<Dealer> dealer(const protocol::KeyPair& own, const protocol::CurveKey& server) {
    auto dealer = std::make_unique<Dealer>(context_);
    dealer->use_keys(own, server);
    dealer->socket().connect(network_.endpoint(keyed_));
    return dealer;
  }
  std::unique_ptr<Dealer> worker_dealer() { return dealer(worker_, server_.public_key); }
  std::string reply_to(Dealer& dealer) {
    std::optional<std::string> reply;
    run_until([&] { return (reply = dealer.receive()).has_value(); });
    return reply.value_or("");
  }
  /// Runs the network until the socket reports that its handshake has failed, and how.
  std::pair<int, int> failure_of(Dealer& dealer) {
    std::pair<int, int> failure;
    run_until([&] {
      for (const auto& event : dealer.events()) {
        if (event.first == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH ||
            event.first == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) {
          failure = event;
        }
      }
      return failure.first != 0;
    });
    return failure;
  }

  zmq::context_t context_;
};

TEST_F(LibzmqPeersTest, MessagesOfAllSizesPassBothWaysAndNameTheKey) {
  const auto worker = worker_dealer();
  worker->send("hello");
  const Incoming incoming = next(keyed_);
  EXPECT_EQ(incoming.body, "hello");
  ASSERT_NE(incoming.key, nullptr);
  EXPECT_EQ(incoming.key->name, "anna");
  EXPECT_EQ(incoming.key->role, protocol::Role::kWorker);
  for (const std::size_t bytes : std::initializer_list<std::size_t>{
           0, 1, 222, 223, 255, 256, 100'000, protocol::kMaxFrameBytes}) {
    const std::string reply(bytes, 'r');
    EXPECT_NE(network_.send(incoming.identity, reply), Delivery::kGone);
    EXPECT_EQ(reply_to(*worker), reply);
    worker->send(reply);
    EXPECT_EQ(next(keyed_).body, reply);
  }
}

TEST_F(LibzmqPeersTest, RefusedSocketsReportWhy) {
  const protocol::KeyPair stranger = protocol::made_key_pair();
  EXPECT_EQ(failure_of(*dealer(stranger, server_.public_key)),
            std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 400));
  EXPECT_EQ(failure_of(*dealer(worker_, stranger.public_key)),
            std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 500));
  EXPECT_EQ(refused(RefusalCause::kUnknownKey), 1U);
  EXPECT_EQ(refused(RefusalCause::kWrongServerKey), 1U);

  const std::pair other_mechanism(ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL,
                                  ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH);
  Dealer plain(context_);
  plain.socket().connect(network_.endpoint(keyed_));
  EXPECT_EQ(failure_of(plain), other_mechanism);
  Dealer keyed(context_);
  keyed.use_keys(worker_, server_.public_key);
  keyed.socket().connect(network_.endpoint(open_));
  EXPECT_EQ(failure_of(keyed), other_mechanism);
  run_until([&] { return refused(RefusalCause::kOtherMechanism) == 2; });
}

TEST_F(LibzmqPeersTest, ARevokedKeyEndsItsConnectionAtOnceWithAllThatItSent) {
  const protocol::KeyPair other = protocol::made_key_pair();
  authenticator_->add(other.public_key, "berta");
  const auto revoked = worker_dealer();
  const auto staying = dealer(other, server_.public_key);
  revoked->send("first");
  staying->send("first");
  const Incoming from_one = next(keyed_);
  const Incoming from_other = next(keyed_);
  revoked->send("too late");
  run_until([&] { return network_.held_in_bytes() > 0; });
  authenticator_->revoke(worker_.public_key);
  network_.admission_changed();
  EXPECT_EQ(network_.connections(), 1U);
  EXPECT_EQ(network_.next(keyed_, anybody), std::nullopt);
  EXPECT_EQ(refused(RefusalCause::kRevokedKey), 1U);
  const auto disconnects = network_.take_disconnects();
  ASSERT_EQ(disconnects.size(), 1U);
  const bool one_is_revoked = from_one.key->name == "anna";
  EXPECT_EQ(disconnects[0].identity, (one_is_revoked ? from_one : from_other).identity);
  EXPECT_EQ(failure_of(*revoked), std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 400));  // and back
  staying->send("still there");
  EXPECT_EQ(next(keyed_).body, "still there");
}

}  // namespace
}  // namespace oblique::server
