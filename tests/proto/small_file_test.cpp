#include "proto/small_file.h"

#include <fstream>
#include <string>

#include <sys/stat.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class SmallFile : public testing::Test {
 protected:
  std::string objection_to(const std::string& path) const {
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

TEST_F(SmallFile, IsReadWholeAndTheNullDeviceIsEmpty) {
  const std::string text("ten\nbyt\0es", 10);
  std::ofstream(file_) << text;
  EXPECT_EQ(read_small_file(file_, "the list", 10), text);
  EXPECT_EQ(read_small_file("/dev/null", "the list", 10), "");
}

TEST_F(SmallFile, ThatIsMissingTooLongOrNotRegularIsRefusedWithoutWaiting) {
  EXPECT_THAT(objection_to(file_), HasSubstr("No such file"));
  EXPECT_THAT(objection_to("/dev/zero"), HasSubstr("it is a device, "));
  EXPECT_THAT(objection_to(folder_.path().string()), HasSubstr("it is a directory, "));
  std::ofstream(file_) << std::string(11, 'x');
  EXPECT_THAT(objection_to(file_), HasSubstr("it has 11 bytes, and at most 10 are allowed"));
  const std::string pipe = folder_.file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(objection_to(pipe),
              HasSubstr("it is a pipe, and must be a regular file of at most 10 bytes"));
}

}  // namespace
}  // namespace oblique::protocol
