// The server's end of CURVE against a recorded conversation of libzmq with itself.
#include "tests/server/network/curve_vectors.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "server/network/curve/bytes.h"
#include "server/network/curve/peer.h"
#include "tests/server/network/curve_client.h"
#include "tests/server/network/list_doorkeeper.h"

namespace oblique::server {
namespace {

std::string bytes_of(std::string_view hex) {
  std::string bytes(hex.size() / 2, '\0');
  if (sodium_hex2bin(raw(bytes.data()), bytes.size(), hex.data(), hex.size(), nullptr, nullptr,
                     nullptr) != 0) {
    throw std::runtime_error("not hexadecimal");
  }
  return bytes;
}

/// Of a command less its name.
std::string data_of(std::string_view hex) {
  const std::string body = bytes_of(hex);
  return body.substr(1 + static_cast<unsigned char>(body.front()));
}

/// While it lives libsodium gives the recorded random numbers, in the order in which
/// `CurveHandshake` asks for them.
class RecordedRandomness {
 public:
  RecordedRandomness() {
    left_ = bytes_of(recorded::kServerBriefSecret) + bytes_of(recorded::kCookieKey) +
            bytes_of(recorded::kCookieNonce) + bytes_of(recorded::kWelcomeNonce);
    static randombytes_implementation recorded{};
    recorded.implementation_name = [] { return "recorded"; };
    recorded.buf = [](void* to, std::size_t size) {
      std::memcpy(to, left_.data(), std::min(size, left_.size()));
      left_.erase(0, size);
    };
    randombytes_set_implementation(&recorded);
  }
  ~RecordedRandomness() { randombytes_set_implementation(&randombytes_sysrandom_implementation); }
  RecordedRandomness(const RecordedRandomness&) = delete;
  RecordedRandomness& operator=(const RecordedRandomness&) = delete;

 private:
  static inline std::string left_;
};

TEST(CurveVectorsTest, WithTheSameRandomNumbersTheServerSaysByteForByteWhatLibzmqSays) {
  protocol::KeyPair server;
  std::ranges::copy(bytes_of(recorded::kServerSecret), server.secret_key.bytes().begin());
  server.public_key = protocol::public_half_of(server.secret_key);
  protocol::CurveKey client{};
  std::ranges::copy(bytes_of(recorded::kClientPublic), client.begin());
  const auto doorkeeper = std::make_shared<ListDoorkeeper>();
  doorkeeper->admit(client, "anna");
  const PortGuard guard(server, doorkeeper);
  CurvePeer peer(guard);
  const RecordedRandomness randomness;

  EXPECT_EQ(std::get<std::string>(peer.take("HELLO", data_of(recorded::kClientHello))),
            data_of(recorded::kServerWelcome));
  const std::string properties =
      std::get<std::string>(peer.take("INITIATE", data_of(recorded::kClientInitiate)));
  EXPECT_EQ(properties, zmtp_ready("DEALER").substr(8) + std::string("\x08Identity\0\0\0\0", 13));
  ASSERT_TRUE(peer.is_admitted());
  EXPECT_EQ(peer.key(), client);
  EXPECT_EQ(peer.traffic().ready(zmtp_ready("ROUTER").substr(8) +
                                 std::string("\x08Identity\0\0\0\0", 13)),
            data_of(recorded::kServerReady));
  const auto question = peer.traffic().open(bytes_of(recorded::kClientQuestion));
  ASSERT_TRUE(question);
  EXPECT_EQ(question->body, "a question");
  std::string answer;
  peer.traffic().seal("A QUESTION", false, answer);
  EXPECT_EQ(answer, bytes_of(recorded::kServerAnswer));
}

}  // namespace
}  // namespace oblique::server
