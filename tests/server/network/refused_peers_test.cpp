// Peers that a port with keys does not let in, by raw TCP: what they cost those who are in.
#include <malloc.h>

#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/network/curve_client.h"
#include "tests/server/network/guarded_network.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

class RefusedPeersTest : public GuardedNetworkTest {
 protected:
  explicit RefusedPeersTest(NetworkLimits limits = {}) : GuardedNetworkTest(limits) {}

  /// A TCP connection and the client's end of CURVE on it.
  struct KeyedPeer {
    KeyedPeer(const std::string& endpoint, CurveClient keys, const char* source)
        : tcp(endpoint, source), curve(keys) {}
    void say_hello() { tcp.send(curve_greeting() + zmtp_command("HELLO", curve.hello())); }
    RawPeer tcp;
    CurveClient curve;
  };
  std::unique_ptr<KeyedPeer> peer(const protocol::KeyPair& own, const protocol::CurveKey& server,
                                  const char* source = kHere) {
    return std::make_unique<KeyedPeer>(network_.endpoint(guarded_), CurveClient(own, server),
                                       source);
  }
  /// What the server has said to it, turning until there are so many bytes.
  std::string heard_by(KeyedPeer& peer, std::size_t bytes) {
    std::string heard;
    turn_until([&] { return (heard += peer.tcp.receive_what_is_there()).size() >= bytes; });
    return heard;
  }
  /// With a WELCOME taken.
  void be_welcomed(KeyedPeer& peer) {
    const std::string heard = heard_by(peer, kWelcomedBytes);
    ASSERT_TRUE(peer.curve.take_welcome(std::string_view(heard).substr(kGreetingBytes + 10)));
  }
  std::unique_ptr<KeyedPeer> admitted(const char* source = kHere) {
    auto admitted = peer(worker_, server_.public_key, source);
    admitted->say_hello();
    be_welcomed(*admitted);
    admitted->tcp.send(command_of("INITIATE", admitted->curve.initiate()));
    static_cast<void>(heard_by(*admitted, 1));
    return admitted;
  }
  std::uint64_t all_refused() const {
    return std::accumulate(
        network_.refusals().begin(), network_.refusals().end(), std::uint64_t{0},
        [](std::uint64_t sum, const RefusalCount& refusal) { return sum + refusal.count; });
  }

  static constexpr const char* kHere = "127.0.0.1";
  static constexpr const char* kElsewhere = "127.0.0.2";
  static constexpr std::size_t kWelcomedBytes = kGreetingBytes + 170;
};

/// Memory that this process has been given, in use.
std::size_t bytes_in_use() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return 0;  // sanitizers keep what was freed
#else
  return mallinfo2().uordblks;
#endif
}

