// Tests of ZMTP with and without keys. The client can also send messages that no library sends.
#include "server/network/zmtp.h"

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "tests/server/network/curve_client.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Returns a connection after its handshake.
Zmtp opened() {
  Zmtp zmtp;
  zmtp.receive(zmtp_greeting() + zmtp_ready("DEALER"));
  static_cast<void>(zmtp.take_answers());
  return zmtp;
}

TEST(ZmtpTest, SendsGreetingAtOnceAndReadyAfterTheGreetingOfThePeer) {
  Zmtp zmtp;
  EXPECT_EQ(zmtp.take_answers(), greeting_of("NULL"));
  zmtp.receive(zmtp_greeting());
  EXPECT_EQ(zmtp.take_answers(), zmtp_ready("ROUTER"));
  EXPECT_FALSE(zmtp.is_open());
  const std::string identity("\x08Identity\0\0\0\x04same", 17);
  zmtp.receive(command_frame("READY", zmtp_properties("DEALER") + identity));
  EXPECT_TRUE(zmtp.is_open());
  EXPECT_THAT(zmtp.fault(), IsEmpty());
}

TEST(ZmtpTest, AFaultAfterAMessageIsReportedAfterThatMessage) {
  Zmtp zmtp = opened();
  zmtp.receive(zmtp_frame("sound") + "\xff");
  EXPECT_THAT(zmtp.fault(), IsEmpty());
  EXPECT_EQ(zmtp.take_message(), "sound");
  EXPECT_THAT(zmtp.fault(), HasSubstr("unknown kind"));
}

TEST(ZmtpTest, ViolationsAreFaultsAtTheirFirstByte) {
  std::string old_version = zmtp_greeting();
  old_version[10] = '\x01';
  std::string other_mechanism = zmtp_greeting();
  other_mechanism[12] = 'C';
  const std::string too_long_a_command("\x06\0\0\0\0\0\1\0\0", 9);
  const std::string ready = zmtp_ready("DEALER");
  struct Case {
    std::string bytes;
    const char* fault;
  };
  for (const auto& [bytes, fault] : std::vector<Case>{
           {"GET / HTTP/1.1\r\n", "ZMTP 3"},
           {"\x16\x03\x01", "ZMTP 3"},
           {old_version.substr(0, 11), "ZMTP 3"},
           {other_mechanism, "runs without keys"},
           {zmtp_greeting() + zmtp_frame("early").substr(0, 2), "before the handshake"},
           {zmtp_greeting() + zmtp_ready("PUB"), "cannot connect to a ROUTER"},
           {zmtp_greeting() + command_frame("READY", "x"), "cut off"},
           {zmtp_greeting() + command_frame("HELLO", ""), "READY"},
           {zmtp_greeting() + std::string("\x04\x00", 2), "without a name"},
           {zmtp_greeting() + too_long_a_command, "65536 bytes; the limit is 4096"},
           {zmtp_greeting() + ready + zmtp_frame("part", true).substr(0, 1), "several frames"},
           {zmtp_greeting() + ready + zmtp_ping().substr(0, 2), "heartbeat"}}) {
    Zmtp zmtp;
    zmtp.receive(bytes);
    EXPECT_THAT(zmtp.fault(), HasSubstr(fault)) << bytes;
    EXPECT_FALSE(zmtp.has_message());
  }
}

// ---- With keys ----------------------------------------------------------------------------------

std::string error_frame(const std::string& code) {
  return command_frame("ERROR", "\x03" + code);
}

std::string flipped(std::string bytes, std::size_t at) {
  bytes[at] = static_cast<char>(static_cast<unsigned>(bytes[at]) ^ (1U << at % 8));
  return bytes;
}

/// Client and server of one connection.
struct Link {
  /// Passes bytes to the server and returns its answer.
  std::string send(std::string_view bytes) {
    zmtp.receive(bytes);
    while (zmtp.pending_step() != Zmtp::PendingStep::kNone) {
      zmtp.run_step();
    }
    return zmtp.take_answers();
  }
  std::string hello_frame() { return command_frame("HELLO", client.hello()); }
  std::string initiate_frame() { return command_frame("INITIATE", client.initiate()); }
  /// Expects that the server refuses these bytes and sends `answer`, which may be empty.
  void expect_refused(std::string_view bytes, const std::string& answer = error_frame("500")) {
    EXPECT_EQ(send(bytes), answer);
    EXPECT_THAT(zmtp.fault(), Not(IsEmpty()));
    EXPECT_FALSE(zmtp.has_message());
  }

