// Handshakes with keys, with a client by hand that says what no library says.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/network/key_shares.h"
#include "tests/server/network/curve_zmtp.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// ---- Handshakes -------------------------------------------------------------------------------

TEST_F(CurveZmtpTest, WhoHoldsAnAuthorizedKeyIsLetInAndTheServerProvesItsOwn) {
  Zmtp zmtp = server();
  CurveClient anna = client();
  const std::vector<Frame> answers = frames_of(shake_hands(zmtp, anna));
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].flags, kFrameCommand);
  const std::string_view ready = answers[0].body;
  const auto properties =
      CurveClient::opened(ready.substr(14), curve_nonce("CurveZMQREADY---", ready.substr(6, 8)),
                          anna.servers_brief, anna.brief.secret_key);
  EXPECT_THAT(properties.value_or(""), HasSubstr("ROUTER"));
  EXPECT_TRUE(zmtp.is_open());
  EXPECT_EQ(zmtp.holder()->name, "anna");
  EXPECT_EQ(zmtp.key(), own_.public_key);
}

TEST_F(CurveZmtpTest, MessagesAreTheSameHoweverTheirBytesAreCut) {
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{300}}) {
    Zmtp zmtp = server();
    CurveClient anna = client();
    be_welcomed(zmtp, anna);
    const std::string long_body(1000, 'l');
    std::string bytes = initiate_frame(anna.initiate());
    for (const std::string& body : {std::string(), std::string("short"), long_body}) {
      bytes += anna.sealed(body);
    }
    std::vector<std::string> bodies;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      zmtp.receive(std::string_view(bytes).substr(at, piece));
      do_all_work(zmtp);
      while (zmtp.has_message()) {
        bodies.push_back(zmtp.take_message().body);
        do_all_work(zmtp);
      }
    }
    EXPECT_THAT(bodies, ElementsAre("", "short", long_body)) << piece;
  }
}

TEST_F(CurveZmtpTest, NoHandshakeIsTheSameAsAnother) {
  CurveClient anna = client();
  CurveClient again = anna;
  Zmtp first = server();
  Zmtp second = server();
  be_welcomed(first, anna);
  be_welcomed(second, again);
  EXPECT_NE(anna.servers_brief, again.servers_brief);
  EXPECT_NE(anna.cookie, again.cookie);
}

TEST_F(CurveZmtpTest, AKeyThatIsNotAuthorizedIsToldSo) {
  Zmtp zmtp = server();
  CurveClient stranger(protocol::made_key_pair(), server_.public_key);
  be_welcomed(zmtp, stranger);
  EXPECT_EQ(refusal_of(zmtp, initiate_frame(stranger.initiate())), error_frame("400"));
  EXPECT_EQ(zmtp.cause(), RefusalCause::kUnknownKey);
}

TEST_F(CurveZmtpTest, AHelloForAnotherServerIsToldSoBeforeAnythingElseIsAsked) {
  Zmtp zmtp = server();
  static_cast<void>(zmtp.take_answers());
  CurveClient astray(own_, protocol::made_key_pair().public_key);
  EXPECT_EQ(refusal_of(zmtp, curve_greeting() + zmtp_command("HELLO", astray.hello())),
            error_frame("500"));
  EXPECT_EQ(zmtp.cause(), RefusalCause::kWrongServerKey);
}

TEST_F(CurveZmtpTest, ItIsNotEnoughToKnowAnAuthorizedKey) {
  const auto refused_with = [&](const auto& change) {
    Zmtp zmtp = server();
    CurveClient thief = client();
    change(thief);
    be_welcomed(zmtp, thief);
    EXPECT_EQ(refusal_of(zmtp, initiate_frame(thief.initiate())), error_frame("500"));
    EXPECT_THAT(zmtp.fault(), HasSubstr("does not hold"));
  };
  refused_with([](CurveClient& c) { c.vouching_secret = protocol::made_key_pair().secret_key; });
  refused_with([](CurveClient& c) { c.vouched_brief = protocol::made_key_pair().public_key; });
  refused_with([](CurveClient& c) { c.vouched_server = protocol::made_key_pair().public_key; });
}

