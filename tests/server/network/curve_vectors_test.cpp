// The server's end of CURVE against a recorded conversation between a DEALER and a ROUTER of libzmq
// 4.3.4 (libsodium 1.0.18), whose random numbers were replaced by known ones. Bytes are in hex.
#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "tests/server/network/curve_client.h"

namespace oblique::server {
namespace {

namespace recorded {

constexpr std::string_view kServerSecret =
    "5e322e4c38adc3397ac9b4b4d3a34b68321d7ee82c04d7a3a4cf77fe4b6f70d6";
constexpr std::string_view kClientPublic =
    "8788577ad38d2a17feabf47ef520a22c0a03e76b5f7ad5763b6328a1a73ba71d";

// Random numbers of the server, in the order in which it draws them.
constexpr std::string_view kServerBriefSecret =
    "cf672b6843eea1631c1dd4ad8b053866867c1bc3329eccf258bdabdfeee8cc33";
constexpr std::string_view kCookieKey =
    "09b51b46f42a70b913a1d181fae2be22f24cdb107f13673a9612d226f03b8ae1";
constexpr std::string_view kCookieNonce = "20166e0d99a85a530ab55917e9e7db15";
constexpr std::string_view kWelcomeNonce = "6d177f97016baa0a20ce8d9b29e28b80";

// Bodies of the frames of both directions.
constexpr std::string_view kClientHello =
    "0548454c4c4f01000000000000000000000000000000000000000000000000000000000000000000000000000000"
    "000000000000000000000000000000000000000000000000000000000000000000009906576a0460eb25970f3389"
    "74d46bf9c5bc53dad11c2b896f67f34fc0c9106b0000000000000001ef0fe8479e54be637edb4c17dd3fd6b092d4"
    "d787fcc08a0145dabd0a0f439273e258a6c33411e13950535e53d1588c387cdce98cf4ee5246d5e94bdac5e32918"
    "27ac6f5215cd23d49f86c2f1f8ddfd5e";
constexpr std::string_view kClientInitiate =
    "08494e49544941544520166e0d99a85a530ab55917e9e7db15425f0427d428b224d0f2a3f1c5a07c69c748195357"
    "5ffa158a7c4f2f3040e364c035263b54eb26f76bbf3d9da4dbc4976a467fe0c22b0526ff2a9a9768bbdce29d9401"
    "102f938d390ef5480e7880b9960000000000000002d7fb6ec2a89addbb492120cb46c0bcdb2efc18b4adeb069297"
    "a917de35542c092ce0e279ca8abf3883e74dc667d11a91b9295f759a38d281eb189cf85e9cf209d61e98e9b25f30"
    "7874416e7d3f0e693f1e766e7801479fd33bbacc2a369d0d2ea03056b1f67dc39acc5779049ebcecdb1c70ed0a08"
    "4b135c33b2d6392fcd6acd282158763964be134a8828fd09fe7cbf5f82f14299fdcbfee2275e6738e0f27388a296"
    "51c6be5759ea3ff6a7bb1a9362d42914";
constexpr std::string_view kClientQuestion =
    "074d4553534147450000000000000003e5dfc0f3d4e114563c09f0e165cc0a7857477e66628cd74b7270a8";
constexpr std::string_view kServerWelcome =
    "0757454c434f4d456d177f97016baa0a20ce8d9b29e28b808177b630559f0a5a7d1971d1e83c93e332d0dfba1044"
    "d5f4f5cd9d9c258a6dffb1c6e78748d85a64170ddeacf112c660cdf5363013bba48187a25dd3bce9b245e4e83855"
    "d08160e83d1396687627f2af7036c01cc77eab6f0e161b23efccb28524f11169a8e8213c51f69d4e303e8aec7ba9"
    "5e5c528e6f394d477588d647600c04806c9ffceceff969e39507cc0e6dfb";
constexpr std::string_view kServerReady =
    "055245414459000000000000000183d2a0c1b803be69edb04a281439dbb365fda806dd1f4e401f9ef4a01688702b"
    "756704f8cf7615e15789f484b952c0104562b4";
constexpr std::string_view kServerAnswer =
    "074d455353414745000000000000000202eca3023c5a480e98695370da0b6d8047823784da21f9b87fd827";

}  // namespace recorded

std::string bytes_of(std::string_view hex) {
  std::string bytes(hex.size() / 2, '\0');
  if (sodium_hex2bin(raw(bytes.data()), bytes.size(), hex.data(), hex.size(), nullptr, nullptr,
                     nullptr) != 0) {
    throw std::runtime_error("not hexadecimal");
  }
  return bytes;
}

/// A command without its name.
std::string data_of(std::string_view hex) {
  const std::string body = bytes_of(hex);
  return body.substr(1 + static_cast<unsigned char>(body.front()));
}

/// During its lifetime libsodium returns the recorded random numbers.
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

TEST(CurveVectorsTest, WithTheSameRandomNumbersTheServerSendsTheSameBytesAsLibzmq) {
  protocol::KeyPair server;
  std::ranges::copy(bytes_of(recorded::kServerSecret), server.secret_key.bytes().begin());
  server.public_key = protocol::public_half_of(server.secret_key);
  protocol::CurveKey client{};
  std::ranges::copy(bytes_of(recorded::kClientPublic), client.begin());
  ListAuthenticator authenticator;
  authenticator.add(client, "anna");
  const PortSecurity security{server, authenticator};
  CurveHandshake handshake(security);
  const RecordedRandomness randomness;

  EXPECT_EQ(std::get<std::string>(handshake.take("HELLO", data_of(recorded::kClientHello))),
            data_of(recorded::kServerWelcome));
  const std::string identity("\x08Identity\0\0\0\0", 13);
  EXPECT_EQ(std::get<std::string>(handshake.take("INITIATE", data_of(recorded::kClientInitiate))),
            zmtp_properties("DEALER") + identity);
  ASSERT_TRUE(handshake.is_done());
  EXPECT_EQ(handshake.key(), client);
  CurveSession& session = handshake.session();
  EXPECT_EQ(session.ready(zmtp_properties("ROUTER") + identity), data_of(recorded::kServerReady));
  EXPECT_EQ(session.open(bytes_of(recorded::kClientQuestion)), "a question");
  std::string answer;
  session.seal("A QUESTION", answer);
  EXPECT_EQ(answer, bytes_of(recorded::kServerAnswer));
}

}  // namespace
}  // namespace oblique::server