  Zmtp zmtp;
  CurveClient client;
};

class CurveTest : public testing::Test {
 protected:
  CurveTest() { authenticator_.add(own_.public_key, "anna"); }

  CurveClient client() const { return {own_, server_.public_key}; }
  /// Returns a connection on which the client has received the server's greeting.
  Link greeted() const {
    Link link{Zmtp(&security_), client()};
    static_cast<void>(link.zmtp.take_answers());
    return link;
  }
  /// Returns a connection on which the client has received WELCOME.
  Link welcomed(const CurveClient& client) const {
    Link link = greeted();
    link.client = client;
    const std::string welcome = link.send(curve_greeting() + link.hello_frame());
    EXPECT_EQ(welcome.size(), 170U);
    EXPECT_TRUE(link.client.take_welcome(std::string_view(welcome).substr(10)));
    return link;
  }
  Link welcomed() const { return welcomed(client()); }
  Link open() const {
    Link link = welcomed();
    EXPECT_THAT(link.send(link.initiate_frame()), HasSubstr("READY"));
    EXPECT_TRUE(link.zmtp.is_open());
    return link;
  }

  protocol::KeyPair server_ = protocol::generate_key_pair();
  protocol::KeyPair own_ = protocol::generate_key_pair();
  ListAuthenticator authenticator_;
  PortSecurity security_{server_, authenticator_};
};

// ---- Handshakes -------------------------------------------------------------------------------

TEST_F(CurveTest, APeerWithAnAuthorizedKeyIsAdmittedAndTheServerProvesItsOwnKey) {
  Link link = welcomed();
  const std::string answer = link.send(link.initiate_frame());
  EXPECT_EQ(static_cast<unsigned char>(answer[0]), kFrameCommand);
  const std::string_view ready = std::string_view(answer).substr(2);
  const auto properties =
      CurveClient::opened(ready.substr(14), curve_nonce("CurveZMQREADY---", ready.substr(6, 8)),
                          link.client.server_short_term, link.client.short_term.secret_key);
  EXPECT_EQ(properties, zmtp_properties("ROUTER"));
  EXPECT_TRUE(link.zmtp.is_open());
  EXPECT_EQ(link.zmtp.identity()->name, "anna");
  EXPECT_EQ(link.zmtp.key(), own_.public_key);
}

TEST_F(CurveTest, TwoHandshakesWithTheSameClientKeysDiffer) {
  const CurveClient anna = client();
  const Link first = welcomed(anna);
  const Link second = welcomed(anna);
  EXPECT_NE(first.client.server_short_term, second.client.server_short_term);
  EXPECT_NE(first.client.cookie, second.client.cookie);
}

TEST_F(CurveTest, AKeyThatIsNotAuthorizedIsRefused) {
  Link link = welcomed({protocol::generate_key_pair(), server_.public_key});
  link.expect_refused(link.initiate_frame(), error_frame("400"));
  EXPECT_EQ(link.zmtp.cause(), RefusalCause::kUnknownKey);
}

TEST_F(CurveTest, AHelloForAnotherServerIsRefusedAtOnce) {
  Link link = greeted();
  link.client = {own_, protocol::generate_key_pair().public_key};
  link.expect_refused(curve_greeting() + link.hello_frame());
  EXPECT_EQ(link.zmtp.cause(), RefusalCause::kWrongServerKey);
}

TEST_F(CurveTest, APeerThatDoesNotHoldItsKeyIsRefusedWhetherOrNotTheKeyIsListed) {
  const protocol::KeyPair other = protocol::generate_key_pair();
  std::set<std::string> faults;
  for (const protocol::KeyPair& shown : {own_, protocol::generate_key_pair()}) {
    std::vector<CurveClient> impostors(3, {shown, server_.public_key});
    impostors[0].vouching_secret = other.secret_key;
    impostors[1].vouched_short_term = other.public_key;
    impostors[2].vouched_server = other.public_key;
    for (const CurveClient& client : impostors) {
      Link thief = welcomed(client);
      thief.expect_refused(thief.initiate_frame());
      faults.insert(thief.zmtp.fault());
    }
  }
  EXPECT_THAT(faults, ElementsAre(HasSubstr("does not hold the secret")));
}

