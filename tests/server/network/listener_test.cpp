// Addresses of both families.
#include "server/network/listener.h"

#include <optional>
#include <string>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <poll.h>
#include <sys/socket.h>

namespace oblique::server {
namespace {

using testing::StartsWith;

/// An IPv6 address, or an IPv4 one mapped into IPv6.
sockaddr_in6 system_address(const std::string& address, int port) {
  sockaddr_in6 v6{};
  EXPECT_EQ(inet_pton(AF_INET6, address.c_str(), &v6.sin6_addr), 1) << address;
  v6.sin6_family = AF_INET6;
  v6.sin6_port = htons(static_cast<std::uint16_t>(port));
  return v6;
}

PeerAddress peer_address(const std::string& address, int port = 1) {
  return PeerAddress(system_address(address, port));
}

/// Nothing where the machine has no IPv6.
std::optional<Listener> listening(const std::string& address) {
  try {
    return Listener(address, "*");
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

std::string address_of_peer(const Listener& listener, const std::string& from) {
  const std::string& endpoint = listener.endpoint();
  const auto port = static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1)));
  const sockaddr_in6 to = system_address(from, port);
  const protocol::Descriptor peer(::socket(AF_INET6, SOCK_STREAM, 0));
  if (::connect(peer.number(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    return "cannot connect";
  }
  pollfd item{listener.descriptor(), POLLIN, 0};
  ::poll(&item, 1, -1);
  return listener.accept().address.text;
}

TEST(PeerAddressTest, IsWrittenAsInEndpoints) {
  EXPECT_EQ(peer_address("::1", 7600).text, "[::1]:7600");
  EXPECT_EQ(peer_address("2001:0DB8::0:1", 65535).text, "[2001:db8::1]:65535");
  EXPECT_EQ(peer_address("::ffff:10.0.0.3", 4711).text, "10.0.0.3:4711");
}

TEST(PeerAddressTest, AllPortsOfAnIpv4AddressAndAllAddressesOfAnIpv6NetworkAreOneSource) {
  EXPECT_EQ(peer_address("::ffff:10.0.0.3").source, peer_address("::ffff:10.0.0.3", 2).source);
  EXPECT_NE(peer_address("::ffff:10.0.0.3").source, peer_address("::ffff:10.0.0.4").source);
  EXPECT_EQ(peer_address("2001:db8::1").source, peer_address("2001:db8::ffff:1:2:3").source);
  EXPECT_NE(peer_address("2001:db8::1").source, peer_address("2001:db8:0:1::1").source);
}

TEST(ListenerTest, APeerOfTheSameFamilyHasItsAddress) {
  const Listener v4("127.0.0.1", "*");
  EXPECT_THAT(v4.endpoint(), StartsWith("tcp://127.0.0.1:"));
  EXPECT_THAT(address_of_peer(v4, "::ffff:127.0.0.1"), StartsWith("127.0.0.1:"));
  const auto v6 = listening("::1");
  if (!v6) {
    GTEST_SKIP() << "this machine has no IPv6";
  }
  EXPECT_THAT(v6->endpoint(), StartsWith("tcp://[::1]:"));
  EXPECT_THAT(address_of_peer(*v6, "::1"), StartsWith("[::1]:"));
}

TEST(ListenerTest, AtTwoColonsPeersOfBothFamiliesAreAccepted) {
  const auto both = listening("::");
  if (!both) {
    GTEST_SKIP() << "this machine has no IPv6";
  }
  EXPECT_THAT(both->endpoint(), StartsWith("tcp://[::]:"));
  EXPECT_THAT(address_of_peer(*both, "::1"), StartsWith("[::1]:"));
  EXPECT_THAT(address_of_peer(*both, "::ffff:127.0.0.1"), StartsWith("127.0.0.1:"));
}

TEST(ListenerTest, APortThatIsTakenAndAddressesThatAreNotNumericAreNamed) {
  const auto error_of = [](const std::string& address, const std::string& port) -> std::string {
    try {
      const Listener listener(address, port);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  };
  const Listener first("127.0.0.1", "*");
  const std::string port = first.endpoint().substr(first.endpoint().rfind(':') + 1);
  EXPECT_THAT(error_of("127.0.0.1", port),
              testing::AllOf(testing::HasSubstr("tcp://127.0.0.1:" + port),
                             testing::HasSubstr("does a server run already?")));
  for (const char* const address : {"localhost", "::1::", "[::1", "::g"}) {
    EXPECT_THAT(error_of(address, port), testing::HasSubstr(address));
  }
}

}  // namespace
}  // namespace oblique::server
