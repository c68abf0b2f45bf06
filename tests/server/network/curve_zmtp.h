#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/network/zmtp.h"
#include "tests/server/network/curve_client.h"
#include "tests/server/network/list_doorkeeper.h"

namespace oblique::server {

struct Frame {
  unsigned flags;
  std::string body;
};

/// Cuts what the server said into frames, less its greeting.
inline std::vector<Frame> frames_of(std::string_view bytes) {
  std::vector<Frame> frames;
  while (!bytes.empty()) {
    const unsigned flags = static_cast<unsigned char>(bytes[0]);
    const std::size_t length_bytes = (flags & kFrameLong) != 0 ? 8 : 1;
    const auto body_bytes = static_cast<std::size_t>(number_of(bytes.substr(1, length_bytes)));
    frames.push_back({flags, std::string(bytes.substr(1 + length_bytes, body_bytes))});
    bytes.remove_prefix(1 + length_bytes + body_bytes);
  }
  return frames;
}

inline std::string error_frame(std::string_view code) {
  return "\x04\x0a\x05"
         "ERROR\x03" +
         std::string(code);
}

inline void do_all_work(Zmtp& zmtp) {
  while (zmtp.waiting_work() != Zmtp::Work::kNone) {
    zmtp.do_work();
  }
}

/// Connections with keys, each end by hand.
class CurveZmtpTest : public testing::Test {
 protected:
  CurveZmtpTest() { doorkeeper_->admit(own_.public_key, "anna"); }

  CurveClient client() const { return {own_, server_.public_key}; }
  Zmtp server() const { return Zmtp(&guard_); }

  static std::string say(Zmtp& zmtp, std::string_view bytes) {
    zmtp.receive(bytes);
    do_all_work(zmtp);
    return zmtp.take_answers();
  }
  /// Until the server's WELCOME has been taken.
  static void be_welcomed(Zmtp& zmtp, CurveClient& client) {
    static_cast<void>(zmtp.take_answers());
    const std::string welcome = say(zmtp, curve_greeting() + zmtp_command("HELLO", client.hello()));
    ASSERT_EQ(welcome.size(), 170U);
    ASSERT_TRUE(client.take_welcome(std::string_view(welcome).substr(10)));
  }
  static std::string initiate_frame(const std::string& data) {
    return command_of("INITIATE", data);
  }
  static std::string shake_hands(Zmtp& zmtp, CurveClient& client) {
    be_welcomed(zmtp, client);
    return say(zmtp, initiate_frame(client.initiate()));
  }
  /// What a server that was said these bytes told the peer; it must have refused it.
  static std::string refusal_of(Zmtp& zmtp, std::string_view bytes) {
    std::string answers = say(zmtp, bytes);
    EXPECT_THAT(zmtp.fault(), testing::Not(testing::IsEmpty()));
    EXPECT_FALSE(zmtp.is_open());
    EXPECT_FALSE(zmtp.has_message());
    EXPECT_EQ(zmtp.holder(), nullptr);
    return answers;
  }
  static void expect_silence_and_end(Zmtp& zmtp, std::string_view bytes) {
    EXPECT_THAT(say(zmtp, bytes), testing::IsEmpty());
    EXPECT_FALSE(zmtp.has_message());
    EXPECT_THAT(zmtp.fault(), testing::Not(testing::IsEmpty()));
  }

  protocol::KeyPair server_ = protocol::made_key_pair();
  protocol::KeyPair own_ = protocol::made_key_pair();
  std::shared_ptr<ListDoorkeeper> doorkeeper_ = std::make_shared<ListDoorkeeper>();
  PortGuard guard_{server_, doorkeeper_};
};

}  // namespace oblique::server