TEST_F(CurveTest, KeysOfSmallOrderAreRefused) {
  // With a public key of small order the shared secret is zero for every secret key.
  for (const std::uint8_t first : {std::uint8_t{0}, std::uint8_t{1}}) {
    Link link = greeted();
    link.client.short_term.public_key = {first};
    link.expect_refused(curve_greeting() + link.hello_frame());
  }
  CurveClient zero = client();
  zero.own.public_key = {};
  authenticator_.add(zero.own.public_key, "zero");
  Link link = welcomed(zero);
  link.expect_refused(link.initiate_frame());
}

TEST_F(CurveTest, PropertiesThatARouterCannotUseAreRefused) {
  const std::string endless("\x01x\xff\xff\xff\xff", 6);
  for (const std::string& properties : {std::string(), std::string("\x0bSocket-Type"),
                                        zmtp_properties("PUB"), std::string("\xff"), endless}) {
    Link link = welcomed();
    link.client.properties = properties;
    EXPECT_EQ(link.send(link.initiate_frame()), error_frame("500"));
    EXPECT_FALSE(link.zmtp.is_open());
  }
}

// ---- Bytes that are changed, cut off, repeated or out of order ----------------------------------

TEST_F(CurveTest, ACommandOfAnotherLengthIsRefused) {
  const std::string hello = client().hello();
  for (const std::string& data : {std::string(), hello.substr(0, 1), hello.substr(1),
                                  hello.substr(0, 193), hello + "x", std::string(194, '\0')}) {
    greeted().expect_refused(curve_greeting() + command_frame("HELLO", data));
  }
  for (const std::size_t bytes : {0U, 1U, 95U, 96U, 103U, 104U, 119U, 120U, 247U, 248U}) {
    Link link = welcomed();
    link.expect_refused(command_frame("INITIATE", link.client.initiate().substr(0, bytes)));
  }
}

