#include "server/database/shared_disk.h"

#include <gtest/gtest.h>

namespace oblique::server {
namespace {

constexpr const char* kMounts = R"(22 1 254:0 / / rw,relatime shared:1 - ext4 /dev/vda1 rw
30 22 0:40 / /home rw,relatime shared:2 - nfs4 host:/home rw,vers=4.2
31 30 0:41 / /home/local rw - xfs /dev/vdb rw
32 22 0:42 / /mnt/two\040words rw - fuse.sshfs me@host: rw
33 22 0:43 / /scratch rw - cifs //host/scratch rw
34 22 0:44 / /scratch rw - ext4 /dev/vdc rw
a line that is none
)";

TEST(SharedDisk, IsThatOfTheLongestMountPointAboveThePath) {
  EXPECT_EQ(file_system_of("/var/oblique.db", kMounts), "ext4");
  EXPECT_EQ(file_system_of("/home/me/oblique.db", kMounts), "nfs4");
  EXPECT_EQ(file_system_of("/home/local/oblique.db", kMounts), "xfs");
  EXPECT_EQ(file_system_of("/homes/oblique.db", kMounts), "ext4");
}

TEST(SharedDisk, MountPointsMayHaveSpacesAndHideEarlierOnes) {
  EXPECT_EQ(file_system_of("/mnt/two words/a.db", kMounts), "fuse.sshfs");
  EXPECT_EQ(file_system_of("/scratch/a.db", kMounts), "ext4");
}

TEST(SharedDisk, WithoutMountsNothingIsKnown) {
  EXPECT_EQ(file_system_of("/var/oblique.db", ""), "");
}

TEST(SharedDisk, ALocalPathHasNoObjection) {
  EXPECT_EQ(objection_to_shared_disk("/proc/self/oblique.db"), "");
}

}  // namespace
}  // namespace oblique::server
