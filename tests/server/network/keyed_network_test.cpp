// Peers at a port with keys, by raw TCP: those who are refused cost the others nothing.
#include <algorithm>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/network/network_fixture.h"

namespace oblique::server {
namespace {

class KeyedNetworkTest : public NetworkFixture {
 protected:
  explicit KeyedNetworkTest(NetworkLimits limits = {}) : NetworkFixture(limits) {}

  std::unique_ptr<KeyedPeer> with_server_key(const char* source = kHere) {
    return keyed_peer(worker_, server_.public_key, source);
  }
  std::uint64_t all_refused() const {
    return std::accumulate(network_.refusals().begin(), network_.refusals().end(),
                           std::uint64_t{0});
  }
  void expect_message(KeyedPeer& peer) {
    peer.tcp.send(peer.curve.sealed("a message"));
    EXPECT_EQ(next(keyed_).body, "a message");
  }
};

TEST_F(KeyedNetworkTest, RefusedHandshakesAreCountedAndLeaveNothingBehind) {
  constexpr std::size_t kPeers = 80;
  const protocol::KeyPair stranger = protocol::made_key_pair();
  std::vector<std::unique_ptr<KeyedPeer>> peers;
  for (std::size_t i = 0; i < kPeers; ++i) {
    peers.push_back(keyed_peer(stranger, i % 4 == 0 ? stranger.public_key : server_.public_key));
    if (i % 4 == 1) {
      peers.back()->tcp.shake_hands();
    } else {
      peers.back()->say_hello();
    }
  }
  for (std::size_t i = 0; i < kPeers; ++i) {
    if (i % 4 >= 2) {
      take_welcome(*peers[i]);
      peers[i]->tcp.send(command_frame("INITIATE", peers[i]->curve.initiate()));
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

TEST_F(KeyedNetworkTest,
       APeerThatLeavesInItsGreetingUsesAnotherMechanismAndASilentOneIsNotRefused) {
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

TEST_F(KeyedNetworkTest, AdmittedPeersAreServedBetweenTheHandshakesOfAFlood) {
  constexpr std::size_t kFlood = 200;
  const auto modest = admitted();
  std::vector<std::unique_ptr<KeyedPeer>> flood;
  for (std::size_t i = 0; i < kFlood; ++i) {
    flood.push_back(with_server_key());
  }
  run_until([&] { return network_.connections() == kFlood + 1; });
  for (const auto& peer : flood) {
    peer->say_hello();
  }
  const std::string first = modest->curve.sealed("first");
  modest->tcp.send(first + modest->curve.sealed("second"));
  std::vector<std::string> bodies;
  run_until([&] {
    while (const auto incoming = network_.next(keyed_, anybody)) {
      bodies.push_back(incoming->body);
      EXPECT_TRUE(network_.has_more());  // most of the flood still waits
    }
    return bodies.size() >= 2;
  });
  EXPECT_THAT(bodies, testing::ElementsAre("first", "second"));
  for (const auto& peer : flood) {
    take_welcome(*peer);
  }
}

TEST_F(KeyedNetworkTest, ANameThatChangesInTheListCountsFromTheNextMessage) {
  const auto worker = admitted();
  worker->tcp.send(worker->curve.sealed("first"));
  EXPECT_EQ(next(keyed_).key->name, "anna");
  authenticator_->add(worker_.public_key, "anna2");
  network_.admission_changed();
  EXPECT_EQ(network_.connections(), 1U);
  worker->tcp.send(worker->curve.sealed("second"));
  EXPECT_EQ(next(keyed_).key->name, "anna2");
}

TEST_F(KeyedNetworkTest, ForgedFramesEndTheirConnectionAndTheNextPeerIsServed) {
  const auto forging = admitted();
  const auto modest = admitted();
  std::string forged = forging->curve.sealed("forged");
  forged.back() = static_cast<char>(~forged.back());
  forging->tcp.send(forged + forged);
  expect_message(*modest);
  run_until([&] {
    EXPECT_EQ(network_.next(keyed_, anybody), std::nullopt);
    return network_.connections() == 1;
  });
}

class CrowdTest : public KeyedNetworkTest {
 protected:
  CrowdTest() : KeyedNetworkTest({.handshakes = kMost}) {
    for (std::size_t i = 0; i < kCrowd; ++i) {
      crowd_.push_back(with_server_key());
    }
  }
  void admit_all() {
    for (const auto& peer : crowd_) {
      peer->say_hello();
    }
    std::vector<std::string> received(kCrowd);
    std::size_t admitted = 0;
    run_until([&] {
      for (std::size_t i = 0; i < kCrowd; ++i) {
        const std::size_t before = received[i].size();
        received[i] += crowd_[i]->tcp.receive_what_is_there();
        if (before < kWelcomedBytes && received[i].size() >= kWelcomedBytes) {
          crowd_[i]->curve.take_welcome(std::string_view(received[i]).substr(kGreetingBytes + 10));
          crowd_[i]->tcp.send(command_frame("INITIATE", crowd_[i]->curve.initiate()));
        }
        admitted += before <= kWelcomedBytes && received[i].size() > kWelcomedBytes ? 1U : 0U;
      }
      return admitted == kCrowd;
    });
    EXPECT_EQ(all_refused(), 0U);
    EXPECT_EQ(network_.connections(), kCrowd);
  }

  static constexpr std::size_t kMost = 100;
  static constexpr std::size_t kCrowd = 300;
  std::vector<std::unique_ptr<KeyedPeer>> crowd_;
};

TEST_F(CrowdTest, AllOfACrowdAreAdmittedAndNobodyIsRefused) {
  admit_all();
}

TEST_F(CrowdTest, SoAreAllOfASlowCrowdWhoseLaterPartWaitsInTheSystem) {
  run_until([&] { return network_.connections() == kMost; });
  admit_all();
}

TEST_F(CrowdTest, SilentPeersMakeRoomAfterAPartOfTheirTime) {
  run_until([&] { return network_.connections() == kMost; });
  now_ms_ += NetworkLimits().handshake_ms / 10;
  run_until([&] { return refused(RefusalCause::kBound) == kMost; });
  EXPECT_EQ(network_.connections(), kMost);
}

class CrowdOfOneAddressTest : public KeyedNetworkTest {
 protected:
  CrowdOfOneAddressTest()
      : KeyedNetworkTest({.handshakes = 2 * kMost, .handshakes_of_source = kMost}) {
    for (std::size_t i = 0; i < kCrowd; ++i) {
      crowd_.push_back(with_server_key(kElsewhere));
    }
    run_until([&] { return refused(RefusalCause::kBound) == kCrowd - kMost; });
  }

  static constexpr std::size_t kMost = 16;
  static constexpr std::size_t kCrowd = 100;
  std::vector<std::unique_ptr<KeyedPeer>> crowd_;
};

TEST_F(CrowdOfOneAddressTest, NewcomersOfOtherAddressesAreAdmittedAtOnce) {
  EXPECT_EQ(network_.connections(), kMost);
  expect_message(*admitted());
}

TEST_F(CrowdOfOneAddressTest, AnotherConnectionOfThatAddressReplacesOneOfItsNewestHandshakes) {
  now_ms_ += NetworkLimits().handshake_ms / 100;
  const auto newcomer = admitted(kElsewhere);
  EXPECT_EQ(network_.connections(), kMost);
  crowd_.front()->say_hello();
  take_welcome(*crowd_.front());  // the oldest keeps its place
}

TEST_F(CrowdOfOneAddressTest, AfterATenthOfTheHandshakeTimeItReplacesTheOldest) {
  now_ms_ += NetworkLimits().handshake_ms / 10;
  const auto newcomer = admitted(kElsewhere);
  EXPECT_EQ(crowd_.front()->tcp.receive(), greeting_of("CURVE"));
  EXPECT_EQ(crowd_.front()->tcp.receive(), "");
}

class TightKeyedNetworkTest : public KeyedNetworkTest {
 protected:
  TightKeyedNetworkTest() : KeyedNetworkTest({.connections = 7, .handshake_ms = 100}) {}
};

TEST_F(TightKeyedNetworkTest, APeerWithAKeyNeverMakesRoom) {
  std::vector<std::unique_ptr<KeyedPeer>> peers;
  for (int i = 0; i < 7; ++i) {
    peers.push_back(admitted());
  }
  now_ms_ += 60'000;  // all of them are silent for long
  RawPeer newcomer(network_.endpoint(keyed_));
  run_until([&] { return refused(RefusalCause::kBound) == 1; });
  EXPECT_EQ(newcomer.receive(), "");
  EXPECT_EQ(network_.connections(), 7U);
}

TEST_F(TightKeyedNetworkTest, ASlowHandshakeIsEndedAndCountedWhateverItsStep) {
  const auto silent = with_server_key();
  const auto half = with_server_key();
  half->say_hello();
  take_welcome(*half);
  now_ms_ += 1000;
  network_.collect(now_ms_);
  EXPECT_EQ(network_.connections(), 0U);
  EXPECT_EQ(refused(RefusalCause::kTooSlow), 2U);
}

}  // namespace
}  // namespace oblique::server
