// Tests of the admission of peers, and of the addresses of ports and peers.
#include "server/network/access.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <variant>

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include "proto/keys/key_file.h"
#include "server/network/listener.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using protocol::AuthorizedKeys;
using protocol::Role;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

std::string address_or_error(const AccessSettings& settings) {
  try {
    return "bound to " + address_to_bind(settings);
  } catch (const solver::InputError& error) {
    return error.what();
  }
}

TEST(AddressToBindTest, OnlyLoopbackIsAllowedWithoutKeysUnlessInsecureIsGiven) {
  EXPECT_EQ(address_to_bind({.listen = "localhost"}), "127.0.0.1");
  for (const std::string address : {"127.3.2.1", "::1"}) {
    EXPECT_EQ(address_to_bind({.listen = address}), address);
  }
  for (const std::string address :
       {"0.0.0.0", "192.168.0.1", "::", "128.0.0.1", "fe80::1", "fe80::1%eth0"}) {
    EXPECT_THAT(address_or_error({.listen = address}),
                AllOf(HasSubstr("--listen " + address), HasSubstr("oblique keygen"),
                      HasSubstr("--insecure")));
    EXPECT_EQ(address_to_bind({address, "server.key", false}), address);
    EXPECT_EQ(address_to_bind({address, "", true}), address);
  }
  EXPECT_THAT(address_or_error({.listen = "*"}), HasSubstr("--insecure"));
  EXPECT_THAT(address_to_bind({"*", "", true}), AnyOf("::", "0.0.0.0"));
}

TEST(AddressToBindTest, InvalidAddressesAndTheCombinationOfKeysAndInsecureAreRefused) {
  for (const char* address : {"example.org", "", "1.2.3", "127.0.0.1:7600", "[::1]"}) {
    EXPECT_THAT(address_or_error({address, "", true}), HasSubstr("is not an address"));
  }
  EXPECT_THAT(address_or_error({"127.0.0.1", "server.key", true}), HasSubstr("cannot be combined"));
}

class AccessControlTest : public testing::Test {
 protected:
  using PortRole = AccessControl::PortRole;

  AccessControlTest() {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>(
        "test", std::make_shared<spdlog::sinks::ostream_sink_st>(log_)));
    protocol::write_key_file(server_key_, {Role::kServer, "server", server_});
  }
  ~AccessControlTest() override { spdlog::set_default_logger(logger_); }

  /// Returns the log lines since the last call.
  std::string take_log() {
    const std::string text = log_.str();
    log_.str("");
    return text;
  }
  protocol::CurveKey add(const std::string& name, Role role = Role::kWorker) {
    const protocol::CurveKey key = protocol::generate_key_pair().public_key;
    protocol::change_authorized_keys(list_, [&](AuthorizedKeys& keys) {
      keys.add({name, role, key, "2026-11-22T03:00:00Z"});
    });
    return key;
  }
  AccessControl control() const { return AccessControl({"127.0.0.1", server_key_, false}); }
  bool refresh(AccessControl& control) { return control.refresh(now_ms_ += 500); }
  /// Returns the name of the key if the key is admitted, otherwise the cause of the refusal.
  static std::string result_of(const AccessControl& control, const protocol::CurveKey& key,
                               PortRole port = PortRole::kWorkers) {
    const AuthResult result = control.security(port)->authenticate(key);
    const auto* const refusal = std::get_if<Refusal>(&result);
    return refusal != nullptr ? std::string(name_of(refusal->cause))
                              : std::get<std::shared_ptr<const KeyIdentity>>(result)->name;
  }

  test::TemporaryFolder folder_;
  std::string server_key_ = folder_.file("server.key");
  std::string list_ = folder_.file("authorized_keys.toml");
  protocol::KeyPair server_ = protocol::generate_key_pair();
  std::ostringstream log_;
  std::shared_ptr<spdlog::logger> logger_ = spdlog::default_logger();
  std::int64_t now_ms_ = 0;
};

TEST_F(AccessControlTest, AServerNeedsItsOwnKeyFileAndTheListBesideIt) {
  EXPECT_THROW(control(), solver::InputError) << "a missing list of keys is an error";
  add("w");
  const AccessControl access = control();
  EXPECT_EQ(access.mode(), AccessMode::kKeys);
  EXPECT_EQ(access.security(PortRole::kWorkers)->server.public_key, server_.public_key);
  EXPECT_THAT(take_log(), AllOf(HasSubstr("the 1 keys of " + list_),
                                HasSubstr(protocol::z85(server_.public_key))));
  protocol::write_key_file(folder_.file("worker.key"),
                           {Role::kWorker, "w", protocol::generate_key_pair(), server_.public_key});
  EXPECT_THROW(AccessControl({"127.0.0.1", folder_.file("worker.key"), false}), solver::InputError);
}