TEST_F(RefusedPeersTest, ThousandsOfRefusedHandshakesLeaveNoMemoryBehindAndAreCounted) {
  constexpr int kRounds = 25;
  constexpr int kAtATime = 80;
  const protocol::KeyPair stranger = protocol::made_key_pair();
  const auto one_round = [&] {
    std::vector<std::unique_ptr<KeyedPeer>> peers;
    for (int i = 0; i < kAtATime; ++i) {
      const bool is_astray = i % 4 == 0;
      peers.push_back(peer(stranger, is_astray ? stranger.public_key : server_.public_key));
      if (i % 4 == 1) {
        peers.back()->tcp.shake_hands();
      } else {
        peers.back()->say_hello();
      }
    }
    for (int i = 0; i < kAtATime; ++i) {
      if (i % 4 >= 2) {
        KeyedPeer& welcomed = *peers[static_cast<std::size_t>(i)];
        be_welcomed(welcomed);
        welcomed.tcp.send(command_of("INITIATE", welcomed.curve.initiate()));
      }
    }
    turn_until([&] { return network_.connections() == 0; });
    static_cast<void>(network_.take_departures());
  };
  one_round();
  one_round();
  const std::size_t before = bytes_in_use();
  for (int round = 2; round < kRounds; ++round) {
    one_round();
  }
  EXPECT_LT(bytes_in_use(), before + 100'000U);
  EXPECT_EQ(network_.held_in_bytes(), 0U);
  EXPECT_EQ(network_.waiting_out_bytes(), 0U);
  EXPECT_TRUE(network_.key_shares().all().empty());
  EXPECT_EQ(refused(RefusalCause::kWrongServerKey), std::uint64_t{kRounds * kAtATime / 4});
  EXPECT_EQ(refused(RefusalCause::kOtherMechanism), std::uint64_t{kRounds * kAtATime / 4});
  EXPECT_EQ(refused(RefusalCause::kUnknownKey), std::uint64_t{kRounds * kAtATime / 2});
  EXPECT_THAT(network_.refusals()[0].last_address, HasSubstr("127.0.0.1:"));
}

TEST_F(RefusedPeersTest, WhoIsInIsServedBetweenTheHandshakesOfAFlood) {
  constexpr std::size_t kFlood = 200;
  const auto modest = admitted();
  std::vector<std::unique_ptr<KeyedPeer>> flood;
  for (std::size_t i = 0; i < kFlood; ++i) {
    flood.push_back(peer(worker_, server_.public_key));
  }
  turn_until([&] { return network_.connections() == kFlood + 1; });
  for (const auto& peer : flood) {
    peer->say_hello();
  }
  const std::string first = modest->curve.sealed("first");
  modest->tcp.send(first + modest->curve.sealed("second"));
  std::vector<std::string> bodies;
  turn_until([&] {
    while (const auto incoming = network_.next(guarded_, anybody)) {
      bodies.push_back(incoming->message.body);
      EXPECT_TRUE(network_.has_more());  // most of the flood still waits
    }
    return bodies.size() >= 2;
  });
  EXPECT_THAT(bodies, testing::ElementsAre("first", "second"));
  std::size_t welcomed = 0;
  for (const auto& peer : flood) {
    be_welcomed(*peer);
    ++welcomed;
  }
  EXPECT_EQ(welcomed, kFlood);
}

class CrowdedNetworkTest : public RefusedPeersTest {
 protected:
  CrowdedNetworkTest() : RefusedPeersTest({.handshakes = kMost}) {
    for (std::size_t i = 0; i < kCrowd; ++i) {
      crowd_.push_back(peer(worker_, server_.public_key));
    }
  }
  void let_in_those_who_said_hello() {
    std::vector<std::string> heard(kCrowd);
    std::size_t let_in = 0;
    turn_until([&] {
      for (std::size_t i = 0; i < kCrowd; ++i) {
        const std::size_t before = heard[i].size();
        heard[i] += crowd_[i]->tcp.receive_what_is_there();
        if (before < kWelcomedBytes && heard[i].size() >= kWelcomedBytes) {
          crowd_[i]->curve.take_welcome(std::string_view(heard[i]).substr(kGreetingBytes + 10));
          crowd_[i]->tcp.send(command_of("INITIATE", crowd_[i]->curve.initiate()));
        }
        let_in += before <= kWelcomedBytes && heard[i].size() > kWelcomedBytes ? 1U : 0U;
      }
      return let_in == kCrowd;
    });
  }

  static constexpr std::size_t kMost = 100;
  static constexpr std::size_t kCrowd = 300;
  std::vector<std::unique_ptr<KeyedPeer>> crowd_;
};

TEST_F(CrowdedNetworkTest, ACrowdOfThoseWhoMayComeInIsLetInWithoutTurningAnyAway) {
  for (const auto& peer : crowd_) {
    peer->say_hello();
  }
  let_in_those_who_said_hello();
  EXPECT_EQ(all_refused(), 0U);
  EXPECT_EQ(network_.connections(), kCrowd);
}

TEST_F(CrowdedNetworkTest, SoIsOneThatIsSlowToSayHello) {
  turn_until([&] { return network_.connections() == kMost; });
  for (int turn = 0; turn < 100; ++turn) {
    network_.collect(now_ms_);
  }
  EXPECT_EQ(network_.connections(), kMost) << "the others wait in the system";
  for (const auto& peer : crowd_) {
    peer->say_hello();
  }
  let_in_those_who_said_hello();
  EXPECT_EQ(all_refused(), 0U);
  EXPECT_EQ(network_.connections(), kCrowd);
}

TEST_F(CrowdedNetworkTest, ThoseWhoSayNothingMakeRoomAfterAPartOfTheirTime) {
  turn_until([&] { return network_.connections() == kMost; });
  now_ms_ += NetworkLimits().handshake_ms / 10;
  turn_until([&] { return refused(RefusalCause::kBound) == kMost; });
  EXPECT_EQ(network_.connections(), kMost);
}

class CrowdOfOneAddressTest : public RefusedPeersTest {
 protected:
  CrowdOfOneAddressTest()
      : RefusedPeersTest({.handshakes = 2 * kMost, .handshakes_of_source = kMost}) {
    for (std::size_t i = 0; i < kCrowd; ++i) {
      crowd_.push_back(peer(protocol::made_key_pair(), server_.public_key, kElsewhere));
    }
    turn_until([&] { return refused(RefusalCause::kBound) == kCrowd - kMost; });
  }

  static constexpr std::size_t kMost = 16;
  static constexpr std::size_t kCrowd = 100;
  std::vector<std::unique_ptr<KeyedPeer>> crowd_;
};

TEST_F(CrowdOfOneAddressTest, NewcomersOfOtherAddressesAreLetInAtOnce) {
  EXPECT_EQ(network_.connections(), kMost);
  const auto newcomer = admitted();
  newcomer->tcp.send(newcomer->curve.sealed("in"));
  EXPECT_EQ(next().message.body, "in");
}

TEST_F(CrowdOfOneAddressTest, OneOfTheNewestMakesRoomSoonForANewcomerOfThatAddress) {
  now_ms_ += NetworkLimits().handshake_ms / 100;
  const auto newcomer = admitted(kElsewhere);
  EXPECT_EQ(network_.connections(), kMost);
  crowd_.front()->say_hello();
  be_welcomed(*crowd_.front());  // the oldest keeps its place
}

TEST_F(CrowdOfOneAddressTest, TheOldestMakesRoomOnceItHasHadItsTime) {
  now_ms_ += NetworkLimits().handshake_ms / 10;
  const auto newcomer = admitted(kElsewhere);
  EXPECT_EQ(crowd_.front()->tcp.receive(), greeting_of("CURVE"));
  EXPECT_EQ(crowd_.front()->tcp.receive(), "");
}

TEST_F(RefusedPeersTest, WhoConnectsAndLeavesWithoutAWordIsNoRefusedPeer) {
  {
    const RawPeer probe(network_.endpoint(guarded_));
    turn_until([&] { return network_.connections() == 1; });
  }
  turn_until([&] { return network_.connections() == 0; });
  EXPECT_EQ(all_refused(), 0U);
}

TEST_F(RefusedPeersTest, WhoLeavesAtTheServersGreetingIsOneOfAnotherMechanism) {
  {
    RawPeer plain(network_.endpoint(guarded_));
    plain.send(zmtp_greeting().substr(0, 10));
    turn_until([&] { return network_.connections() == 1; });
    static_cast<void>(plain.receive());
  }
  turn_until([&] { return network_.connections() == 0; });
  EXPECT_EQ(refused(RefusalCause::kOtherMechanism), 1U);
}

TEST_F(RefusedPeersTest, AFloodOfPingsUnderSealDoesNotKeepOthersFromBeingHeard) {
  const auto pinging = admitted();
  std::string pings;
  for (int i = 0; i < 5000; ++i) {
    pings += pinging->curve.sealed(std::string("\x04PING\0\0", 7), 2);
  }
  pinging->tcp.send_what_fits(pings);
  const auto modest = admitted();
  modest->tcp.send(modest->curve.sealed("heard"));
  EXPECT_EQ(next().message.body, "heard");
}

TEST_F(RefusedPeersTest, FramesThatAreNoMessagesAreOpenedAFewAtATimeAndTheRestIsNotForgotten) {
  constexpr std::size_t kPings = 200;
  constexpr std::size_t kPongBytes = 2 + CurveTraffic::kAddedBytes + 5;
  const auto pinging = admitted();
  std::string pings;
  for (std::size_t i = 0; i < kPings; ++i) {
    pings += pinging->curve.sealed(std::string("\x04PING\0\0", 7), 2);
  }
  pinging->tcp.send(pings);
  // Once they have come the system has no news of this peer: only the network knows of them.
  turn_until([&] {
    EXPECT_EQ(network_.next(guarded_, anybody), std::nullopt);
    return network_.has_more();
  });
  std::size_t turns = 1;
  for (; network_.has_more(); ++turns) {
    network_.collect(now_ms_);
    EXPECT_EQ(network_.next(guarded_, anybody), std::nullopt);
  }
  EXPECT_GE(turns, 3U);
  EXPECT_EQ(heard_by(*pinging, kPings * kPongBytes).size(), kPings * kPongBytes);
}

class TightRefusedPeersTest : public RefusedPeersTest {
 protected:
  static constexpr NetworkLimits kLimits{
      .handshake_ms = 100, .handshakes = 5, .held_in_bytes_of_key = 3'000'000};
  TightRefusedPeersTest() : RefusedPeersTest(kLimits) {}
};

TEST_F(TightRefusedPeersTest, AHandshakeThatIsNotFinishedIsEndedAndCounted) {
  const auto silent = peer(worker_, server_.public_key);
  const auto half = peer(worker_, server_.public_key);
  half->say_hello();
  be_welcomed(*half);
  now_ms_ += 1000;
  network_.collect(now_ms_);
  EXPECT_EQ(network_.connections(), 0U);
  EXPECT_EQ(refused(RefusalCause::kTooSlow), 2U);
}

TEST_F(TightRefusedPeersTest, SoManyHandshakesAreUnderWayAndTheOldestMakesRoom) {
  const auto in = admitted();
  std::vector<std::unique_ptr<KeyedPeer>> strangers;
  for (int i = 0; i < 8; ++i) {
    strangers.push_back(peer(worker_, server_.public_key));
    now_ms_ += 10;
    turn_until([&, wanted = std::min(i + 2, 6)] {
      return network_.connections() == static_cast<std::size_t>(wanted) &&
             refused(RefusalCause::kBound) == static_cast<std::uint64_t>(std::max(i - 4, 0));
    });
  }
  strangers.back()->say_hello();
  be_welcomed(*strangers.back());
  in->tcp.send(in->curve.sealed("still in"));
  EXPECT_EQ(next().message.body, "still in");
}

TEST_F(TightRefusedPeersTest, TheConnectionsOfAKeyTogetherHoldNoMoreThanItsShare) {
  const protocol::KeyPair other = protocol::made_key_pair();
  doorkeeper_->admit(other.public_key, "berta");
  const auto modest = admitted();
  modest->tcp.send(modest->curve.sealed(std::string(1000, 'm')));
  const auto greedy = admitted();
  greedy->tcp.send(zmtp_header(16'000'000));
  turn_until([&] {
    greedy->tcp.send_what_fits(std::string(100'000, 'g'));
    EXPECT_LE(network_.held_in_bytes(), kLimits.held_in_bytes_of_key);
    return network_.connections() < 2;
  });
  EXPECT_THAT(network_.take_departures().at(0).reason,
              HasSubstr("the key \"anna\" together hold too much"));
  EXPECT_EQ(next().message.body, std::string(1000, 'm'));
}

}  // namespace
}  // namespace oblique::server
