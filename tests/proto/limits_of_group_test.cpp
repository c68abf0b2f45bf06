#include "proto/system/limits_of_group.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace oblique::protocol {
namespace {

TEST(LimitsOfAGroup, AreTheTightestFromTheProcessUpwards) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder.path() / "a" / "b");
  std::ofstream(folder.file("a/memory.max")) << "500000000\n";
  std::ofstream(folder.file("a/b/memory.max")) << "max\n";
  const std::string root = folder.path().string();
  EXPECT_EQ(limits_of_group(root, "0::/a/b\n").memory_bytes, 500'000'000U);
  EXPECT_FALSE(limits_of_group(root, "0::/\n").memory_bytes);
}

}  // namespace
}  // namespace oblique::protocol