TEST_F(CurveZmtpTest, AForgedInitiateDoesNotRevealWhetherItsKeyIsListedOrHasRoom) {
  const KeyShares shares;
  const PortGuard full(server_, std::make_shared<BoundedDoorkeeper>(doorkeeper_, shares, 0));
  const auto answer_to_forged = [&](const PortGuard& guard, const protocol::KeyPair& shown) {
    Zmtp zmtp(&guard);
    CurveClient thief(shown, server_.public_key);
    thief.vouching_secret = protocol::made_key_pair().secret_key;
    be_welcomed(zmtp, thief);
    return refusal_of(zmtp, initiate_frame(thief.initiate())) + zmtp.fault();
  };
  const std::string listed = answer_to_forged(guard_, own_);
  EXPECT_EQ(answer_to_forged(guard_, protocol::made_key_pair()), listed) << "not listed";
  EXPECT_EQ(answer_to_forged(full, own_), listed) << "has no room";
}

TEST_F(CurveZmtpTest, KeysWithWhichEverySecretIsKnownAreRefused) {
  // Points of small order: what is shared with them is zero, whoever shares it.
  for (const std::uint8_t first : {std::uint8_t{0}, std::uint8_t{1}}) {
    Zmtp zmtp = server();
    CurveClient client_of_nobody = client();
    client_of_nobody.brief.public_key = {first};
    refusal_of(zmtp, curve_greeting() + zmtp_command("HELLO", client_of_nobody.hello()));
  }
  CurveClient nobody = client();
  nobody.own.public_key = {};
  doorkeeper_->admit(nobody.own.public_key, "nobody");
  Zmtp zmtp = server();
  be_welcomed(zmtp, nobody);
  refusal_of(zmtp, initiate_frame(nobody.initiate()));
}

TEST_F(CurveZmtpTest, PropertiesOfASocketThatDoesNotSpeakWithARouterAreRefused) {
  for (const std::string& properties : {std::string(), std::string("\x0bSocket-Type"),
                                        zmtp_ready("PUB").substr(8), std::string("\xff"),
                                        std::string("\x01"
                                                    "x\xff\xff\xff\xff",
                                                    6)}) {
    Zmtp zmtp = server();
    CurveClient odd = client();
    odd.properties = properties;
    be_welcomed(zmtp, odd);
    const std::string answers = say(zmtp, initiate_frame(odd.initiate()));
    EXPECT_EQ(answers, error_frame("500"));
    EXPECT_FALSE(zmtp.is_open());
  }
}

// ---- Bytes that were changed, cut off, repeated or come out of turn ----------------------------

TEST_F(CurveZmtpTest, ACommandOfAnotherLengthIsRefused) {
  const std::string hello = client().hello();
  for (const std::string& data : {std::string(), hello.substr(0, 1), hello.substr(1),
                                  hello.substr(0, 193), hello + "x", std::string(194, '\0')}) {
    Zmtp zmtp = server();
    static_cast<void>(zmtp.take_answers());
    EXPECT_EQ(refusal_of(zmtp, curve_greeting() + zmtp_command("HELLO", data)), error_frame("500"))
        << data.size();
  }
  for (const std::size_t bytes :
       {std::size_t{0}, std::size_t{1}, std::size_t{95}, std::size_t{96}, std::size_t{103},
        std::size_t{104}, std::size_t{119}, std::size_t{120}, std::size_t{247}, std::size_t{248}}) {
    Zmtp zmtp = server();
    CurveClient anna = client();
    be_welcomed(zmtp, anna);
    refusal_of(zmtp, initiate_frame(anna.initiate().substr(0, bytes)));
  }
}

