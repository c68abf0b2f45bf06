// The network against raw TCP connections, turned by hand.
#include "server/network/network.h"

#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/network/raw_peer.h"
#include "tests/server/network/turning.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

class NetworkTest : public testing::Test {
 protected:
  explicit NetworkTest(NetworkLimits limits = {}) : network_(limits) {
    network_.listen("127.0.0.1", "*");
    network_.listen("127.0.0.1", "*");
  }

  std::unique_ptr<RawPeer> peer(Network::Port port = 0) {
    auto peer = std::make_unique<RawPeer>(network_.endpoint(port));
    peer->shake_hands();
    return peer;
  }
  /// Turns until `done`; a network that never gets there fails the test.
  template <typename Done>
  void turn_until(const Done& done) {
    ASSERT_TRUE(server::turn_until(network_, now_ms_, done));
  }
  Incoming next(Network::Port port = 0) {
    std::optional<Incoming> incoming;
    network_.collect(now_ms_);
    turn_until([&] { return (incoming = network_.next(port, anybody)).has_value(); });
    return incoming ? std::move(*incoming) : Incoming{};
  }
  static bool anybody(const std::string&) { return true; }

  std::int64_t now_ms_ = 1000;
  Network network_;
};

TEST_F(NetworkTest, PeersTakeTurnsHoweverMuchOneSends) {
  const auto flood = peer();
  for (int i = 0; i < 1000; ++i) {
    flood->send(zmtp_frame("flood"));
  }
  EXPECT_EQ(next().message.body, "flood");
  RawPeer modest(network_.endpoint(0));
  // In one packet, so that all of it has come when the server answers with its own READY.
  modest.send(zmtp_greeting() + zmtp_ready("DEALER") + zmtp_frame("first") + zmtp_frame("second"));
  std::size_t heard = 0;
  turn_until([&] {
    heard += modest.receive_what_is_there().size();
    return heard > zmtp_greeting().size();
  });
  std::vector<std::string> bodies;
  while (bodies.size() < 200 && (bodies.empty() || bodies.back() != "second")) {
    bodies.push_back(next().message.body);
  }
  const auto first = std::find(bodies.begin(), bodies.end(), "first");
  ASSERT_NE(first, bodies.end());
  EXPECT_LE(std::find(first, bodies.end(), "second") - first, 2);
}

TEST_F(NetworkTest, APeerThatIsNotServedIsReadNoFurther) {
  const auto flood = peer();
  const std::string frame = zmtp_frame(std::string(1 << 20, 'x'));
  std::size_t sent = 0;
  for (int i = 0; i < 300; ++i) {
    sent += flood->send_what_fits(frame);
    network_.collect(now_ms_);
    EXPECT_LT(network_.held_in_bytes(), 4U << 20U);
  }
  EXPECT_LT(sent, 64U << 20U);
  EXPECT_EQ(network_.next(0, [](const std::string&) { return false; }), std::nullopt);
  EXPECT_EQ(network_.next(1, anybody), std::nullopt);
}

TEST(ManyPeers, ThatDeliverMoreThanIsTakenAreReadNoFurtherAndLoseNothing) {
  constexpr std::size_t kPause = 1'000'000;
  constexpr std::size_t kMessage = 60'000;
  constexpr int kPeers = 40;
  Network network({.held_in_bytes = 3'000'000, .held_in_to_pause_bytes = kPause});
  const Network::Port port = network.listen("127.0.0.1", "*");
  std::vector<std::unique_ptr<RawPeer>> peers;
  std::size_t sent = 0;
  for (int i = 0; i < kPeers; ++i) {
    peers.push_back(std::make_unique<RawPeer>(network.endpoint(port)));
    peers.back()->send(zmtp_greeting() + zmtp_ready("DEALER"));
    sent += zmtp_frame(std::string(kMessage, 'x')).size();
    peers.back()->send(zmtp_frame(std::string(kMessage, 'x')));
  }
  const auto anyone = [](const std::string&) { return true; };
  std::size_t most = 0;
  const auto see = [&] { return most = std::max(most, network.held_in_bytes()); };
  // Nothing is taken before so much is held.
  EXPECT_TRUE(turn_until(network, 0, [&] { return see() >= kPause; }));
  for (int turn = 0; turn < 100; ++turn) {
    network.collect(0);
    see();
  }
  int taken = 0;
  EXPECT_TRUE(turn_until(network, 0, [&] {
    see();
    taken += network.next(port, anyone) ? 1 : 0;
    return taken == kPeers;
  }));
  EXPECT_TRUE(network.take_departures().empty());
  EXPECT_LT(most, kPause + 4 * kMessage);
  EXPECT_GT(sent, 2 * kPause);
}

