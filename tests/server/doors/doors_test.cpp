#include "server/doors/doors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::SizeIs;

std::string objection_to_doors(const DoorSettings& settings) {
  try {
    return "bound to " + address_to_bind(settings);
  } catch (const solver::InputError& error) {
    return error.what();
  }
}

TEST(DoorsTest, WithoutKeysOnlyLoopbackIsListenedOn) {
  EXPECT_EQ(address_to_bind({.listen = "localhost"}), "127.0.0.1");
  EXPECT_EQ(address_to_bind({.listen = "127.3.2.1"}), "127.3.2.1");
  EXPECT_EQ(address_to_bind({.listen = "::1"}), "::1");
  for (const char* address :
       {"0.0.0.0", "*", "192.168.0.1", "::", "128.0.0.1", "fe80::1", "fe80::1%eth0"}) {
    EXPECT_THAT(objection_to_doors({.listen = address}),
                AllOf(HasSubstr("--listen " + std::string(address)), HasSubstr("oblique keygen"),
                      HasSubstr("--insecure")));
  }
}

TEST(DoorsTest, WithKeysOrInsecurelyAnyAddressIsListenedOn) {
  for (const DoorSettings& door :
       {DoorSettings{"0.0.0.0", "server.key", false}, DoorSettings{"0.0.0.0", "", true}}) {
    EXPECT_EQ(address_to_bind(door), "0.0.0.0");
  }
  EXPECT_EQ(address_to_bind({"2001:db8::1", "server.key", false}), "2001:db8::1");
  EXPECT_EQ(address_to_bind({"fe80::1%eth0", "server.key", false}), "fe80::1%eth0");
  EXPECT_THAT(address_to_bind({"*", "", true}), AnyOf("::", "0.0.0.0"));
}

TEST(DoorsTest, TextThatIsNoAddressIsRefusedWhateverElseIsGiven) {
  for (const char* address : {"example.org", "", "1.2.3", "127.0.0.1:7600", "[::1]"}) {
    EXPECT_THAT(objection_to_doors({address, "", true}), HasSubstr("is no address"));
  }
  EXPECT_THAT(objection_to_doors({"127.0.0.1", "server.key", true}), HasSubstr("exclude"));
}

TEST(DoorsTest, AnOpenDoorIsWarnedOfAtOnceAndAgainLater) {
  Doors open({"0.0.0.0", "", true});
  EXPECT_EQ(open.access(), Access::kInsecure);
  const auto lines = open.look(5).lines;
  ASSERT_THAT(lines, SizeIs(1));
  EXPECT_TRUE(lines.front().is_warning);
  EXPECT_THAT(lines.front().text, AllOf(HasSubstr("INSECURE"), HasSubstr("0.0.0.0")));
  EXPECT_THAT(open.look(6).lines, SizeIs(0));
  EXPECT_THAT(open.look(700'000).lines, SizeIs(1));
  Doors closed({});
  EXPECT_EQ(closed.access(), Access::kLoopback);
  EXPECT_THAT(closed.look(5).lines, SizeIs(0));
  EXPECT_FALSE(closed.guard(PortKeeper::Port::kWorkers));
}

}  // namespace
}  // namespace oblique::server