TEST_F(CurveZmtpTest, PropertiesOf16MBAreRefusedAtTheHeaderOfTheirFrame) {
  Zmtp zmtp = server();
  CurveClient anna = client();
  be_welcomed(zmtp, anna);
  anna.properties.append(16'000'000, 'p');
  const std::string frame = initiate_frame(anna.initiate());
  refusal_of(zmtp, frame.substr(0, 9));
  EXPECT_LT(zmtp.held_bytes(), 10'000U);
}

TEST_F(CurveZmtpTest, AHandshakeThatIsCutOffAnywhereLetsNobodyIn) {
  CurveClient anna = client();
  const std::string hello = curve_greeting() + zmtp_command("HELLO", anna.hello());
  for (std::size_t bytes = 0; bytes < hello.size(); ++bytes) {
    Zmtp zmtp = server();
    static_cast<void>(zmtp.take_answers());
    EXPECT_THAT(say(zmtp, std::string_view(hello).substr(0, bytes)), IsEmpty());
    EXPECT_THAT(zmtp.fault(), IsEmpty());
  }
  Zmtp zmtp = server();
  be_welcomed(zmtp, anna);
  const std::string initiate = initiate_frame(anna.initiate());
  for (const char byte : initiate.substr(0, initiate.size() - 1)) {
    EXPECT_THAT(say(zmtp, std::string(1, byte)), IsEmpty());
    EXPECT_FALSE(zmtp.is_open());
  }
  static_cast<void>(say(zmtp, initiate.substr(initiate.size() - 1)));
  EXPECT_TRUE(zmtp.is_open());
}

TEST_F(CurveZmtpTest, AFlippedBitAnywhereInAHandshakeLetsNobodyIn) {
  const auto flipped = [](std::string bytes, std::size_t at) {
    bytes[at] = static_cast<char>(static_cast<unsigned>(bytes[at]) ^ (1U << at % 8));
    return bytes;
  };
  for (std::size_t at = 0; at < kGreetingBytes; ++at) {
    Zmtp zmtp = server();
    static_cast<void>(zmtp.take_answers());
    const std::string answers =
        say(zmtp, flipped(curve_greeting(), at) + zmtp_command("HELLO", client().hello()));
    EXPECT_EQ(answers.empty(), !zmtp.fault().empty()) << at;  // some bytes say nothing
    EXPECT_FALSE(zmtp.is_open()) << at;
  }
  const std::size_t hello_bytes = 2 + 6 + 194;
  for (std::size_t at = 0; at < hello_bytes; ++at) {
    Zmtp zmtp = server();
    static_cast<void>(zmtp.take_answers());
    const std::string answers =
        say(zmtp, curve_greeting() + flipped(zmtp_command("HELLO", client().hello()), at));
    EXPECT_TRUE(answers.empty() || answers == error_frame("500")) << at;
    EXPECT_FALSE(zmtp.is_open());
  }
  CurveClient measured = client();
  const std::size_t initiate_bytes = 9 + 9 + 96 + 8 + 16 + 128 + measured.properties.size();
  for (std::size_t at = 0; at < initiate_bytes; ++at) {
    Zmtp zmtp = server();
    CurveClient anna = client();
    be_welcomed(zmtp, anna);
    const std::string bytes = initiate_frame(anna.initiate());
    ASSERT_EQ(bytes.size(), initiate_bytes);
    const std::string answers = say(zmtp, flipped(bytes, at));
    EXPECT_TRUE(answers.empty() || answers == error_frame("500")) << at;
    EXPECT_FALSE(zmtp.is_open()) << at;
    EXPECT_EQ(zmtp.holder(), nullptr) << at;
  }
}

TEST_F(CurveZmtpTest, WhatWasRecordedOnOneConnectionIsWorthNothingOnAnother) {
  CurveClient anna = client();
  Zmtp recorded = server();
  const std::string hello = zmtp_command("HELLO", anna.hello());
  static_cast<void>(recorded.take_answers());
  const std::string welcome = say(recorded, curve_greeting() + hello);
  ASSERT_TRUE(anna.take_welcome(std::string_view(welcome).substr(10)));
  const std::string initiate = initiate_frame(anna.initiate());
  static_cast<void>(say(recorded, initiate));
  ASSERT_TRUE(recorded.is_open());
  const std::string message = anna.sealed("delete everything");

  Zmtp replayed = server();
  static_cast<void>(replayed.take_answers());
  EXPECT_THAT(say(replayed, curve_greeting() + hello), HasSubstr("WELCOME"));
  EXPECT_EQ(refusal_of(replayed, initiate + message), error_frame("500"));
}

TEST_F(CurveZmtpTest, AnInitiateForAnotherConnectionsWelcomeIsRefusedWhileThatOneLives) {
  CurveClient anna = client();
  CurveClient other = client();
  Zmtp hers = server();
  Zmtp others = server();
  be_welcomed(hers, anna);
  be_welcomed(others, other);
  refusal_of(others, initiate_frame(anna.initiate()));
  static_cast<void>(say(hers, initiate_frame(anna.initiate())));
  EXPECT_TRUE(hers.is_open());
}

TEST_F(CurveZmtpTest, AnOldCookieIsWorthNothingInANewHandshake) {
  CurveClient anna = client();
  Zmtp earlier = server();
  be_welcomed(earlier, anna);
  const std::string old_cookie = anna.cookie;
  Zmtp zmtp = server();
  be_welcomed(zmtp, anna);
  anna.cookie = old_cookie;
  EXPECT_EQ(refusal_of(zmtp, initiate_frame(anna.initiate())), error_frame("500"));
}

TEST_F(CurveZmtpTest, AHandshakeIsNotDoneTwiceOnOneConnection) {
  for (const bool says_hello : {true, false}) {
    Zmtp zmtp = server();
    CurveClient anna = client();
    CurveClient again = anna;
    be_welcomed(zmtp, anna);
    const std::string initiate = initiate_frame(anna.initiate());
    static_cast<void>(say(zmtp, initiate));
    ASSERT_TRUE(zmtp.is_open());
    expect_silence_and_end(zmtp, says_hello ? zmtp_command("HELLO", again.hello()) : initiate);
  }
}

TEST_F(CurveZmtpTest, CommandsOutOfTurnAreRefused) {
  CurveClient anna = client();
  anna.servers_brief = server_.public_key;  // it was not told any
  const auto refused_at_first = [&](const std::string& bytes) {
    Zmtp zmtp = server();
    static_cast<void>(zmtp.take_answers());
    EXPECT_EQ(refusal_of(zmtp, curve_greeting() + bytes), error_frame("500"));
  };
  refused_at_first(zmtp_ready("DEALER"));
  refused_at_first(zmtp_command("WELCOME", std::string(160, 'w')));
  refused_at_first(initiate_frame(std::string(300, 'i')));
  refused_at_first(zmtp_ping("x"));
  refused_at_first(anna.sealed("a message before the handshake"));
  refused_at_first(zmtp_frame("and one that is not even sealed"));

  const auto refused_after_welcome = [&](const std::string& bytes) {
    Zmtp zmtp = server();
    CurveClient welcomed = client();
    be_welcomed(zmtp, welcomed);
    EXPECT_EQ(refusal_of(zmtp, bytes), error_frame("500"));
  };
  refused_after_welcome(zmtp_command("HELLO", anna.hello()));
  refused_after_welcome(zmtp_ready("DEALER"));
  refused_after_welcome(anna.sealed("a message before INITIATE"));
}

TEST_F(CurveZmtpTest, NumbersThatDoNotGrowEndTheConnection) {
  {
    Zmtp zmtp = server();
    CurveClient anna = client();
    be_welcomed(zmtp, anna);
    anna.nonce = 1;  // as HELLO's
    refusal_of(zmtp, initiate_frame(anna.initiate()));
  }
  const auto ends_after_first_message = [&](const auto& second) {
    Zmtp zmtp = server();
    CurveClient anna = client();
    static_cast<void>(shake_hands(zmtp, anna));
    anna.nonce = 100;
    const std::string first = anna.sealed("first");
    zmtp.receive(first + second(anna, first));
    do_all_work(zmtp);
    EXPECT_EQ(zmtp.take_message().body, "first");
    expect_silence_and_end(zmtp, "");
  };
  ends_after_first_message([](CurveClient&, const std::string& first) { return first; });
  ends_after_first_message([](CurveClient& anna, const std::string&) {
    anna.nonce = 100;
    return anna.sealed("another of the same number");
  });
  ends_after_first_message([](CurveClient& anna, const std::string&) {
    anna.nonce = 50;
    return anna.sealed("running backwards");
  });
  {
    Zmtp zmtp = server();
    CurveClient anna = client();
    static_cast<void>(shake_hands(zmtp, anna));
    anna.nonce = 2;  // as INITIATE's
    expect_silence_and_end(zmtp, anna.sealed("the handshake's number"));
  }
}

}  // namespace
}  // namespace oblique::server
