#include "proto/address.h"

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

TEST(Address, PassesWithAPortThatThereCanBe) {
  for (const char* url : {"tcp://127.0.0.1:7600", "tcp://host:1", "tcp://[::1]:65535",
                          "ipc:///tmp/x", "inproc://x"}) {
    EXPECT_EQ(objection_to_address(url), "") << url;
  }
}

TEST(Address, IsObjectedToWithoutOne) {
  for (const char* url : {"tcp://127.0.0.1:0", "tcp://127.0.0.1:65536", "tcp://127.0.0.1:99999",
                          "tcp://127.0.0.1:76x", "tcp://127.0.0.1:", "tcp://127.0.0.1", "tcp://",
                          "tcp://127.0.0.1:-1", "tcp://127.0.0.1:99999999999999999999"}) {
    EXPECT_NE(objection_to_address(url), "") << url;
  }
}

}  // namespace
}  // namespace oblique::protocol
