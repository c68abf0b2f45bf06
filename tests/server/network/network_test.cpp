// Tests of the network and its limits, with raw TCP connections and sockets of libzmq.
#include "server/network/network.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.hpp>

#include "proto/frames.h"
#include "proto/socket/limits.h"
#include "tests/server/network/curve_client.h"
#include "tests/support/hang_limit.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// A TCP connection with an implementation of the client's side of CURVE.
struct KeyedPeer {
  KeyedPeer(const std::string& endpoint, const CurveClient& keys, const char* source)
      : tcp(endpoint, source), curve(keys) {}
  void say_hello() { tcp.send(curve_greeting() + command_frame("HELLO", curve.hello())); }

  RawPeer tcp;
  CurveClient curve;
};

/// Provides a network with two ports: one requires keys, the other accepts peers without keys.
class NetworkTest : public testing::Test {
 protected:
  explicit NetworkTest(NetworkLimits limits = {}) : network_(limits) {
    keyed_ = network_.listen("127.0.0.1", "*", PortSecurity{server_, authenticator_});
    open_ = network_.listen("127.0.0.1", "*");
    authenticator_.add(worker_.public_key, "anna");
  }

  /// Runs the network until `done` returns true; fails the test after a timeout.
  template <typename Done>
  void run_until(const Done& done) {
    const auto give_up = std::chrono::steady_clock::now() + test::kHangLimit;
    while (!done()) {
      ASSERT_LT(std::chrono::steady_clock::now(), give_up);
      network_.collect(now_ms_);
      if (!network_.has_more()) {
        usleep(1000);
      }
    }
  }
  Incoming next() { return next(open_); }
  Incoming next(Network::Port port) {
    std::optional<Incoming> incoming;
    network_.collect(now_ms_);
    run_until([&] { return (incoming = network_.next(port, any_identity)).has_value(); });
    return incoming ? std::move(*incoming) : Incoming{};
  }
  static bool any_identity(const std::string&) { return true; }
  std::uint64_t refused(RefusalCause cause) const {
    return network_.refusals().at(static_cast<std::size_t>(cause));
  }
  std::uint64_t all_refused() const {
    const auto& counts = network_.refusals();
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  }

  std::unique_ptr<RawPeer> open_peer() {
    auto peer = std::make_unique<RawPeer>(network_.endpoint(open_));
    peer->complete_handshake();
    return peer;
  }
  std::vector<std::unique_ptr<RawPeer>> open_peers(std::size_t count) {
    std::vector<std::unique_ptr<RawPeer>> peers(count);
    std::ranges::generate(peers, [this] { return open_peer(); });
    return peers;
  }
  std::unique_ptr<KeyedPeer> keyed_peer(const protocol::KeyPair& own,
                                        const protocol::CurveKey& server,
                                        const char* source = kHere) {
    return std::make_unique<KeyedPeer>(network_.endpoint(keyed_), CurveClient(own, server), source);
  }
  std::vector<std::unique_ptr<KeyedPeer>> keyed_peers(std::size_t count,
                                                      const char* source = kHere) {
    std::vector<std::unique_ptr<KeyedPeer>> peers(count);
    std::ranges::generate(peers, [&] { return keyed_peer(worker_, server_.public_key, source); });
    return peers;
  }
  /// Runs the network until the peer has received at least `bytes` bytes. Returns all of them.
  std::string received_by(KeyedPeer& peer, std::size_t bytes) {
    std::string received;
    run_until([&] { return (received += peer.tcp.receive_available()).size() >= bytes; });
    return received;
  }
  void take_welcome(KeyedPeer& peer) {
    const std::string received = received_by(peer, kWelcomedBytes);
    ASSERT_TRUE(peer.curve.take_welcome(std::string_view(received).substr(kGreetingBytes + 10)));
  }
  void take_welcome_and_initiate(KeyedPeer& peer) {
    take_welcome(peer);
    peer.tcp.send(command_frame("INITIATE", peer.curve.initiate()));
  }
  std::unique_ptr<KeyedPeer> admitted(const char* source = kHere) {
    auto peer = keyed_peer(worker_, server_.public_key, source);
    peer->say_hello();
    take_welcome_and_initiate(*peer);
    static_cast<void>(received_by(*peer, 1));
    return peer;
  }
  /// Sends a message from a peer without a key. Returns the identity that the peer has got.
  std::string identity_of(RawPeer& peer) {
    peer.send(zmtp_frame("hello"));
    return next().identity;
  }
  void expect_message(KeyedPeer& peer) {
    peer.tcp.send(peer.curve.sealed("a message"));
    EXPECT_EQ(next(keyed_).body, "a message");
  }

