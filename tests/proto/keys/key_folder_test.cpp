#include "proto/keys/key_file.h"

#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

using ::testing::SizeIs;

class KeyFolderTest : public ::testing::Test {
 protected:
  long files() const {
    return std::distance(std::filesystem::directory_iterator(keys_),
                         std::filesystem::directory_iterator());
  }
  test::TemporaryFolder folder_;
  std::string keys_ = folder_.file("keys");
};

TEST_F(KeyFolderTest, HasAServerAndOneListedKeyOfEachOtherRole) {
  const CurveKey server = make_key_folder(keys_);
  struct stat made {};
  ASSERT_EQ(stat(keys_.c_str(), &made), 0);
  EXPECT_EQ(made.st_mode & 07777U, 0700U);
  EXPECT_EQ(read_key_file(key_file_in(keys_, "server")).pair.public_key, server);
  const AuthorizedKeys listed = read_authorized_keys(authorized_keys_in(keys_));
  EXPECT_THAT(listed.all(), SizeIs(3));
  for (const Role role : {Role::kClient, Role::kWorker, Role::kReader}) {
    const KeyFile key = read_key_file(key_file_in(keys_, std::string(name_of(role))));
    EXPECT_EQ(key.role, role);
    EXPECT_EQ(key.server, server);
    ASSERT_NE(listed.find(key.pair.public_key), nullptr);
    EXPECT_EQ(listed.find(key.pair.public_key)->role, role);
  }
}

TEST_F(KeyFolderTest, IsNotMadeOverFilesThatExistAndThenChangesNothing) {
  std::filesystem::create_directory(keys_);
  std::ofstream(keys_ + "/worker.key") << "precious";
  EXPECT_THROW(make_key_folder(keys_), std::runtime_error);
  EXPECT_EQ(files(), 1);
  EXPECT_THROW(make_key_folder(folder_.file("no/such")), std::runtime_error);
  std::filesystem::remove(keys_ + "/worker.key");
  const CurveKey server = make_key_folder(keys_);
  EXPECT_THROW(make_key_folder(keys_), std::runtime_error);
  EXPECT_EQ(read_key_file(key_file_in(keys_, "server")).pair.public_key, server);
  EXPECT_EQ(files(), 5);
}

TEST_F(KeyFolderTest, TakesFurtherKeysWithAFileOrOnlyTheirPublicHalf) {
  make_key_folder(keys_);
  const AuthorizedKey alice = add_key(keys_, "alice", Role::kClient, std::nullopt);
  EXPECT_EQ(read_key_file(key_file_in(keys_, "alice")).pair.public_key, alice.public_key);
  const CurveKey bobs = made_key_pair().public_key;
  add_key(keys_, "bob", Role::kWorker, bobs);
  EXPECT_FALSE(std::filesystem::exists(key_file_in(keys_, "bob")));
  const AuthorizedKeys listed = read_authorized_keys(authorized_keys_in(keys_));
  EXPECT_EQ(listed.find(bobs)->name, "bob");
  EXPECT_EQ(listed.find(alice.public_key)->role, Role::kClient);
}

TEST_F(KeyFolderTest, ListsNoKeyWhoseFileCannotBeWrittenAndWritesNoneThatCannotBeListed) {
  make_key_folder(keys_);
  std::ofstream(keys_ + "/alice.key") << "precious";
  EXPECT_THROW(add_key(keys_, "alice", Role::kClient, std::nullopt), std::runtime_error);
  EXPECT_THROW(add_key(keys_, "worker", Role::kClient, std::nullopt), solver::InputError);
  EXPECT_THROW(add_key(keys_, "server", Role::kWorker, std::nullopt), std::runtime_error);
  EXPECT_THAT(read_authorized_keys(authorized_keys_in(keys_)).all(), SizeIs(3));
  EXPECT_EQ(files(), 6);
}

}  // namespace
}  // namespace oblique::protocol
