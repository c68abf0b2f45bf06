// Tests of functions for files, memory and addresses.
#include <filesystem>
#include <fstream>
#include <string>

#include <sys/stat.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/address.h"
#include "proto/small_file.h"
#include "proto/system/available_memory.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class SmallFile : public testing::Test {
 protected:
  std::string error_for(const std::string& path) const {
    try {
      read_small_file(path, "the list", 10);
      return "";
    } catch (const solver::InputError& error) {
      EXPECT_THAT(error.what(), StartsWith("the list " + path + " cannot be read: "));
      return error.what();
    }
  }

  test::TemporaryFolder folder_;
  std::string file_ = folder_.file("a");
};

TEST_F(SmallFile, IsReadCompletelyAndTheNullDeviceIsEmpty) {
  const std::string text("ten\nbyt\0es", 10);
  std::ofstream(file_) << text;
  EXPECT_EQ(read_small_file(file_, "the list", 10), text);
  EXPECT_EQ(read_small_file("/dev/null", "the list", 10), "");
}

TEST_F(SmallFile, IsRefusedWithoutBlockingIfMissingTooLongOrNotRegular) {
  EXPECT_THAT(error_for(file_), HasSubstr("No such file"));
  EXPECT_THAT(error_for("/dev/zero"), HasSubstr("it is a device, "));
  EXPECT_THAT(error_for(folder_.path().string()), HasSubstr("it is a directory, "));
  std::ofstream(file_) << std::string(11, 'x');
  EXPECT_THAT(error_for(file_), HasSubstr("it has 11 bytes, and at most 10 are allowed"));
  const std::string pipe = folder_.file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(error_for(pipe),
              HasSubstr("it is a pipe, and must be a regular file of at most 10 bytes"));
}

TEST(MemoryLimit, IsTheSmallestOfTheProcessGroupAndItsParents) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder.path() / "a" / "b");
  std::ofstream(folder.file("a/memory.max")) << "500000000\n";
  std::ofstream(folder.file("a/b/memory.max")) << "max\n";
  const std::string root = folder.path().string();
  EXPECT_EQ(memory_limit_bytes(root, "0::/a/b\n"), 500'000'000U);
  EXPECT_FALSE(memory_limit_bytes(root, "0::/\n"));
}

TEST(Address, NeedsAValidPortAndBracketsAroundIpv6) {
  for (const char* url : {"tcp://127.0.0.1:7600", "tcp://host:1", "tcp://[::1]:65535",
                          "ipc:///tmp/x", "inproc://x"}) {
    EXPECT_EQ(address_error(url), "") << url;
  }
  for (const char* url : {"tcp://127.0.0.1:0", "tcp://127.0.0.1:65536", "tcp://127.0.0.1:76x",
                          "tcp://127.0.0.1:", "tcp://127.0.0.1", "tcp://", "tcp://127.0.0.1:-1",
                          "tcp://127.0.0.1:99999999999999999999"}) {
    EXPECT_NE(address_error(url).find("port"), std::string::npos) << url;
  }
  EXPECT_NE(address_error("tcp://::1:7601").find("brackets"), std::string::npos);
}

TEST(Address, MayContainTheNameOfAHost) {
  EXPECT_EQ(host_of("tcp://127.0.0.1:7600"), "127.0.0.1");
  EXPECT_EQ(host_of("tcp://coordinator:7600"), "coordinator");
  EXPECT_EQ(host_of("tcp://[fe80::1%eth0]:7600"), "fe80::1%eth0");
  for (const char* url : {"tcp://[]:1", "tcp://:1", "ipc:///tmp/x", "inproc://x", ""}) {
    EXPECT_EQ(host_of(url), "") << url;
  }
}

TEST(Address, HasTheFamilyOfItsNotation) {
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