  static constexpr const char* kHere = "127.0.0.1";
  static constexpr const char* kElsewhere = "127.0.0.2";
  static constexpr std::size_t kWelcomedBytes = kGreetingBytes + 170;

  std::int64_t now_ms_ = 1000;
  protocol::KeyPair server_ = protocol::generate_key_pair();
  protocol::KeyPair worker_ = protocol::generate_key_pair();
  ListAuthenticator authenticator_;
  Network network_;
  Network::Port keyed_ = 0;
  Network::Port open_ = 0;
};

// ---- Peers without keys -------------------------------------------------------------------------

TEST_F(NetworkTest, PeersTakeTurnsHoweverMuchOneSends) {
  const auto flood = open_peer();
  for (int i = 0; i < 1000; ++i) {
    flood->send(zmtp_frame("flood"));
  }
  EXPECT_EQ(next().body, "flood");
  RawPeer modest(network_.endpoint(open_));
  // One packet contains the handshake and both messages. So both messages have arrived when the
  // server answers with READY.
  modest.send(zmtp_greeting() + zmtp_ready("DEALER") + zmtp_frame("first") + zmtp_frame("second"));
  std::size_t received = 0;
  run_until([&] {
    received += modest.receive_available().size();
    return received > kGreetingBytes;
  });
  std::vector<std::string> bodies;
  while (bodies.size() < 200 && (bodies.empty() || bodies.back() != "second")) {
    bodies.push_back(next().body);
  }
  const auto first = std::find(bodies.begin(), bodies.end(), "first");
  ASSERT_NE(first, bodies.end());
  EXPECT_LE(std::find(first, bodies.end(), "second") - first, 2);
}

TEST_F(NetworkTest, APeerIsNotReadUntilItsLastMessageIsTaken) {
  const auto flood = open_peer();
  const std::string frame = zmtp_frame(std::string(1 << 20, 'x'));
  std::size_t sent = 0;
  for (int i = 0; i < 300; ++i) {
    sent += flood->send_what_fits(frame);
    network_.collect(now_ms_);
    EXPECT_LT(network_.held_in_bytes(), 4U << 20U);
  }
  EXPECT_LT(sent, 64U << 20U);
  EXPECT_EQ(network_.next(open_, [](const std::string&) { return false; }), std::nullopt);
  EXPECT_EQ(network_.next(keyed_, any_identity), std::nullopt);
}

TEST_F(NetworkTest, MessagesSentBeforeADisconnectAreTakenAndTheDisconnectIsReportedOnce) {
  const auto leaving = open_peer();
  leaving->send(zmtp_frame("first") + zmtp_frame("second") + zmtp_frame("last"));
  leaving->reset();
  EXPECT_EQ(next().body, "first");
  EXPECT_EQ(next().body, "second");
  const Incoming last = next();
  EXPECT_EQ(last.body, "last");
  run_until([&] { return network_.connections() == 0; });
  EXPECT_EQ(network_.send(last.identity, "late"), Delivery::kGone);
  EXPECT_EQ(network_.held_in_bytes(), 0U);
  const auto disconnects = network_.take_disconnects();
  ASSERT_EQ(disconnects.size(), 1U);
  EXPECT_EQ(disconnects[0].identity, last.identity);
  EXPECT_EQ(disconnects[0].reason, "");
}

TEST_F(NetworkTest, ManyBytesSentBeforeADisconnectAreTaken) {
  auto leaving = open_peer();
  // The peer reads all input before it disconnects, because closing a socket with unread input
  // discards its output.
  std::size_t received = 0;
  run_until([&] {
    received += leaving->receive_available().size();
    return received == kGreetingBytes + zmtp_ready("ROUTER").size();
  });
  const std::string body(40'000, 'x');
  for (int i = 0; i < 5; ++i) {
    leaving->send(zmtp_frame(body));
  }
  leaving.reset();
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(next().body, body);
  }
  run_until([&] { return network_.connections() == 0; });
}

