#include "server/network/zmtp.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "tests/server/network/raw_peer.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// A connection whose peer has said who it is.
Zmtp opened() {
  Zmtp zmtp;
  zmtp.receive(zmtp_greeting() + zmtp_ready("DEALER"));
  static_cast<void>(zmtp.take_answers());
  return zmtp;
}

TEST(ZmtpTest, GreetsAtOnceAndSaysReadyToASoundGreeting) {
  Zmtp zmtp;
  EXPECT_EQ(zmtp.take_answers().size(), 64U);
  zmtp.receive(zmtp_greeting());
  EXPECT_THAT(zmtp.take_answers(), HasSubstr("ROUTER"));
  EXPECT_FALSE(zmtp.is_open());
  zmtp.receive(zmtp_ready("DEALER"));
  EXPECT_TRUE(zmtp.is_open());
  EXPECT_THAT(zmtp.fault(), IsEmpty());
}

TEST(ZmtpTest, MessagesAreTheSameHoweverTheirBytesAreCut) {
  const std::string long_body(1000, 'l');
  const std::string bytes = zmtp_greeting() + zmtp_ready("DEALER") + zmtp_frame("") +
                            zmtp_frame("short") + zmtp_ping("x") + zmtp_frame(long_body);
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{300}, bytes.size()}) {
    Zmtp zmtp;
    std::vector<std::string> bodies;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      zmtp.receive(std::string_view(bytes).substr(at, piece));
      while (zmtp.has_message()) {
        const ZmtpMessage message = zmtp.take_message();
        EXPECT_TRUE(message.is_single);
        bodies.push_back(message.body);
      }
    }
    EXPECT_THAT(bodies, testing::ElementsAre("", "short", long_body)) << piece;
    EXPECT_THAT(zmtp.take_answers(), HasSubstr("PONGx"));
  }
}

TEST(ZmtpTest, AMessageThatNeverEndsTakesNoMemory) {
  Zmtp zmtp = opened();
  for (int i = 0; i < 1000; ++i) {
    zmtp.receive(zmtp_frame(std::string(100'000, 'x'), true));
    ASSERT_LT(zmtp.held_bytes(), 300'000U);
  }
  EXPECT_FALSE(zmtp.has_message());
  zmtp.receive(zmtp_frame("last"));
  ASSERT_TRUE(zmtp.has_message());
  EXPECT_FALSE(zmtp.take_message().is_single);
  zmtp.receive(zmtp_frame("next"));
  EXPECT_EQ(zmtp.take_message().body, "next");
}

TEST(ZmtpTest, AFrameOfTheLargestSizeIsTakenAndALargerOneIsAFaultAtItsHeader) {
  Zmtp zmtp = opened();
  zmtp.receive(zmtp_frame(std::string(protocol::kMaxFrameBytes, 'x')));
  ASSERT_TRUE(zmtp.has_message());
  EXPECT_EQ(zmtp.take_message().body.size(), protocol::kMaxFrameBytes);
  EXPECT_LT(zmtp.held_bytes(), 300'000U);
  zmtp.receive(zmtp_header(protocol::kMaxFrameBytes + 1));
  EXPECT_THAT(zmtp.fault(), HasSubstr(std::to_string(protocol::kMaxFrameBytes + 1)));
}

TEST(ZmtpTest, AFaultBehindAMessageWaitsForItsTurn) {
  Zmtp zmtp = opened();
  zmtp.receive(zmtp_frame("sound") + "\xff");
  EXPECT_THAT(zmtp.fault(), IsEmpty());
  EXPECT_EQ(zmtp.take_message().body, "sound");
  EXPECT_THAT(zmtp.fault(), HasSubstr("no known kind"));
}

TEST(ZmtpTest, StrangersAreNoticedAtTheirFirstBytes) {
  std::string old_version = zmtp_greeting();
  old_version[10] = '\x01';
  std::string other_mechanism = zmtp_greeting();
  other_mechanism[12] = 'C';
  const std::string too_long_a_command("\x06\0\0\0\0\0\1\0\0", 9);
  for (const std::string& bytes :
       {std::string("GET / HTTP/1.1\r\n"), std::string("\x16\x03\x01"), old_version.substr(0, 11),
        other_mechanism, zmtp_greeting() + zmtp_frame("a message before READY"),
        zmtp_greeting() + zmtp_ready("PUB"),
        zmtp_greeting() + zmtp_ready("DEALER").substr(0, 1) + std::string("\x07\x05READYx", 8),
        zmtp_greeting() + std::string("\x04\x00", 2), zmtp_greeting() + too_long_a_command}) {
    Zmtp zmtp;
    zmtp.receive(bytes);
    EXPECT_FALSE(zmtp.fault().empty()) << bytes;
    EXPECT_FALSE(zmtp.has_message());
  }
}

TEST(ZmtpTest, APingIsAnsweredWithItsContextAndACutOneIsAFault) {
  Zmtp zmtp = opened();
  zmtp.receive(zmtp_ping(std::string(16, 'c')));
  EXPECT_EQ(zmtp.take_answers(), std::string("\x04\x15\x04PONG", 7) + std::string(16, 'c'));
  zmtp.receive(std::string("\x04\x05\x04PING", 7));
  EXPECT_THAT(zmtp.fault(), HasSubstr("PING"));
}

}  // namespace
}  // namespace oblique::server
