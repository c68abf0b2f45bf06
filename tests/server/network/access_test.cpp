#include "server/network/access.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include "proto/keys/key_file.h"
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

std::string address_or_error(const AccessSettings& settings) {
  try {
    return "bound to " + address_to_bind(settings);
  } catch (const solver::InputError& error) {
    return error.what();
  }
}

TEST(AddressToBindTest, WithoutKeysOrInsecureOnlyLoopbackIsAllowed) {
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

TEST(AddressToBindTest, OtherTextAndKeysWithInsecureAreRefused) {
  for (const char* address : {"example.org", "", "1.2.3", "127.0.0.1:7600", "[::1]"}) {
    EXPECT_THAT(address_or_error({address, "", true}), HasSubstr("is not an address"));
  }
  EXPECT_THAT(address_or_error({"127.0.0.1", "server.key", true}), HasSubstr("exclude"));
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

  /// What was logged since the last call.
  std::string take_log() {
    const std::string text = log_.str();
    log_.str("");
    return text;
  }
  protocol::CurveKey add(const std::string& name, Role role = Role::kWorker) {
    const protocol::CurveKey key = protocol::made_key_pair().public_key;
    protocol::change_authorized_keys(list_, [&](AuthorizedKeys& keys) {
      keys.add({name, role, key, protocol::utc_now()});
    });
    return key;
  }
  AccessControl control() const { return AccessControl({"127.0.0.1", server_key_, false}); }
  bool refresh(AccessControl& control) { return control.refresh(now_ms_ += 500); }
  /// The name with which a key is admitted, or the cause of its refusal.
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
  protocol::KeyPair server_ = protocol::made_key_pair();
  std::ostringstream log_;
  std::shared_ptr<spdlog::logger> logger_ = spdlog::default_logger();
  std::int64_t now_ms_ = 0;
};

TEST_F(AccessControlTest, AServerNeedsItsOwnKeyFileAndTheListBesideIt) {
  EXPECT_THROW(control(), solver::InputError) << "there is no list";
  add("w");
  const AccessControl access = control();
  EXPECT_EQ(access.mode(), AccessMode::kKeys);
  EXPECT_EQ(access.security(PortRole::kWorkers)->server.public_key, server_.public_key);
  EXPECT_THAT(take_log(), AllOf(HasSubstr("the 1 keys of " + list_),
                                HasSubstr(protocol::z85(server_.public_key))));
  protocol::write_key_file(folder_.file("worker.key"),
                           {Role::kWorker, "w", protocol::made_key_pair(), server_.public_key});
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
  EXPECT_EQ(result_of(access, protocol::made_key_pair().public_key), "unknown key");
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

TEST_F(AccessControlTest, AListThatIsBrokenOrGoneChangesNothingAndIsLoggedOnce) {
  const auto key = add("w");
  AccessControl access = control();
  std::ofstream(list_, std::ios::app) << "[[key";
  take_log();
  EXPECT_FALSE(refresh(access));
  EXPECT_THAT(take_log(), AllOf(HasSubstr(list_), HasSubstr("remain admitted")));
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

TEST_F(AccessControlTest, AnEmptiedListCountsFromTheFourthTimeAsAnEditorMayGoOnToWrite) {
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

}  // namespace
}  // namespace oblique::server