TEST_F(NetworkTest, PeersOfAnotherProtocolOrWithMessagesOfSeveralFramesAreDisconnected) {
  RawPeer stranger(network_.endpoint(open_));
  stranger.send("GET / HTTP/1.1\r\n\r\n");
  RawPeer in_parts(network_.endpoint(open_));
  in_parts.complete_handshake();
  in_parts.send(zmtp_frame("part", true));
  std::size_t ended = 0;
  run_until([&] { return (ended += network_.take_disconnects().size()) == 2; });
  EXPECT_EQ(refused(RefusalCause::kFaulty), 1U)
      << "a fault after admission does not count as a refused handshake";
  stranger.read_to_the_end();
  in_parts.read_to_the_end();
}

class PausingNetworkTest : public NetworkTest {
 protected:
  static constexpr std::size_t kPause = 1'000'000;
  PausingNetworkTest()
      : NetworkTest({.held_in_bytes = 3'000'000, .held_in_to_pause_bytes = kPause}) {}
};

TEST_F(PausingNetworkTest, PeersThatSendTooFastAreNotReadAndLoseNothing) {
  constexpr std::size_t kMessage = 60'000;
  const auto peers = open_peers(40);
  for (const auto& peer : peers) {
    peer->send(zmtp_frame(std::string(kMessage, 'x')));
  }
  std::size_t most = 0;
  const auto update_most = [&] { return most = std::max(most, network_.held_in_bytes()); };
  run_until([&] { return update_most() >= kPause; });
  std::size_t taken = 0;
  run_until([&] {
    update_most();
    taken += network_.next(open_, any_identity) ? 1U : 0U;
    return taken == peers.size();
  });
  EXPECT_TRUE(network_.take_disconnects().empty());
  EXPECT_LT(most, kPause + 4 * kMessage);
}

class TightNetworkTest : public NetworkTest {
 protected:
  static constexpr NetworkLimits kLimits{.connections = 3,
                                         .held_in_bytes = 3'000'000,
                                         .busy_bytes = 100'000,
                                         .waiting_out_bytes = 10'000'000,
                                         .all_waiting_out_bytes = 15'000'000,
                                         .handshake_ms = 100,
                                         .active_ms = 50};
  TightNetworkTest() : NetworkTest(kLimits) {}

  const std::string reply_ = std::string(1'000'000, 'r');
};

TEST_F(TightNetworkTest, APeerThatReadsNothingIsBusyAndThenDisconnected) {
  const auto idle = open_peer();
  const std::string identity = identity_of(*idle);
  bool was_busy = false;
  Delivery delivery = Delivery::kSent;
  for (int i = 0; i < 100 && delivery != Delivery::kGone; ++i) {
    delivery = network_.send(identity, reply_);
    was_busy = was_busy || (delivery == Delivery::kBusy && network_.is_busy(identity));
    EXPECT_LT(network_.waiting_out_bytes(), 11'100'000U);
  }
  EXPECT_TRUE(was_busy);
  EXPECT_EQ(delivery, Delivery::kGone);
  EXPECT_THAT(network_.take_disconnects().at(0).reason, HasSubstr("does not read"));
  EXPECT_EQ(network_.waiting_out_bytes(), 0U);
}

TEST_F(TightNetworkTest, ABusyPeerThatReadsAgainIsNoLongerBusy) {
  const auto slow = open_peer();
  const std::string identity = identity_of(*slow);
  while (network_.send(identity, reply_) != Delivery::kBusy) {
  }
  run_until([&] {
    static_cast<void>(slow->receive());
    return network_.waiting_out_bytes() == 0;
  });
  EXPECT_FALSE(network_.is_busy(identity));
  EXPECT_EQ(network_.send(identity, "and on"), Delivery::kSent);
}

