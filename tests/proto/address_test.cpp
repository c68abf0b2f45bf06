#include "proto/address.h"

#include <string>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

TEST(Address, IsObjectedToUnlessItHasAPortThatExistsAndBracketsAroundIpv6) {
  for (const char* url : {"tcp://127.0.0.1:7600", "tcp://host:1", "tcp://[::1]:65535",
                          "ipc:///tmp/x", "inproc://x"}) {
    EXPECT_EQ(objection_to_address(url), "") << url;
  }
  for (const char* url : {"tcp://127.0.0.1:0", "tcp://127.0.0.1:65536", "tcp://127.0.0.1:76x",
                          "tcp://127.0.0.1:", "tcp://127.0.0.1", "tcp://", "tcp://127.0.0.1:-1",
                          "tcp://127.0.0.1:99999999999999999999"}) {
    EXPECT_NE(objection_to_address(url).find("port"), std::string::npos) << url;
  }
  EXPECT_NE(objection_to_address("tcp://::1:7601").find("brackets"), std::string::npos);
}

TEST(Address, NamesAHost) {
  EXPECT_EQ(host_of("tcp://127.0.0.1:7600"), "127.0.0.1");
  EXPECT_EQ(host_of("tcp://coordinator:7600"), "coordinator");
  EXPECT_EQ(host_of("tcp://[fe80::1%eth0]:7600"), "fe80::1%eth0");
  for (const char* url : {"tcp://[]:1", "tcp://:1", "ipc:///tmp/x", "inproc://x", ""}) {
    EXPECT_EQ(host_of(url), "") << url;
  }
}

TEST(Address, IsOfTheFamilyThatItIsWrittenIn) {
  const Families v4 = families_of("192.0.2.1");
  EXPECT_TRUE(v4.has_v4);
  EXPECT_FALSE(v4.has_v6);
  const Families v6 = families_of("2001:db8::1");
  EXPECT_FALSE(v6.has_v4);
  EXPECT_TRUE(v6.has_v6);
  const Families none = families_of("");
  EXPECT_FALSE(none.has_v4 || none.has_v6);
}

}  // namespace
}  // namespace oblique::protocol
