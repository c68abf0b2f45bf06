#include "server/database/database_file.h"

#include <gtest/gtest.h>

namespace oblique::server {
namespace {

TEST(FileSystemOf, APathThatDoesNotExistIsThatOfTheFolderAboveIt) {
  EXPECT_EQ(file_system_of("/dev/shm/none/oblique.db"), "tmpfs");
  EXPECT_EQ(file_system_of("/proc/self/oblique.db"), "0x9fa0");
}

TEST(FileSystemOf, ALocalPathHasNoObjection) {
  EXPECT_EQ(objection_to_shared_disk("/dev/shm/oblique.db"), "");
}

}  // namespace
}  // namespace oblique::server
