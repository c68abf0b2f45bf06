// The protocol without keys.
#include "server/network/zmtp.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "tests/server/network/raw_peer.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// A connection whose handshake is done.
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

TEST(ZmtpTest, MessagesAreTheSameHoweverTheirBytesAreCut) {
  const std::string long_body(1000, 'l');
  const std::string bytes = zmtp_greeting() + zmtp_ready("DEALER") + zmtp_frame("") +
                            zmtp_frame("short") + zmtp_frame(long_body);
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{300}, bytes.size()}) {
    Zmtp zmtp;
    std::vector<std::string> bodies;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      zmtp.receive(std::string_view(bytes).substr(at, piece));
      while (zmtp.has_message()) {
        bodies.push_back(zmtp.take_message());
      }
    }
    EXPECT_THAT(bodies, testing::ElementsAre("", "short", long_body)) << piece;
  }
}

TEST(ZmtpTest, AFrameOfTheLargestSizeIsTakenAndALargerOneIsAFaultAtItsHeader) {
  Zmtp zmtp = opened();
  zmtp.receive(zmtp_frame(std::string(protocol::kMaxFrameBytes, 'x')));
  ASSERT_TRUE(zmtp.has_message());
  EXPECT_EQ(zmtp.take_message().size(), protocol::kMaxFrameBytes);
  EXPECT_LT(zmtp.held_bytes(), 300'000U);
  zmtp.receive(message_header(protocol::kMaxFrameBytes + 1));
  EXPECT_THAT(zmtp.fault(), HasSubstr(std::to_string(protocol::kMaxFrameBytes + 1)));
}

TEST(ZmtpTest, AFaultBehindAMessageWaitsForItsTurn) {
  Zmtp zmtp = opened();
  zmtp.receive(zmtp_frame("sound") + "\xff");
  EXPECT_THAT(zmtp.fault(), IsEmpty());
  EXPECT_EQ(zmtp.take_message(), "sound");
  EXPECT_THAT(zmtp.fault(), HasSubstr("unknown kind"));
}

TEST(ZmtpTest, WhatBreaksTheProtocolIsAFaultAtItsFirstBytes) {
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
           {zmtp_greeting() + zmtp_ready("PUB"), "not of a type"},
           {zmtp_greeting() + command_frame("READY", "x"), "cut off"},
           {zmtp_greeting() + command_frame("HELLO", ""), "READY"},
           {zmtp_greeting() + std::string("\x04\x00", 2), "without a name"},
           {zmtp_greeting() + too_long_a_command, "65536 bytes; the limit is 4096"},
           {zmtp_greeting() + ready + zmtp_frame("part", true).substr(0, 1), "several frames"},
           {zmtp_greeting() + ready + zmtp_ping().substr(0, 2), "heartbeats"}}) {
    Zmtp zmtp;
    zmtp.receive(bytes);
    EXPECT_THAT(zmtp.fault(), HasSubstr(fault)) << bytes;
    EXPECT_FALSE(zmtp.has_message());
  }
}

}  // namespace
}  // namespace oblique::server
