// What is said after a handshake with keys.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "tests/server/network/curve_zmtp.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

TEST_F(CurveZmtpTest, AFlippedBitAnywhereInAMessageIsNoMessage) {
  const std::size_t frame_bytes = 2 + CurveTraffic::kAddedBytes + 4;
  for (std::size_t at = 0; at < frame_bytes; ++at) {
    Zmtp zmtp = server();
    CurveClient anna = client();
    static_cast<void>(shake_hands(zmtp, anna));
    std::string bytes = anna.sealed("body");
    ASSERT_EQ(bytes.size(), frame_bytes);
    // A sealed frame may be a command or a message.
    bytes[at] = static_cast<char>(static_cast<unsigned>(bytes[at]) ^ (at == 0 ? 2U : 1U << at % 8));
    static_cast<void>(say(zmtp, bytes));
    EXPECT_FALSE(zmtp.has_message()) << at;
  }
}

TEST_F(CurveZmtpTest, WhatTheServerSaysHasNumbersThatGrow) {
  Zmtp zmtp = server();
  CurveClient anna = client();
  static_cast<void>(shake_hands(zmtp, anna));
  std::uint64_t last = 1;  // READY's
  for (int i = 0; i < 5; ++i) {
    std::string said = zmtp.header_or_sealed("reply");
    said += say(zmtp, anna.sealed(std::string("\x04PING\0\0c", 8), 2));
    const std::vector<Frame> frames = frames_of(said);
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_EQ(anna.opened_message(frames[0].body), std::string("\0reply", 6));
    EXPECT_EQ(anna.opened_message(frames[1].body), "\x02\x04PONGc");
    for (const Frame& frame : frames) {
      EXPECT_EQ(frame.flags, 0U);  // libzmq takes the outer bit for the inner one
      const std::uint64_t number = number_of(std::string_view(frame.body).substr(8, 8));
      EXPECT_GT(number, last);
      last = number;
    }
  }
}

// ---- Bounds of those who are in ----------------------------------------------------------------

TEST_F(CurveZmtpTest, AFrameIsOpenedWhenItsTurnHasComeAndNothingAfterItIsLookedAt) {
  Zmtp zmtp = server();
  CurveClient anna = client();
  static_cast<void>(shake_hands(zmtp, anna));
  zmtp.receive(anna.sealed("first"));
  zmtp.receive(anna.sealed("second"));
  EXPECT_FALSE(zmtp.has_message());
  EXPECT_EQ(zmtp.waiting_work(), Zmtp::Work::kSealedFrame);
  zmtp.do_work();
  EXPECT_EQ(zmtp.waiting_work(), Zmtp::Work::kNone);
  EXPECT_EQ(zmtp.take_message().body, "first");
  EXPECT_EQ(zmtp.waiting_work(), Zmtp::Work::kSealedFrame);
}

TEST_F(CurveZmtpTest, SealedFramesMayComeAsCommandsAsTheStandardHasThem) {
  Zmtp zmtp = server();
  CurveClient anna = client();
  static_cast<void>(shake_hands(zmtp, anna));
  for (const std::string& body : {std::string("short"), std::string(5000, 'l')}) {
    std::string bytes = anna.sealed(body);
    bytes[0] = static_cast<char>(static_cast<unsigned>(bytes[0]) | kFrameCommand);
    static_cast<void>(say(zmtp, bytes));
    ASSERT_TRUE(zmtp.has_message());
    EXPECT_EQ(zmtp.take_message().body, body);
  }
}

TEST_F(CurveZmtpTest, AMessageThatNeverEndsTakesNoMemory) {
  Zmtp zmtp = server();
  CurveClient anna = client();
  static_cast<void>(shake_hands(zmtp, anna));
  for (int i = 0; i < 300; ++i) {
    static_cast<void>(say(zmtp, anna.sealed(std::string(100'000, 'x'), 1)));
    ASSERT_LT(zmtp.held_bytes(), 300'000U);
    ASSERT_FALSE(zmtp.has_message());
  }
  static_cast<void>(say(zmtp, anna.sealed("last")));
  ASSERT_TRUE(zmtp.has_message());
  EXPECT_FALSE(zmtp.take_message().is_single);
  static_cast<void>(say(zmtp, anna.sealed("next")));
  EXPECT_EQ(zmtp.take_message().body, "next");
}

TEST_F(CurveZmtpTest, AFrameOfTheLargestSizeIsTakenAndALargerOneIsAFaultAtItsHeader) {
  Zmtp zmtp = server();
  CurveClient anna = client();
  static_cast<void>(shake_hands(zmtp, anna));
  static_cast<void>(say(zmtp, anna.sealed(std::string(protocol::kMaxFrameBytes, 'x'))));
  ASSERT_TRUE(zmtp.has_message());
  EXPECT_EQ(zmtp.take_message().body.size(), protocol::kMaxFrameBytes);
  EXPECT_LT(zmtp.held_bytes(), 300'000U);
  zmtp.receive(zmtp_header(protocol::kMaxFrameBytes + CurveTraffic::kAddedBytes + 1));
  EXPECT_THAT(zmtp.fault(), HasSubstr("frame of"));
}

TEST_F(CurveZmtpTest, SealedFramesOfNoKnownKindAndLongCommandsEndTheConnection) {
  const auto ends = [&](const auto& bytes_of) {
    Zmtp zmtp = server();
    CurveClient anna = client();
    static_cast<void>(shake_hands(zmtp, anna));
    expect_silence_and_end(zmtp, bytes_of(anna));
  };
  ends([](CurveClient& c) { return c.sealed("more, and a command", 3); });
  ends([](CurveClient& c) { return c.sealed("reserved", 4); });
  ends([](CurveClient& c) { return c.sealed("reserved", 0x80); });
  ends([](CurveClient& c) { return c.sealed("", 2); });
  ends([](CurveClient& c) { return c.sealed("\x09short", 2); });
  ends([](CurveClient& c) { return c.sealed("\x04PING\x01", 2); });
  ends([](CurveClient& c) { return c.sealed("\x04PING" + std::string(5000, 'p'), 2); });
  ends([](CurveClient&) { return zmtp_frame("not sealed"); });
  ends([](CurveClient&) { return zmtp_frame("\x07MESSAGE" + std::string(24, '\xff')); });
  ends([](CurveClient&) { return zmtp_frame("\x07MESSAGE" + std::string(25, '\xff')); });
  ends([](CurveClient& c) {
    std::string in_parts = c.sealed("in parts outside");
    in_parts[0] = '\x01';
    return in_parts;
  });
}

TEST_F(CurveZmtpTest, AHandshakeKeepsNoMoreThanItsLongestCommand) {
  Zmtp zmtp = server();
  CurveClient anna = client();
  be_welcomed(zmtp, anna);
  anna.properties += "\x01x" + std::string("\0\0\x0d\0", 4) + std::string(0x0d00, 'v');
  const std::string frame = initiate_frame(anna.initiate());
  ASSERT_LT(frame.size(), 4096U);
  static_cast<void>(say(zmtp, frame));
  EXPECT_TRUE(zmtp.is_open());
  EXPECT_LT(zmtp.held_bytes(), 10'000U);
}

}  // namespace
}  // namespace oblique::server
