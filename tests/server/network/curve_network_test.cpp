// The network with keys against the sockets that workers and clients have, turned by hand.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.hpp>

#include "proto/frames.h"
#include "proto/socket/limits.h"
#include "tests/server/network/guarded_network.h"
#include "tests/server/network/raw_peer.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// A DEALER of libzmq, and what its monitor says of its handshakes.
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

class CurveNetworkTest : public GuardedNetworkTest {
 protected:
  CurveNetworkTest() = default;
  explicit CurveNetworkTest(NetworkLimits limits) : GuardedNetworkTest(limits) {}

  std::unique_ptr<Dealer> dealer(const protocol::KeyPair& own, const protocol::CurveKey& server) {
    auto dealer = std::make_unique<Dealer>(context_);
    dealer->use_keys(own, server);
    dealer->socket().connect(network_.endpoint(guarded_));
    return dealer;
  }
  std::unique_ptr<Dealer> admitted() { return dealer(worker_, server_.public_key); }
  std::string reply_to(Dealer& dealer) {
    std::optional<std::string> reply;
    turn_until([&] { return (reply = dealer.receive()).has_value(); });
    return reply.value_or("");
  }
  /// Turns until the socket was told that its handshake has failed; what it was told.
  std::pair<int, int> failure_of(Dealer& dealer) {
    std::pair<int, int> failure;
    turn_until([&] {
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

TEST_F(CurveNetworkTest, AnAuthorizedPeerIsKnownByItsKeyAndBothAreHeard) {
  const auto worker = admitted();
  const std::string body = "hello" + std::string(1000, 'x');
  worker->send(body);
  const Incoming incoming = next();
  EXPECT_EQ(incoming.message.body, body);
  ASSERT_NE(incoming.holder, nullptr);
  EXPECT_EQ(incoming.holder->name, "anna");
  EXPECT_EQ(incoming.holder->role, protocol::Role::kWorker);
  for (const std::size_t bytes :
       {std::size_t{0}, std::size_t{1}, std::size_t{222}, std::size_t{223}, std::size_t{255},
        std::size_t{256}, std::size_t{100'000}, std::size_t{protocol::kMaxFrameBytes}}) {
    const std::string reply(bytes, 'r');
    EXPECT_NE(network_.send(incoming.identity, reply), Delivery::kGone);
    EXPECT_EQ(reply_to(*worker), reply);
    worker->send(reply);
    EXPECT_EQ(next().message.body, reply);
  }
}

TEST_F(CurveNetworkTest, AKeyThatIsNotAuthorizedIsRefusedAndItsSocketIsTold) {
  const auto stranger = dealer(protocol::made_key_pair(), server_.public_key);
  EXPECT_EQ(failure_of(*stranger), std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 400));
  turn_until([&] { return network_.connections() == 0; });
  EXPECT_EQ(refused(RefusalCause::kUnknownKey), 1U);
  const auto departures = network_.take_departures();
  ASSERT_EQ(departures.size(), 1U);
  EXPECT_EQ(departures[0].refused, RefusalCause::kUnknownKey);
  EXPECT_THAT(departures[0].address, HasSubstr("127.0.0.1:"));
}

TEST_F(CurveNetworkTest, AWrongKeyOfTheServerIsRefusedAndItsSocketIsTold) {
  const auto astray = dealer(worker_, protocol::made_key_pair().public_key);
  EXPECT_EQ(failure_of(*astray), std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 500));
  EXPECT_EQ(refused(RefusalCause::kWrongServerKey), 1U);
}

TEST_F(CurveNetworkTest, APeerWithoutAKeyIsRefusedWhereOneIsNeededAndSeesWhy) {
  Dealer plain(context_);
  plain.socket().connect(network_.endpoint(guarded_));
  EXPECT_EQ(failure_of(plain), std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL,
                                         ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH));
  turn_until([&] { return refused(RefusalCause::kOtherMechanism) == 1; });
}

TEST_F(CurveNetworkTest, APeerWithAKeyIsRefusedWhereTheServerHasNoneAndSeesWhy) {
  Dealer keyed(context_);
  keyed.use_keys(worker_, server_.public_key);
  keyed.socket().connect(network_.endpoint(open_));
  EXPECT_EQ(failure_of(keyed), std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL,
                                         ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH));
  turn_until([&] { return refused(RefusalCause::kOtherMechanism) == 1; });
}

TEST_F(CurveNetworkTest, HeartbeatsOfASocketAreAnsweredUnderSeal) {
  Dealer worker(context_);
  worker.use_keys(worker_, server_.public_key);
  worker.socket().set(zmq::sockopt::heartbeat_ivl, 5);
  worker.socket().set(zmq::sockopt::heartbeat_timeout, 20'000);
  worker.socket().connect(network_.endpoint(guarded_));
  worker.send("first");
  const Incoming first = next();
  for (int i = 0; i < 100; ++i) {  // some twenty heartbeats
    network_.collect(now_ms_);
    EXPECT_EQ(network_.next(guarded_, anybody), std::nullopt);
    usleep(1000);
  }
  worker.send("last");
  EXPECT_EQ(next().identity, first.identity);
  network_.send(first.identity, "reply");
  EXPECT_EQ(reply_to(worker), "reply");
}

TEST_F(CurveNetworkTest, AMessageOfSeveralFramesIsKeptNoFurtherThanThatItCame) {
  const auto worker = admitted();
  worker->socket().send(zmq::str_buffer("part"), zmq::send_flags::sndmore);
  worker->send("and another");
  worker->send("whole");
  EXPECT_FALSE(next().message.is_single);
  EXPECT_EQ(next().message.body, "whole");
}

TEST_F(CurveNetworkTest, WhoseKeyIsRevokedIsEndedAtOnceWithAllThatItSent) {
  const protocol::KeyPair other = protocol::made_key_pair();
  doorkeeper_->admit(other.public_key, "berta");
  const auto revoked = admitted();
  const auto staying = dealer(other, server_.public_key);
  revoked->send("first");
  staying->send("first");
  const Incoming from_one = next();
  const Incoming from_other = next();
  revoked->send("too late");
  turn_until([&] { return network_.held_in_bytes() > 0; });
  doorkeeper_->revoke(worker_.public_key);
  network_.admission_changed();
  EXPECT_EQ(network_.connections(), 1U);
  EXPECT_EQ(network_.next(guarded_, anybody), std::nullopt);
  EXPECT_EQ(refused(RefusalCause::kRevokedKey), 1U);
  const auto departures = network_.take_departures();
  ASSERT_EQ(departures.size(), 1U);
  const bool one_is_revoked = from_one.holder->name == "anna";
  EXPECT_EQ(departures[0].identity, (one_is_revoked ? from_one : from_other).identity);
  EXPECT_EQ(failure_of(*revoked), std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 400));  // and back
  staying->send("still there");
  EXPECT_EQ(next().message.body, "still there");
}

TEST_F(CurveNetworkTest, AKeyThatWasRenamedIsKnownByItsNewNameAtItsNextMessage) {
  const auto worker = admitted();
  worker->send("first");
  EXPECT_EQ(next().holder->name, "anna");
  doorkeeper_->admit(worker_.public_key, "anna2");
  network_.admission_changed();
  EXPECT_EQ(network_.connections(), 1U);
  worker->send("second");
  EXPECT_EQ(next().holder->name, "anna2");
}

class SmallCurveNetworkTest : public CurveNetworkTest {
 protected:
  SmallCurveNetworkTest() : CurveNetworkTest({.connections = 8}) {}
};

TEST_F(SmallCurveNetworkTest, OneKeyLeavesRoomForOthersWhereTheSystemGivesFewConnections) {
  const protocol::KeyPair other = protocol::made_key_pair();
  doorkeeper_->admit(other.public_key, "berta");
  std::vector<std::unique_ptr<Dealer>> dealers;
  for (int i = 0; i < 7; ++i) {
    dealers.push_back(admitted());
    dealers.back()->send("hello");
    next();
  }
  const auto eighth = admitted();
  EXPECT_EQ(failure_of(*eighth), std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 300));
  const auto others = dealer(other, server_.public_key);
  others->send("of another key");
  EXPECT_EQ(next().message.body, "of another key");
}

TEST_F(SmallCurveNetworkTest, WhoHasShownAKeyMakesNoRoomForStrangers) {
  const protocol::KeyPair other = protocol::made_key_pair();
  doorkeeper_->admit(other.public_key, "berta");
  std::vector<std::unique_ptr<Dealer>> dealers;
  for (int i = 0; i < 8; ++i) {
    dealers.push_back(i < 4 ? admitted() : dealer(other, server_.public_key));
    dealers.back()->send("hello");
    next();
  }
  now_ms_ += 60'000;  // all of them are silent for long
  RawPeer stranger(network_.endpoint(guarded_));
  turn_until([&] { return refused(RefusalCause::kBound) == 1; });
  EXPECT_EQ(stranger.receive(), "");
  EXPECT_EQ(network_.connections(), 8U);
}

class TightCurveNetworkTest : public CurveNetworkTest {
 protected:
  static constexpr NetworkLimits kLimits{.handshake_ms = 100,
                                         .handshakes = 5,
                                         .connections_of_key = 2,
                                         .held_in_bytes_of_key = 1'000'000,
                                         .waiting_out_bytes_of_key = 3'000'000};
  TightCurveNetworkTest() : CurveNetworkTest(kLimits) {}
};

TEST_F(TightCurveNetworkTest, AKeyHasSoManyConnectionsAndOthersHaveTheirOwn) {
  const protocol::KeyPair other = protocol::made_key_pair();
  doorkeeper_->admit(other.public_key, "berta");
  std::vector<std::unique_ptr<Dealer>> dealers;
  for (int i = 0; i < 2; ++i) {
    dealers.push_back(admitted());
    dealers.back()->send("hello");
    next();
  }
  const auto third = admitted();
  EXPECT_EQ(failure_of(*third), std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 300));
  EXPECT_EQ(refused(RefusalCause::kBound), 1U);
  EXPECT_THAT(network_.take_departures().at(0).reason,
              testing::AllOf(HasSubstr("\"anna\""), HasSubstr("2 connections")));
  const auto others = dealer(other, server_.public_key);
  others->send("of another key");
  EXPECT_EQ(next().message.body, "of another key");
  dealers.pop_back();
  turn_until([&] { return network_.connections() == 2; });
  const auto again = admitted();
  again->send("there is room again");
  EXPECT_EQ(next().message.body, "there is room again");
}

TEST_F(TightCurveNetworkTest, TheConnectionsOfAKeyTogetherLeaveNoMoreUnreadThanItsShare) {
  std::vector<std::unique_ptr<Dealer>> dealers;
  std::vector<std::string> identities;
  for (int i = 0; i < 2; ++i) {
    dealers.push_back(std::make_unique<Dealer>(context_));
    dealers.back()->use_keys(worker_, server_.public_key);
    dealers.back()->socket().set(zmq::sockopt::rcvhwm, 1);
    dealers.back()->socket().connect(network_.endpoint(guarded_));
    dealers.back()->send("ask");
    identities.push_back(next().identity);
  }
  const std::string reply(1'000'000, 'r');
  std::vector<Departure> departures;
  for (int i = 0; i < 1000 && departures.empty(); ++i) {
    network_.send(identities[static_cast<std::size_t>(i) % 2], reply);
    network_.collect(now_ms_);
    departures = network_.take_departures();
  }
  ASSERT_FALSE(departures.empty());
  EXPECT_THAT(departures[0].reason, HasSubstr("the key \"anna\" together leave too much unread"));
  EXPECT_LE(network_.waiting_out_bytes(), kLimits.waiting_out_bytes_of_key);
}

}  // namespace
}  // namespace oblique::server