TEST_F(NetworkTest, WhatAPeerSentBeforeItLeftIsTaken) {
  auto leaving = peer();
  leaving->send(zmtp_frame("first") + zmtp_frame("second") + zmtp_frame("last"));
  leaving.reset();
  EXPECT_EQ(next().message.body, "first");
  EXPECT_EQ(next().message.body, "second");
  const Incoming last = next();
  EXPECT_EQ(last.message.body, "last");
  turn_until([&] { return network_.connections() == 0; });
  EXPECT_EQ(network_.send(last.identity, "late"), Delivery::kGone);
  EXPECT_EQ(network_.held_in_bytes(), 0U);
}

TEST_F(NetworkTest, APeerIsToldOfOnceWhenItHasGone) {
  auto leaving = peer();
  leaving->send(zmtp_frame("hello"));
  const std::string identity = next().identity;
  leaving.reset();
  turn_until([&] { return network_.connections() == 0; });
  const auto departures = network_.take_departures();
  ASSERT_EQ(departures.size(), 1U);
  EXPECT_EQ(departures[0].identity, identity);
  EXPECT_EQ(departures[0].reason, "");
}

TEST_F(NetworkTest, APeerWhoseMessageIsComingInHasSomethingUnheardUntilItStops) {
  const auto slow = peer();
  slow->send(zmtp_frame("hello"));
  const std::string identity = next().identity;
  now_ms_ += 5000;
  network_.collect(now_ms_);
  EXPECT_FALSE(network_.has_unheard(identity));
  const std::string frame = zmtp_frame(std::string(1 << 20, 'x'));
  slow->send(frame.substr(0, 100));
  turn_until([&] { return network_.has_unheard(identity); });
  now_ms_ += 5000;
  network_.collect(now_ms_);
  EXPECT_FALSE(network_.has_unheard(identity));
}

TEST_F(NetworkTest, WhoSpeaksAnotherProtocolIsMadeToLeave) {
  RawPeer stranger(network_.endpoint(0));
  stranger.send("GET / HTTP/1.1\r\n\r\n");
  turn_until([&] { return !network_.take_departures().empty(); });
  stranger.await_end();
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
};

TEST_F(TightNetworkTest, APeerThatReadsNothingIsBusyAndThenMadeToLeave) {
  const auto idle = peer();
  idle->send(zmtp_frame("ask"));
  const std::string identity = next().identity;
  const std::string reply(1'000'000, 'r');
  bool was_busy = false;
  Delivery delivery = Delivery::kSent;
  for (int i = 0; i < 100 && delivery != Delivery::kGone; ++i) {
    delivery = network_.send(identity, reply);
    was_busy = was_busy || (delivery == Delivery::kBusy && network_.is_busy(identity));
    EXPECT_LT(network_.waiting_out_bytes(), 11'100'000U);
  }
  EXPECT_TRUE(was_busy);
  EXPECT_EQ(delivery, Delivery::kGone);
  EXPECT_THAT(network_.take_departures().at(0).reason, HasSubstr("unread"));
  EXPECT_EQ(network_.waiting_out_bytes(), 0U);
}

TEST_F(TightNetworkTest, APeerThatReadsNoAnswersToItsPingsIsMadeToLeave) {
  const auto silent = peer();
  std::string pings;
  for (int i = 0; i < 1000; ++i) {
    pings += zmtp_ping(std::string(16, 'p'));
  }
  bool has_left = false;
  for (int i = 0; i < 100'000 && !has_left; ++i) {
    silent->flood(pings);
    network_.collect(now_ms_);
    EXPECT_LT(network_.waiting_out_bytes(), 11'000'000U);
    has_left = !network_.take_departures().empty();
  }
  EXPECT_TRUE(has_left);
}

