// The network and its bounds, against raw TCP connections without keys.
#include "server/network/network.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/network/network_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

class NetworkTest : public NetworkFixture {
 protected:
  explicit NetworkTest(NetworkLimits limits = {}) : NetworkFixture(limits) {}

  Incoming next() { return NetworkFixture::next(open_); }
  /// The identity of a peer that has sent a message, which is taken.
  std::string identity_of(RawPeer& peer) {
    peer.send(zmtp_frame("hello"));
    return next().identity;
  }
};

TEST_F(NetworkTest, PeersTakeTurnsHoweverMuchOneSends) {
  const auto flood = open_peer();
  for (int i = 0; i < 1000; ++i) {
    flood->send(zmtp_frame("flood"));
  }
  EXPECT_EQ(next().body, "flood");
  RawPeer modest(network_.endpoint(open_));
  // In one packet, so that all of it has come when the server answers with its own READY.
  modest.send(zmtp_greeting() + zmtp_ready("DEALER") + zmtp_frame("first") + zmtp_frame("second"));
  std::size_t received = 0;
  run_until([&] {
    received += modest.receive_what_is_there().size();
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

TEST_F(NetworkTest, APeerWhoseMessageIsNotTakenIsNotRead) {
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
  EXPECT_EQ(network_.next(keyed_, anybody), std::nullopt);
}

TEST_F(NetworkTest, WhatAPeerSentBeforeItLeftIsTaken) {
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
}

TEST_F(NetworkTest, MoreThanOneReadThatAPeerSentBeforeItLeftIsTaken) {
  auto leaving = open_peer();
  std::size_t received = 0;  // what it left unread would cut off what it sends
  run_until([&] {
    received += leaving->receive_what_is_there().size();
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

TEST_F(NetworkTest, TheEndOfAConnectionIsReportedOnce) {
  const auto leaving = open_peer();
  const std::string identity = identity_of(*leaving);
  leaving->reset();
  run_until([&] { return network_.connections() == 0; });
  const auto disconnects = network_.take_disconnects();
  ASSERT_EQ(disconnects.size(), 1U);
  EXPECT_EQ(disconnects[0].identity, identity);
  EXPECT_EQ(disconnects[0].reason, "");
}

TEST_F(NetworkTest, APeerOfAnotherProtocolAndOneWithSeveralFramesAreDisconnected) {
  RawPeer stranger(network_.endpoint(open_));
  stranger.send("GET / HTTP/1.1\r\n\r\n");
  RawPeer in_parts(network_.endpoint(open_));
  in_parts.shake_hands();
  in_parts.send(zmtp_frame("part", true));
  std::size_t ended = 0;
  run_until([&] { return (ended += network_.take_disconnects().size()) == 2; });
  EXPECT_EQ(refused(RefusalCause::kFaulty), 1U) << "the other one was admitted before";
  stranger.await_end();
  in_parts.await_end();
}

class PausingNetworkTest : public NetworkTest {
 protected:
  static constexpr std::size_t kPause = 1'000'000;
  PausingNetworkTest()
      : NetworkTest({.held_in_bytes = 3'000'000, .held_in_to_pause_bytes = kPause}) {}
};

TEST_F(PausingNetworkTest, PeersThatSendMoreThanIsTakenAreNotReadAndLoseNothing) {
  constexpr std::size_t kMessage = 60'000;
  constexpr int kPeers = 40;
  std::vector<std::unique_ptr<RawPeer>> peers;
  for (int i = 0; i < kPeers; ++i) {
    peers.push_back(open_peer());
    peers.back()->send(zmtp_frame(std::string(kMessage, 'x')));
  }
  std::size_t most = 0;
  const auto update_most = [&] { return most = std::max(most, network_.held_in_bytes()); };
  run_until([&] { return update_most() >= kPause; });
  int taken = 0;
  run_until([&] {
    update_most();
    taken += network_.next(open_, anybody) ? 1 : 0;
    return taken == kPeers;
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
  EXPECT_THAT(network_.take_disconnects().at(0).reason, HasSubstr("unread"));
  EXPECT_EQ(network_.waiting_out_bytes(), 0U);
}

TEST_F(TightNetworkTest, APeerThatReadsAgainIsNoLongerBusy) {
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
  std::vector<std::unique_ptr<RawPeer>> peers;
  std::vector<std::string> identities;
  for (int i = 0; i < 3; ++i) {
    peers.push_back(open_peer());
    identities.push_back(identity_of(*peers.back()));
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

TEST_F(TightNetworkTest, TheSumOfInputIsBoundedAndThePeerWithMostIsDisconnected) {
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

TEST_F(TightNetworkTest, TheQuietestConnectionMakesRoomUnlessAllWereActiveJustNow) {
  const auto quiet = open_peer();
  const std::string identity = identity_of(*quiet);
  now_ms_ += 60;
  std::vector<std::unique_ptr<RawPeer>> at_work;
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

}  // namespace
}  // namespace oblique::server