TEST_F(AccessControlTest, EachRoleHasItsPort) {
  const auto worker = add("w");
  const auto client = add("c", Role::kClient);
  const auto reader = add("r", Role::kReader);
  const AccessControl access = control();
  EXPECT_EQ(result_of(access, worker), "w");
  EXPECT_EQ(result_of(access, client, PortRole::kClients), "c");
  EXPECT_EQ(result_of(access, reader, PortRole::kClients), "r");
  EXPECT_EQ(result_of(access, worker, PortRole::kClients), "key of another role");
  EXPECT_EQ(result_of(access, client), "key of another role");
  EXPECT_EQ(result_of(access, reader), "key of another role");
  EXPECT_EQ(result_of(access, protocol::generate_key_pair().public_key), "unknown key");
}

TEST_F(AccessControlTest, ChangesOfTheListAreReadTwiceASecond) {
  const auto first = add("first");
  AccessControl access = control();
  EXPECT_FALSE(refresh(access));
  take_log();
  const auto second = add("second");
  EXPECT_FALSE(access.refresh(now_ms_ + 499));
  EXPECT_TRUE(refresh(access));
  EXPECT_THAT(take_log(), HasSubstr("new: second (worker)"));
  EXPECT_EQ(result_of(access, second), "second");
  protocol::change_authorized_keys(list_, [](AuthorizedKeys& keys) { keys.remove("first"); });
  EXPECT_TRUE(refresh(access));
  EXPECT_THAT(take_log(), HasSubstr("revoked: first"));
  EXPECT_EQ(result_of(access, first), "unknown key");
  EXPECT_FALSE(refresh(access));
}

TEST_F(AccessControlTest, AnInvalidOrMissingListChangesNothingAndIsLoggedOnce) {
  const auto key = add("w");
  AccessControl access = control();
  std::ofstream(list_, std::ios::app) << "[[key";
  take_log();
  EXPECT_FALSE(refresh(access));
  EXPECT_THAT(take_log(), AllOf(HasSubstr(list_), HasSubstr("stay the same")));
  EXPECT_FALSE(refresh(access));
  EXPECT_THAT(take_log(), IsEmpty());
  std::filesystem::remove(list_);
  EXPECT_FALSE(refresh(access));
  EXPECT_EQ(result_of(access, key), "w");
  const auto other = add("other");
  EXPECT_TRUE(refresh(access));
  EXPECT_EQ(result_of(access, key), "unknown key");
  EXPECT_EQ(result_of(access, other), "other");
}

TEST_F(AccessControlTest, AnEmptyListAppliesFromItsFourthReadAsAnEditorMayBeWriting) {
  const auto key = add("w");
  AccessControl access = control();
  std::ofstream(list_, std::ios::trunc).close();
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(refresh(access));
    EXPECT_EQ(result_of(access, key), "w");
  }
  EXPECT_TRUE(refresh(access));
  EXPECT_EQ(result_of(access, key), "unknown key");
}

TEST_F(AccessControlTest, WithoutProtectionAWarningIsLoggedEveryTenMinutes) {
  AccessControl insecure({"0.0.0.0", "", true});
  EXPECT_EQ(insecure.mode(), AccessMode::kInsecure);
  EXPECT_FALSE(insecure.refresh(5));
  EXPECT_THAT(take_log(), AllOf(HasSubstr("INSECURE"), HasSubstr("0.0.0.0")));
  EXPECT_FALSE(insecure.refresh(6));
  EXPECT_THAT(take_log(), IsEmpty());
  EXPECT_FALSE(insecure.refresh(700'000));
  EXPECT_THAT(take_log(), HasSubstr("INSECURE"));
  AccessControl loopback({});
  EXPECT_FALSE(loopback.refresh(5));
  EXPECT_THAT(take_log(), IsEmpty());
  EXPECT_FALSE(loopback.security(PortRole::kWorkers));
}

// ---- Addresses of both families -----------------------------------------------------------------

/// Returns an IPv6 address, or an IPv4 address mapped into IPv6.
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

/// Returns a listener on an address, or nothing if the machine has no IPv6.
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

TEST(PeerAddressTest, IsFormattedAsInEndpoints) {
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

TEST(ListenerTest, TheAddressOfAPeerHasTheNotationOfItsFamily) {
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

TEST(ListenerTest, TheIpv6WildcardAcceptsBothFamilies) {
  const auto both = listening("::");
  if (!both) {
    GTEST_SKIP() << "this machine has no IPv6";
  }
  EXPECT_THAT(both->endpoint(), StartsWith("tcp://[::]:"));
  EXPECT_THAT(address_of_peer(*both, "::1"), StartsWith("[::1]:"));
  EXPECT_THAT(address_of_peer(*both, "::ffff:127.0.0.1"), StartsWith("127.0.0.1:"));
}

TEST(ListenerTest, PortsInUseAndInvalidAddressesAreReported) {
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
  EXPECT_THAT(error_of("127.0.0.1", port), AllOf(HasSubstr("tcp://127.0.0.1:" + port),
                                                 HasSubstr("another server may be running")));
  for (const char* const address : {"localhost", "::1::", "[::1", "::g"}) {
    EXPECT_THAT(error_of(address, port), HasSubstr(address));
  }
}

}  // namespace
}  // namespace oblique::server