TEST_F(TightNetworkTest, APeerThatReadsAgainIsBusyNoMore) {
  const auto slow = peer();
  slow->send(zmtp_frame("ask"));
  const std::string identity = next().identity;
  const std::string reply(1'000'000, 'r');
  while (network_.send(identity, reply) != Delivery::kBusy) {
  }
  turn_until([&] {
    static_cast<void>(slow->receive());
    return network_.waiting_out_bytes() == 0;
  });
  EXPECT_FALSE(network_.is_busy(identity));
  EXPECT_EQ(network_.send(identity, "and on"), Delivery::kSent);
}

TEST_F(TightNetworkTest, TogetherPeersLeaveNoMoreUnreadThanAllMay) {
  std::vector<std::unique_ptr<RawPeer>> peers;
  std::vector<std::string> identities;
  for (int i = 0; i < 3; ++i) {
    peers.push_back(peer());
    peers.back()->send(zmtp_frame("ask"));
    identities.push_back(next().identity);
  }
  const std::string reply(1'000'000, 'r');
  for (int i = 0; i < 13; ++i) {
    for (const std::string& identity : identities) {
      network_.send(identity, reply);
    }
    network_.collect(now_ms_);
    EXPECT_LE(network_.waiting_out_bytes(), kLimits.all_waiting_out_bytes);
  }
  EXPECT_FALSE(network_.take_departures().empty());
}

TEST_F(TightNetworkTest, TogetherPeersHoldNoMoreThanAllMayAndTheLargestGoes) {
  const auto modest = peer();
  modest->send(zmtp_frame(std::string(1000, 'm')));
  const auto greedy = peer();
  greedy->send(zmtp_header(16'000'000) + std::string(100'000, 'g'));
  turn_until([&] {
    greedy->send_what_fits(std::string(100'000, 'g'));
    EXPECT_LE(network_.held_in_bytes(), kLimits.held_in_bytes);
    return !network_.take_departures().empty();
  });
  EXPECT_EQ(network_.connections(), 1U);
  EXPECT_EQ(next().message.body, std::string(1000, 'm'));
}

TEST_F(TightNetworkTest, TheQuietestConnectionMakesRoomAndAStormFindsNone) {
  const auto quiet = peer();
  quiet->send(zmtp_frame("quiet"));
  const std::string identity = next().identity;
  now_ms_ += 60;
  std::vector<std::unique_ptr<RawPeer>> at_work;
  for (const char* name : {"second", "third", "fourth"}) {
    at_work.push_back(peer());
    at_work.back()->send(zmtp_frame(name));
    EXPECT_EQ(next().message.body, name);
  }
  EXPECT_EQ(network_.connections(), 3U);
  EXPECT_EQ(network_.send(identity, "late"), Delivery::kGone);
  // All of them have just spoken.
  RawPeer refused(network_.endpoint(0));
  constexpr auto kBound = static_cast<std::size_t>(RefusalCause::kBound);
  turn_until([&] { return network_.refusals().at(kBound).count == 1; });
  EXPECT_EQ(network_.connections(), 3U);
  EXPECT_EQ(refused.receive(), "");
}

TEST_F(TightNetworkTest, StrangersMakeRoomForEachOtherAndNotWhoIsAtWork) {
  const auto quiet = peer();
  quiet->send(zmtp_frame("quiet"));
  const std::string identity = next().identity;
  now_ms_ += 60;
  std::vector<std::unique_ptr<RawPeer>> storm;
  for (int i = 0; i < 30; ++i) {
    storm.push_back(std::make_unique<RawPeer>(network_.endpoint(0)));
    network_.collect(now_ms_);
  }
  std::size_t departures = 0;
  turn_until([&] { return (departures += network_.take_departures().size()) == 28U; });
  EXPECT_EQ(network_.connections(), 3U);
  EXPECT_EQ(network_.send(identity, "still there"), Delivery::kSent);
}

TEST_F(TightNetworkTest, AHandshakeThatIsNotFinishedEndsTheConnection) {
  RawPeer silent(network_.endpoint(0));
  turn_until([&] { return network_.connections() == 1; });
  now_ms_ += 1000;
  network_.collect(now_ms_);
  EXPECT_EQ(network_.connections(), 0U);
}

}  // namespace
}  // namespace oblique::server
