// Tests of functions for files, memory and addresses.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/address.h"
#include "proto/small_file.h"
#include "proto/system/resources.h"
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

/// A root folder whose files tests write.
class ControlGroups : public testing::Test {
 protected:
  void write(const std::string& file, const std::string& text) const {
    const auto path = folder_.path() / file;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
  }

  test::TemporaryFolder folder_;
  std::string root_ = folder_.path().string();
};

TEST_F(ControlGroups, LimitMemoryByTheSmallestOfTheProcessGroupAndItsParents) {
  write("proc/meminfo", "MemTotal: 4000000 kB\nMemAvailable: 1000000 kB\n");
  write("proc/self/cgroup", "0::/\n");
  EXPECT_EQ(available_memory_bytes(root_), 1'024'000'000U);
  write("sys/fs/cgroup/a/memory.max", "500000000\n");
  write("sys/fs/cgroup/a/b/memory.max", "max\n");
  EXPECT_EQ(available_memory_bytes(root_), 1'024'000'000U);
  write("proc/self/cgroup", "0::/a/b\n");
  EXPECT_EQ(available_memory_bytes(root_), 500'000'000U);
}

/// Calls `check` while this thread may use only the first `allowed` of its processors.
void with_processors(std::size_t allowed, const std::function<void()>& check) {
  cpu_set_t mask;
  ASSERT_EQ(sched_getaffinity(0, sizeof mask, &mask), 0);
  const cpu_set_t before = mask;
  for (std::size_t i = 0, kept = 0; i < CPU_SETSIZE; ++i) {
    if (CPU_ISSET(i, &mask) && ++kept > allowed) {
      CPU_CLR(i, &mask);
    }
  }
  ASSERT_EQ(sched_setaffinity(0, sizeof mask, &mask), 0);
  check();
  ASSERT_EQ(sched_setaffinity(0, sizeof before, &before), 0);
}

TEST_F(ControlGroups, WithoutQuotasTheAffinityMaskLimitsProcessors) {
  with_processors(1, [&] {
    const Processors usable = usable_processors(root_);
    EXPECT_EQ(usable.count, 1U);
    if (sysconf(_SC_NPROCESSORS_ONLN) > 1) {
      EXPECT_THAT(usable.reason, HasSubstr("affinity"));
    }
  });
}

TEST_F(ControlGroups, LimitProcessorsByTheSmallestQuota) {
  const unsigned all = usable_processors(root_).count;
  ASSERT_GE(all, 1U);
  write("proc/self/cgroup", "4:cpuset:/x\n3:cpu,cpuacct:/b/c\n0::/a/in\n");
  write("sys/fs/cgroup/a/in/cpu.max", "max 100000\n");
  write("sys/fs/cgroup/a/cpu.max", "400000000 100000\n");
  write("sys/fs/cgroup/cpu,cpuacct/b/c/cpu.cfs_quota_us", "-1\n");
  write("sys/fs/cgroup/cpu,cpuacct/b/c/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(usable_processors(root_).count, all) << "4000 processors";
  EXPECT_EQ(usable_processors(root_).reason, usable_processors("/nowhere").reason);
  const auto expect_one = [&](const std::string& quota) {
    EXPECT_EQ(usable_processors(root_).count, 1U);
    if (all > 1) {
      EXPECT_THAT(usable_processors(root_).reason, HasSubstr(" is " + quota + " processors"));
    }
  };
  write("sys/fs/cgroup/a/cpu.max", "20000 100000\n");
  expect_one("0.2");
  write("sys/fs/cgroup/a/cpu.max", "max 100000\n");
  write("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "10000\n");
  write("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_period_us", "100000\n");
  expect_one("0.1");
  write("proc/self/cgroup", "0::/half\n");
  write("sys/fs/cgroup/half/cpu.max", "150000 100000\n");
  EXPECT_EQ(usable_processors(root_).count, std::min(all, 2U)) << "1.5 processors";
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

TEST(Address, ANameWithoutAddressIsFoundInTheBackground) {
  const AddressLookup nowhere("tcp://no..name:7601");
  while (nowhere.error().empty()) {
    std::this_thread::yield();
  }
  EXPECT_EQ(nowhere.error(), "the name no..name has no address");
  EXPECT_FALSE(is_name(host_of("inproc://x")));
  EXPECT_FALSE(is_name("127.0.0.1"));
  EXPECT_FALSE(is_name("fe80::1%eth0"));
  EXPECT_TRUE(is_name("node7"));
}

}  // namespace
}  // namespace oblique::protocol
