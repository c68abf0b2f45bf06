#include "proto/system/available_memory.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace oblique::protocol {
namespace {

TEST(MemoryLimit, IsTheTightestOfTheGroupsFromTheProcessUpwards) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder.path() / "a" / "b");
  std::ofstream(folder.file("a/memory.max")) << "500000000\n";
  std::ofstream(folder.file("a/b/memory.max")) << "max\n";
  const std::string root = folder.path().string();
  EXPECT_EQ(memory_limit_bytes(root, "0::/a/b\n"), 500'000'000U);
  EXPECT_FALSE(memory_limit_bytes(root, "0::/\n"));
}

}  // namespace
}  // namespace oblique::protocol