TEST_F(TightNetworkTest, TheSumOfUnreadOutputIsBounded) {
  const auto peers = open_peers(3);
  std::vector<std::string> identities;
  for (const auto& peer : peers) {
    identities.push_back(identity_of(*peer));
  }
  for (int i = 0; i < 13; ++i) {
    for (const std::string& identity : identities) {
      network_.send(identity, reply_);
    }
    network_.collect(now_ms_);
    EXPECT_LE(network_.waiting_out_bytes(), kLimits.all_waiting_out_bytes);
  }
  EXPECT_FALSE(network_.take_disconnects().empty());
}

TEST_F(TightNetworkTest, TheSumOfInputIsBoundedAndThePeerWithTheMostInputIsDisconnected) {
  const auto modest = open_peer();
  modest->send(zmtp_frame(std::string(1000, 'm')));
  const auto greedy = open_peer();
  greedy->send(message_header(16'000'000) + std::string(100'000, 'g'));
  run_until([&] {
    greedy->send_what_fits(std::string(100'000, 'g'));
    EXPECT_LE(network_.held_in_bytes(), kLimits.held_in_bytes);
    return !network_.take_disconnects().empty();
  });
  EXPECT_EQ(network_.connections(open_), 1U);
  EXPECT_EQ(next().body, std::string(1000, 'm'));
}

TEST_F(TightNetworkTest, TheLongestSilentConnectionIsReplacedUnlessAllAreActive) {
  const auto quiet = open_peer();
  const std::string identity = identity_of(*quiet);
  now_ms_ += 60;
  std::vector<std::unique_ptr<RawPeer>> at_work;
  // Each peer completes its handshake before the next peer connects, because a new peer replaces a
  // peer with an unfinished handshake.
  for (int i = 0; i < 3; ++i) {
    at_work.push_back(open_peer());
    identity_of(*at_work.back());
  }
  EXPECT_EQ(network_.connections(), 3U);
  EXPECT_EQ(network_.send(identity, "late"), Delivery::kGone);
  RawPeer newcomer(network_.endpoint(open_));
  run_until([&] { return refused(RefusalCause::kBound) == 1; });
  EXPECT_EQ(network_.connections(), 3U);
  EXPECT_EQ(newcomer.receive(), "");
}

TEST_F(TightNetworkTest, NewHandshakesReplaceEachOtherAndNoAdmittedPeer) {
  const auto quiet = open_peer();
  const std::string identity = identity_of(*quiet);
  now_ms_ += 60;
  std::vector<std::unique_ptr<RawPeer>> storm;
  for (int i = 0; i < 30; ++i) {
    storm.push_back(std::make_unique<RawPeer>(network_.endpoint(open_)));
    network_.collect(now_ms_);
  }
  std::size_t ended = 0;
  run_until([&] { return (ended += network_.take_disconnects().size()) == 28U; });
  EXPECT_EQ(network_.connections(), 3U);
  EXPECT_EQ(network_.send(identity, "still there"), Delivery::kSent);
}

// ---- Peers with keys: refused peers cost others nothing -----------------------------------------

TEST_F(NetworkTest, RefusedHandshakesAreCountedAndLeaveNothingBehind) {
  constexpr std::size_t kPeers = 80;
  const protocol::KeyPair stranger = protocol::generate_key_pair();
  std::vector<std::unique_ptr<KeyedPeer>> peers;
  for (std::size_t i = 0; i < kPeers; ++i) {
    peers.push_back(keyed_peer(stranger, i % 4 == 0 ? stranger.public_key : server_.public_key));
    if (i % 4 == 1) {
      peers.back()->tcp.complete_handshake();
    } else {
      peers.back()->say_hello();
    }
  }
  for (std::size_t i = 0; i < kPeers; ++i) {
    if (i % 4 >= 2) {
      take_welcome_and_initiate(*peers[i]);
    }
  }
  run_until([&] { return network_.connections() == 0; });
  EXPECT_EQ(network_.held_in_bytes(), 0U);
  EXPECT_EQ(network_.waiting_out_bytes(), 0U);
  EXPECT_EQ(refused(RefusalCause::kWrongServerKey), kPeers / 4);
  EXPECT_EQ(refused(RefusalCause::kOtherMechanism), kPeers / 4);
  EXPECT_EQ(refused(RefusalCause::kUnknownKey), kPeers / 2);
  const auto disconnects = network_.take_disconnects();
  ASSERT_EQ(disconnects.size(), kPeers);
  EXPECT_THAT(disconnects[0].address, testing::StartsWith("127.0.0.1:"));
}

TEST_F(NetworkTest, APeerThatDisconnectsAtTheGreetingCountsAsOtherMechanismAndASilentOneDoesNot) {
  {
    RawPeer plain(network_.endpoint(keyed_));
    const RawPeer silent(network_.endpoint(keyed_));
    plain.send(zmtp_greeting().substr(0, 10));
    run_until([&] { return network_.connections() == 2; });
    static_cast<void>(plain.receive());
  }
  run_until([&] { return network_.connections() == 0; });
  EXPECT_EQ(refused(RefusalCause::kOtherMechanism), 1U);
  EXPECT_EQ(all_refused(), 1U);
}

TEST_F(NetworkTest, AdmittedPeersAreServedBetweenTheHandshakesOfAFlood) {
  const auto modest = admitted();
  const auto flood = keyed_peers(200);
  run_until([&] { return network_.connections() == flood.size() + 1; });
  for (const auto& peer : flood) {
    peer->say_hello();
  }
  const std::string first = modest->curve.sealed("first");
  modest->tcp.send(first + modest->curve.sealed("second"));
  std::vector<std::string> bodies;
  run_until([&] {
    while (const auto incoming = network_.next(keyed_, any_identity)) {
      bodies.push_back(incoming->body);
      EXPECT_TRUE(network_.has_more());  // most HELLO commands of the flood are not answered yet
    }
    return bodies.size() >= 2;
  });
  EXPECT_THAT(bodies, ElementsAre("first", "second"));
  for (const auto& peer : flood) {
    take_welcome(*peer);
  }
}

TEST_F(NetworkTest, AChangedNameInTheListAppliesToTheNextMessage) {
  const auto worker = admitted();
  worker->tcp.send(worker->curve.sealed("first"));
  EXPECT_EQ(next(keyed_).key->name, "anna");
  authenticator_.add(worker_.public_key, "anna2");
  network_.admission_changed();
  EXPECT_EQ(network_.connections(), 1U);
  worker->tcp.send(worker->curve.sealed("second"));
  EXPECT_EQ(next(keyed_).key->name, "anna2");
}

TEST_F(NetworkTest, ForgedFramesEndTheirConnectionAndTheNextPeerIsServed) {
  const auto forging = admitted();
  const auto modest = admitted();
  std::string forged = forging->curve.sealed("forged");
  forged.back() = static_cast<char>(~forged.back());
  forging->tcp.send(forged + forged);
  expect_message(*modest);
  run_until([&] {
    EXPECT_EQ(network_.next(keyed_, any_identity), std::nullopt);
    return network_.connections() == 1;
  });
}

class ManyPeersTest : public NetworkTest {
 protected:
  ManyPeersTest() : NetworkTest({.handshakes = kMax}) {
    run_until([&] { return network_.connections() == kMax; });
  }

  static constexpr std::size_t kMax = 100;
  std::vector<std::unique_ptr<KeyedPeer>> peers_ = keyed_peers(300);
};

TEST_F(ManyPeersTest, AllOfManySlowPeersAreAdmitted) {
  for (const auto& peer : peers_) {
    peer->say_hello();
  }
  for (const auto& peer : peers_) {
    take_welcome_and_initiate(*peer);
  }
  for (const auto& peer : peers_) {
    static_cast<void>(received_by(*peer, 1));
  }
  EXPECT_EQ(all_refused(), 0U);
  EXPECT_EQ(network_.connections(), peers_.size());
}

TEST_F(ManyPeersTest, SilentPeersAreReplacedAfterAFractionOfTheHandshakeTimeout) {
  now_ms_ += NetworkLimits().handshake_ms / 10;
  run_until([&] { return refused(RefusalCause::kBound) == kMax; });
  EXPECT_EQ(network_.connections(), kMax);
}

class ManyPeersOfOneAddressTest : public NetworkTest {
 protected:
  static constexpr std::size_t kMax = 16;
  ManyPeersOfOneAddressTest()
      : NetworkTest({.handshakes = 2 * kMax, .handshakes_of_source = kMax}) {}
};

TEST_F(ManyPeersOfOneAddressTest, ManyHandshakesOfOneAddressReplaceEachOtherAndNoOthers) {
  const auto peers = keyed_peers(100, kElsewhere);
  run_until([&] { return refused(RefusalCause::kBound) == peers.size() - kMax; });
  EXPECT_EQ(network_.connections(), kMax);
  const auto other = admitted();
  expect_message(*other);
  now_ms_ += NetworkLimits().handshake_ms / 100;
  const auto second = admitted(kElsewhere);
  EXPECT_EQ(network_.connections(), kMax + 1) << "the peer replaced one of the newest handshakes";
  peers[0]->say_hello();
  take_welcome(*peers[0]);
  now_ms_ += NetworkLimits().handshake_ms / 10;
  // `silent` gets the place among the handshakes that became free when `second` was admitted.
  const auto silent = keyed_peers(1, kElsewhere);
  const auto third = admitted(kElsewhere);
  EXPECT_EQ(peers[0]->tcp.receive(), "") << "the peer replaced the oldest handshake";
}

class TightKeyedNetworkTest : public NetworkTest {
 protected:
  TightKeyedNetworkTest() : NetworkTest({.connections = 7, .handshake_ms = 100}) {}
};

TEST_F(TightKeyedNetworkTest, AnAdmittedPeerIsNeverReplaced) {
  std::vector<std::unique_ptr<KeyedPeer>> peers(7);
  for (auto& peer : peers) {
    peer = admitted();
  }
  now_ms_ += 60'000;  // all peers have been silent for a minute
  RawPeer newcomer(network_.endpoint(keyed_));
  run_until([&] { return refused(RefusalCause::kBound) == 1; });
  EXPECT_EQ(newcomer.receive(), "");
  EXPECT_EQ(network_.connections(), 7U);
}

TEST_F(TightKeyedNetworkTest, ASlowHandshakeIsEndedAndCountedInEachOfItsSteps) {
  const auto peers = keyed_peers(2);  // the second peer stays silent
  peers[0]->say_hello();
  take_welcome(*peers[0]);
  now_ms_ += 1000;
  network_.collect(now_ms_);
  EXPECT_EQ(network_.connections(), 0U);
  EXPECT_EQ(refused(RefusalCause::kTooSlow), 2U);
}

// ---- Sockets of libzmq --------------------------------------------------------------------------

/// A DEALER of libzmq, with optional keys and a monitor of its handshakes.
struct Dealer {
  Dealer(zmq::context_t& context, const std::string& endpoint,
         const protocol::KeyPair* own = nullptr, const protocol::CurveKey* server = nullptr)
      : socket(context, zmq::socket_type::dealer), monitor(context, zmq::socket_type::pair) {
    const std::string where =
        "inproc://" + std::to_string(reinterpret_cast<std::uintptr_t>(socket.handle()));
    zmq_socket_monitor(socket.handle(), where.c_str(), ZMQ_EVENT_ALL);
    monitor.connect(where);
    monitor.set(zmq::sockopt::linger, 0);
    socket.set(zmq::sockopt::linger, 0);
    socket.set(zmq::sockopt::maxmsgsize,
               static_cast<std::int64_t>(protocol::kMaxFrameBytes) + protocol::kSealBytes);
    if (own != nullptr) {
      socket.set(zmq::sockopt::curve_publickey, zmq::buffer(own->public_key));
      socket.set(zmq::sockopt::curve_secretkey,
                 zmq::const_buffer(own->secret_key.data(), kKeyBytes));
      socket.set(zmq::sockopt::curve_serverkey, zmq::buffer(*server));
    }
    socket.connect(endpoint);
  }
  void send(const std::string& body) { socket.send(zmq::buffer(body), zmq::send_flags::dontwait); }
  /// Returns event and value of the next handshake failure that the monitor reports.
  std::optional<std::pair<int, int>> failure() {
    zmq::message_t event;
    while (monitor.recv(event, zmq::recv_flags::dontwait)) {
      std::uint16_t kind = 0;
      std::uint32_t value = 0;
      std::memcpy(&kind, event.data(), sizeof kind);
      std::memcpy(&value, event.data<char>() + sizeof kind, sizeof value);
      static_cast<void>(monitor.recv(event));  // the address
      if (kind == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH || kind == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) {
        return std::pair(int{kind}, static_cast<int>(value));
      }
    }
    return std::nullopt;
  }

  zmq::socket_t socket;
  zmq::socket_t monitor;
};

class LibzmqPeersTest : public NetworkTest {
 protected:
  std::unique_ptr<Dealer> dealer(const protocol::KeyPair& own, const protocol::CurveKey& server) {
    return std::make_unique<Dealer>(context_, network_.endpoint(keyed_), &own, &server);
  }
  /// Runs the network until the socket reports a failed handshake. Returns event and value.
  std::pair<int, int> failure_of(Dealer& dealer) {
    std::optional<std::pair<int, int>> failure;
    run_until([&] { return (failure = dealer.failure()).has_value(); });
    return failure.value_or(std::pair(0, 0));
  }

  zmq::context_t context_;
};

TEST_F(LibzmqPeersTest, MessagesOfAllSizesPassBothWaysWithTheKeysName) {
  const auto worker = dealer(worker_, server_.public_key);
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
    zmq::message_t received;
    run_until([&] { return worker->socket.recv(received, zmq::recv_flags::dontwait).has_value(); });
    EXPECT_EQ(received.to_string(), reply);
    worker->send(reply);
    EXPECT_EQ(next(keyed_).body, reply);
  }
}

TEST_F(LibzmqPeersTest, RefusedSocketsReportWhy) {
  const protocol::KeyPair stranger = protocol::generate_key_pair();
  EXPECT_EQ(failure_of(*dealer(stranger, server_.public_key)),
            std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 400));
  EXPECT_EQ(failure_of(*dealer(worker_, stranger.public_key)),
            std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 500));
  EXPECT_EQ(refused(RefusalCause::kUnknownKey), 1U);
  EXPECT_EQ(refused(RefusalCause::kWrongServerKey), 1U);

  const std::pair other_mechanism(ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL,
                                  ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH);
  Dealer plain(context_, network_.endpoint(keyed_));
  EXPECT_EQ(failure_of(plain), other_mechanism);
  Dealer keyed(context_, network_.endpoint(open_), &worker_, &server_.public_key);
  EXPECT_EQ(failure_of(keyed), other_mechanism);
  run_until([&] { return refused(RefusalCause::kOtherMechanism) == 2; });
}

TEST_F(LibzmqPeersTest, ARevokedKeyEndsItsConnectionAndDropsItsMessages) {
  const protocol::KeyPair other = protocol::generate_key_pair();
  authenticator_.add(other.public_key, "berta");
  const auto revoked = dealer(worker_, server_.public_key);
  const auto staying = dealer(other, server_.public_key);
  revoked->send("first");
  staying->send("first");
  const Incoming from_one = next(keyed_);
  const Incoming from_other = next(keyed_);
  revoked->send("too late");
  run_until([&] { return network_.held_in_bytes() > 0; });
  authenticator_.revoke(worker_.public_key);
  network_.admission_changed();
  EXPECT_EQ(network_.connections(), 1U);
  EXPECT_EQ(network_.next(keyed_, any_identity), std::nullopt);
  EXPECT_EQ(refused(RefusalCause::kRevokedKey), 1U);
  const auto disconnects = network_.take_disconnects();
  ASSERT_EQ(disconnects.size(), 1U);
  const bool one_is_revoked = from_one.key->name == "anna";
  EXPECT_EQ(disconnects[0].identity, (one_is_revoked ? from_one : from_other).identity);
  // it reconnects
  EXPECT_EQ(failure_of(*revoked), std::pair(ZMQ_EVENT_HANDSHAKE_FAILED_AUTH, 400));
  staying->send("still there");
  EXPECT_EQ(next(keyed_).body, "still there");
}

}  // namespace
}  // namespace oblique::server