TEST_F(CurveTest, AHandshakeStoresAtMostItsLongestCommand) {
  Link greedy = welcomed();
  greedy.client.properties.append(16'000'000, 'p');
  greedy.expect_refused(greedy.initiate_frame().substr(0, 9));
  EXPECT_LT(greedy.zmtp.held_bytes(), 10'000U);

  Link link = welcomed();
  link.client.properties += "\x01x" + std::string("\0\0\x0d\0", 4) + std::string(0x0d00, 'v');
  const std::string frame = link.initiate_frame();
  ASSERT_LT(frame.size(), 4096U);
  link.send(frame);
  EXPECT_TRUE(link.zmtp.is_open());
  EXPECT_LT(link.zmtp.held_bytes(), 10'000U);
}

TEST_F(CurveTest, AnIncompleteHandshakeAdmitsNoPeer) {
  const std::string hello = curve_greeting() + greeted().hello_frame();
  for (std::size_t bytes = 0; bytes < hello.size(); ++bytes) {
    Link link = greeted();
    EXPECT_THAT(link.send(std::string_view(hello).substr(0, bytes)), IsEmpty());
    EXPECT_THAT(link.zmtp.fault(), IsEmpty());
  }
  Link link = welcomed();
  const std::string initiate = link.initiate_frame();
  for (const char byte : initiate.substr(0, initiate.size() - 1)) {
    EXPECT_THAT(link.send(std::string(1, byte)), IsEmpty());
    EXPECT_FALSE(link.zmtp.is_open());
  }
  link.send(initiate.substr(initiate.size() - 1));
  EXPECT_TRUE(link.zmtp.is_open());
}

TEST_F(CurveTest, AFlippedBitAnywhereInAHandshakeAdmitsNoPeer) {
  const auto expect_refused = [](Link link, const std::string& begin, const std::string& bytes,
                                 std::size_t at) {
    const std::string answers = link.send(begin + flipped(bytes, at));
    EXPECT_TRUE(answers.empty() || answers == error_frame("500")) << at;
    EXPECT_FALSE(link.zmtp.is_open()) << at;
    EXPECT_EQ(link.zmtp.identity(), nullptr) << at;
  };
  for (std::size_t at = 0; at < kGreetingBytes; ++at) {
    Link link = greeted();
    const std::string answers = link.send(flipped(curve_greeting(), at) + link.hello_frame());
    EXPECT_EQ(answers.empty(), !link.zmtp.fault().empty()) << at;  // the server ignores some bytes
    EXPECT_FALSE(link.zmtp.is_open()) << at;
  }
  const std::string hello = greeted().hello_frame();
  ASSERT_EQ(hello.size(), 2 + 6 + 194U);
  for (std::size_t at = 0; at < hello.size(); ++at) {
    expect_refused(greeted(), curve_greeting(), hello, at);
  }
  const std::size_t initiate_bytes = 9 + 9 + 96 + 8 + 16 + 128 + client().properties.size();
  for (std::size_t at = 0; at < initiate_bytes; ++at) {
    Link link = welcomed();
    const std::string initiate = link.initiate_frame();
    ASSERT_EQ(initiate.size(), initiate_bytes);
    expect_refused(std::move(link), "", initiate, at);
  }
}

TEST_F(CurveTest, ARecordedInitiateOrCookieIsRefusedOnAnotherConnection) {
  Link hers = welcomed();
  Link others = welcomed();
  Link replayed = welcomed(hers.client);
  const std::string initiate = hers.initiate_frame();
  hers.send(initiate);
  EXPECT_TRUE(hers.zmtp.is_open());
  others.expect_refused(initiate);
  replayed.expect_refused(initiate + hers.client.sealed("delete everything"));

  Link with_old_cookie = welcomed(hers.client);
  with_old_cookie.client.cookie = hers.client.cookie;
  with_old_cookie.expect_refused(with_old_cookie.initiate_frame());
}

TEST_F(CurveTest, AConnectionHasOneHandshake) {
  for (const bool repeats_hello : {true, false}) {
    Link link = welcomed();
    const std::string initiate = link.initiate_frame();
    link.send(initiate);
    ASSERT_TRUE(link.zmtp.is_open());
    link.expect_refused(repeats_hello ? link.hello_frame() : initiate, "");
  }
}

TEST_F(CurveTest, CommandsOutOfOrderAreRefused) {
  CurveClient anna = client();
  anna.server_short_term = server_.public_key;  // without a WELCOME
  for (const std::string& bytes :
       {zmtp_ready("DEALER"), command_frame("WELCOME", std::string(160, 'w')),
        command_frame("INITIATE", std::string(300, 'i')), zmtp_ping(), anna.sealed("too early"),
        zmtp_frame("and not encrypted")}) {
    greeted().expect_refused(curve_greeting() + bytes);
  }
  for (const std::string& bytes : {command_frame("HELLO", anna.hello()), zmtp_ready("DEALER"),
                                   anna.sealed("a message before INITIATE")}) {
    welcomed().expect_refused(bytes);
  }
}

TEST_F(CurveTest, CountersThatDoNotGrowEndTheConnection) {
  Link link = welcomed();
  link.client.nonce = 1;  // HELLO used this counter
  link.expect_refused(link.initiate_frame());

  Link opened = open();
  opened.client.nonce = 2;  // INITIATE used this counter
  opened.expect_refused(opened.client.sealed("with the counter of the handshake"), "");

  const auto ends_after_first_message = [&](const auto& second) {
    Link after = open();
    after.client.nonce = 100;
    const std::string first = after.client.sealed("first");
    after.send(first + second(after.client, first));
    EXPECT_EQ(after.zmtp.take_message(), "first");
    after.expect_refused("", "");
  };
  ends_after_first_message([](CurveClient&, const std::string& first) { return first; });
  for (const std::uint64_t counter : {100U, 50U}) {
    ends_after_first_message([counter](CurveClient& anna, const std::string&) {
      anna.nonce = counter;
      return anna.sealed("second");
    });
  }
}

// ---- Messages, with keys and without ------------------------------------------------------------

TEST_F(CurveTest, MessagesDoNotDependOnHowTheirBytesAreSplit) {
  const std::vector<std::string> sent{"", "short", std::string(1000, 'l')};
  const auto bodies_of = [](Link& link, std::string_view bytes, std::size_t piece) {
    std::vector<std::string> bodies;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      link.send(bytes.substr(at, piece));
      while (link.zmtp.has_message()) {
        bodies.push_back(link.zmtp.take_message());
        link.send("");
      }
    }
    return bodies;
  };
  for (const std::size_t piece : {1U, 7U, 300U, 10'000U}) {
    Link keyed = welcomed();
    Link plain{Zmtp(), client()};
    std::string sealed = keyed.initiate_frame();
    std::string bytes = zmtp_greeting() + zmtp_ready("DEALER");
    for (const std::string& body : sent) {
      sealed += keyed.client.sealed(body);
      bytes += zmtp_frame(body);
    }
    EXPECT_EQ(bodies_of(keyed, sealed, piece), sent) << piece;
    EXPECT_EQ(bodies_of(plain, bytes, piece), sent) << piece;
  }
}

TEST_F(CurveTest, AFrameOfTheLargestSizeIsTakenAndALargerOneIsAFaultAtItsHeader) {
  const std::string largest(protocol::kMaxFrameBytes, 'x');
  Link keyed = open();
  Link plain{opened(), client()};
  for (const auto& [link, frame, added] :
       {std::tuple(&keyed, keyed.client.sealed(largest), CurveSession::kAddedBytes),
        std::tuple(&plain, zmtp_frame(largest), std::size_t{0})}) {
    link->send(frame);
    ASSERT_TRUE(link->zmtp.has_message());
    EXPECT_EQ(link->zmtp.take_message().size(), largest.size());
    EXPECT_LT(link->zmtp.held_bytes(), 300'000U);
    link->zmtp.receive(message_header(largest.size() + added + 1));
    EXPECT_THAT(link->zmtp.fault(),
                HasSubstr("frame of " + std::to_string(largest.size() + added + 1)));
  }
}

TEST_F(CurveTest, AMessageWithAFlippedBitIsRefused) {
  constexpr std::size_t kFrameBytes = 2 + CurveSession::kAddedBytes + 4;
  for (std::size_t at = 0; at < kFrameBytes; ++at) {
    Link link = open();
    const std::string bytes = link.client.sealed("body");
    ASSERT_EQ(bytes.size(), kFrameBytes);
    link.send(flipped(bytes, at));
    EXPECT_FALSE(link.zmtp.has_message()) << at;
  }
}

TEST_F(CurveTest, MessagesOfTheServerHaveCountersThatGrow) {
  Link link = open();
  for (std::uint64_t counter = 2; counter < 6; ++counter) {  // READY has counter 1
    std::string_view body = "reply";
    const std::string frame = link.zmtp.begin_message(body);
    EXPECT_THAT(body, IsEmpty());
    // libzmq reads an outer flag "more" as the encrypted flag "more". So the outer flags must be 0.
    EXPECT_EQ(frame[0], 0);
    EXPECT_EQ(link.client.opened_message(frame.substr(2)), std::string("\0reply", 6));
    EXPECT_EQ(number_of(std::string_view(frame).substr(10, 8)), counter);
  }
}

TEST_F(CurveTest, AFrameIsDecryptedInItsTurnAndLaterBytesAreNotExamined) {
  Link link = open();
  Zmtp& zmtp = link.zmtp;
  zmtp.receive(link.client.sealed("first") + link.client.sealed("second"));
  EXPECT_FALSE(zmtp.has_message());
  EXPECT_EQ(zmtp.pending_step(), Zmtp::PendingStep::kSealedFrame);
  zmtp.run_step();
  EXPECT_EQ(zmtp.pending_step(), Zmtp::PendingStep::kNone);
  EXPECT_EQ(zmtp.take_message(), "first");
  EXPECT_EQ(zmtp.pending_step(), Zmtp::PendingStep::kSealedFrame);
}

TEST_F(CurveTest, EncryptedFramesMayBeCommandsAsInTheStandard) {
  Link link = open();
  for (const std::string& body : {std::string("short"), std::string(5000, 'l')}) {
    std::string bytes = link.client.sealed(body);
    bytes[0] = static_cast<char>(static_cast<unsigned>(bytes[0]) | kFrameCommand);
    link.send(bytes);
    ASSERT_TRUE(link.zmtp.has_message());
    EXPECT_EQ(link.zmtp.take_message(), body);
  }
}

TEST_F(CurveTest, IncompleteOrPlainFramesEndTheConnection) {
  const auto ends = [&](const auto& bytes_of) {
    Link link = open();
    link.expect_refused(bytes_of(link.client), "");
  };
  for (const unsigned flags : {1U, 2U, 3U, 4U, 0x80U}) {  // flags: more, command, both, reserved
    ends([flags](CurveClient& c) { return c.sealed("\x04PING\0\0", flags); });
  }
  ends([](CurveClient&) { return zmtp_frame("not encrypted"); });
  ends([](CurveClient&) { return zmtp_frame("\x07MESSAGE" + std::string(24, '\xff')); });
  ends([](CurveClient&) { return zmtp_frame("\x07MESSAGE" + std::string(25, '\xff')); });
  ends([](CurveClient& c) {
    std::string in_parts = c.sealed("in parts outside");
    in_parts[0] = '\x01';
    return in_parts;
  });
}

}  // namespace
}  // namespace oblique::server
