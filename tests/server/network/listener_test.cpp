// Addresses of both families.
#include "server/network/listener.h"

#include <optional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <poll.h>
#include <unistd.h>

namespace oblique::server {
namespace {

using testing::StartsWith;

/// None where the machine has no IPv6.
std::optional<Listener> listening(const std::string& address) {
  try {
    return Listener(address, "*");
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

std::string address_of_peer(const Listener& listener, const std::string& from) {
  const std::string& endpoint = listener.endpoint();
  PeerAddress to(from,
                 static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
  const protocol::Descriptor peer(::socket(to.system()->sa_family, SOCK_STREAM, 0));
  if (::connect(peer.number(), to.system(), to.bytes()) != 0) {
    return "cannot connect";
  }
  pollfd item{listener.descriptor(), POLLIN, 0};
  ::poll(&item, 1, -1);
  return listener.accept().address.text();
}

TEST(ListenerTest, AddressesAreWrittenAsTheyAreInEndpoints) {
  EXPECT_EQ(PeerAddress("127.0.0.1", 7600).text(), "127.0.0.1:7600");
  EXPECT_EQ(PeerAddress("::1", 7600).text(), "[::1]:7600");
  EXPECT_EQ(PeerAddress("[::1]", 7600).text(), "[::1]:7600");
  EXPECT_EQ(PeerAddress("::", 1).text(), "[::]:1");
  EXPECT_EQ(PeerAddress("2001:0DB8::0:1", 65535).text(), "[2001:db8::1]:65535");
  EXPECT_EQ(PeerAddress("::ffff:10.0.0.3", 4711).text(), "10.0.0.3:4711");
}

TEST(ListenerTest, WhatIsNoNumericAddressIsRefused) {
  for (const char* const text :
       {"", "localhost", "127.0.0", "::1::", "[127.0.0.1]", "[::1", "::g"}) {
    EXPECT_THROW(PeerAddress(text, 7600), std::runtime_error) << text;
  }
}

TEST(ListenerTest, APeerOfTheSameFamilyHasItsAddress) {
  const Listener v4("127.0.0.1", "*");
  EXPECT_THAT(v4.endpoint(), StartsWith("tcp://127.0.0.1:"));
  EXPECT_THAT(address_of_peer(v4, "127.0.0.1"), StartsWith("127.0.0.1:"));
  const auto v6 = listening("::1");
  if (!v6) {
    GTEST_SKIP() << "this machine has no IPv6";
  }
  EXPECT_THAT(v6->endpoint(), StartsWith("tcp://[::1]:"));
  EXPECT_THAT(address_of_peer(*v6, "::1"), StartsWith("[::1]:"));
}

TEST(ListenerTest, AtTwoColonsPeersOfBothFamiliesComeIn) {
  const auto both = listening("::");
  if (!both) {
    GTEST_SKIP() << "this machine has no IPv6";
  }
  EXPECT_THAT(both->endpoint(), StartsWith("tcp://[::]:"));
  EXPECT_THAT(address_of_peer(*both, "::1"), StartsWith("[::1]:"));
  EXPECT_THAT(address_of_peer(*both, "127.0.0.1"), StartsWith("127.0.0.1:"));
}

TEST(ListenerTest, APortThatIsTakenIsNamed) {
  const Listener first("127.0.0.1", "*");
  const std::string port = first.endpoint().substr(first.endpoint().rfind(':') + 1);
  try {
    const Listener second("127.0.0.1", port);
    FAIL() << "two listen on one port";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("tcp://127.0.0.1:" + port),
                                             testing::HasSubstr("does a server run already?")));
  }
}

TEST(PeerAddressTest, OfOneSourceAreAllPortsOfAnIpv4AddressAndAllAddressesOfAnIpv6Network) {
  const auto source_of = [](const std::string& address, std::uint16_t port = 1) {
    return PeerAddress(address, port).source();
  };
  EXPECT_EQ(source_of("10.0.0.3"), source_of("10.0.0.3", 2));
  EXPECT_EQ(source_of("10.0.0.3"), source_of("::ffff:10.0.0.3"));
  EXPECT_NE(source_of("10.0.0.3"), source_of("10.0.0.4"));
  EXPECT_EQ(source_of("2001:db8::1"), source_of("2001:db8::ffff:1:2:3"));
  EXPECT_NE(source_of("2001:db8::1"), source_of("2001:db8:0:1::1"));
}

}  // namespace
}  // namespace oblique::server
