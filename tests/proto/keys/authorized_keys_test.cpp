#include "proto/keys/key_file.h"

#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>

#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::SizeIs;

AuthorizedKey key_called(const std::string& name, Role role = Role::kWorker) {
  return {name, role, made_key_pair().public_key, "2026-11-22T03:00:00Z"};
}

class AuthorizedKeysTest : public ::testing::Test {
 protected:
  void add(const AuthorizedKey& key) const {
    change_authorized_keys(path_, [&](AuthorizedKeys& keys) { keys.add(key); });
  }
  void write(const std::string& text) const { std::ofstream(path_) << text; }
  std::string text() const {
    std::ifstream file(path_);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::string error_of(const std::string& list) const {
    write(list);
    try {
      read_authorized_keys(path_);
    } catch (const solver::InputError& error) {
      return error.what();
    }
    return "nothing was thrown";
  }
  static std::string entry(const AuthorizedKey& key) {
    return "[[key]]\nname = \"" + key.name + "\"\nrole = \"" + std::string(name_of(key.role)) +
           "\"\npublic = \"" + z85(key.public_key) + "\"\nadded_at = \"" + key.added_at + "\"\n";
  }
  test::TemporaryFolder folder_;
  std::string path_ = authorized_keys_beside(folder_.file("server.key"));
};

TEST_F(AuthorizedKeysTest, FindsKeysByKeyAndByNameUntilTheyAreRemoved) {
  const AuthorizedKey reader = key_called("reader", Role::kReader);
  for (const AuthorizedKey& key : {key_called("worker"), reader, key_called("other")}) {
    add(key);
  }
  change_authorized_keys(path_, [](AuthorizedKeys& keys) { keys.remove("worker"); });
  const AuthorizedKeys keys = read_authorized_keys(path_);
  ASSERT_THAT(keys.all(), SizeIs(2));
  EXPECT_EQ(keys.find("worker"), nullptr);
  ASSERT_NE(keys.find(reader.public_key), nullptr);
  EXPECT_EQ(keys.find(reader.public_key), keys.find("reader"));
  EXPECT_EQ(keys.find("reader")->role, Role::kReader);
  EXPECT_EQ(keys.find("reader")->added_at, "2026-11-22T03:00:00Z");
  EXPECT_EQ(keys.find(made_key_pair().public_key), nullptr);
}

TEST_F(AuthorizedKeysTest, NothingChangesWhenAChangeIsRefused) {
  const AuthorizedKey key = key_called("worker");
  add(key);
  const std::string before = text();
  EXPECT_THROW(add(key_called("worker")), solver::InputError);
  AuthorizedKey again = key;
  again.name = "other";
  EXPECT_THROW(add(again), solver::InputError);
  EXPECT_THROW(add(key_called("no/name")), solver::InputError);
  EXPECT_THROW(change_authorized_keys(path_, [](AuthorizedKeys& keys) { keys.remove("nobody"); }),
               solver::InputError);
  EXPECT_EQ(text(), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), {}), 1);
}

TEST_F(AuthorizedKeysTest, ManyAtOnceLoseNothing) {
  constexpr int kAdders = 4;
  constexpr int kKeysOfEach = 25;
  std::vector<std::thread> adders;
  for (int adder = 0; adder < kAdders; ++adder) {
    adders.emplace_back([&, adder] {
      for (int i = 0; i < kKeysOfEach; ++i) {
        add(key_called("k" + std::to_string(adder) + "." + std::to_string(i)));
      }
    });
  }
  for (auto& adder : adders) {
    adder.join();
  }
  EXPECT_THAT(read_authorized_keys(path_).all(), SizeIs(kAdders * kKeysOfEach));
}

TEST_F(AuthorizedKeysTest, KeepsItsModeAndIsRefusedWhereEverybodyMayWriteOrReplaceIt) {
  add(key_called("a"));
  chmod(path_.c_str(), 0640);
  add(key_called("b"));
  struct stat file {};
  ASSERT_EQ(stat(path_.c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 07777U, 0640U);
  chmod(folder_.path().c_str(), 01777);
  EXPECT_THAT(read_authorized_keys(path_).all(), SizeIs(2)) << "only owners replace files there";
  chmod(folder_.path().c_str(), 0777);
  EXPECT_THAT(error_of(text()), AllOf(HasSubstr("chmod o-w"), HasSubstr("the folder")));
  chmod(path_.c_str(), 0666);
  EXPECT_THAT(error_of(text()),
              AllOf(HasSubstr("chmod o-w"), HasSubstr("the list of keys " + path_)));
}

TEST_F(AuthorizedKeysTest, IsNotReadFromAPipeForWhichAServerWouldWait) {
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  EXPECT_THROW(read_authorized_keys(path_), solver::InputError);
}

TEST_F(AuthorizedKeysTest, IsChangedWhereALinkLeads) {
  const std::string real = folder_.file("real.toml");
  std::ofstream{real};
  std::filesystem::create_symlink("real.toml", path_);
  add(key_called("a"));
  EXPECT_TRUE(std::filesystem::is_symlink(path_));
  EXPECT_THAT(read_authorized_keys(real).all(), SizeIs(1));
}

TEST_F(AuthorizedKeysTest, NeverGrowsBeyondWhatIsRead) {
  constexpr int kTooMany = 12'000;
  const auto add_many = [](AuthorizedKeys& keys) {
    for (int i = 0; i < kTooMany; ++i) {
      keys.add(key_called("key" + std::to_string(i)));
    }
  };
  add(key_called("a"));
  EXPECT_THROW(change_authorized_keys(path_, add_many), solver::InputError);
  EXPECT_THAT(read_authorized_keys(path_).all(), SizeIs(1));
}

TEST_F(AuthorizedKeysTest, NamesTheLineOfAnEntryThatIsWrongOrThereTwice) {
  const std::string first = entry(key_called("a"));
  EXPECT_THAT(error_of(first + entry(key_called("a"))),
              AllOf(HasSubstr("authorized_keys.toml:6:"), HasSubstr("called a already")));
  AuthorizedKey same = key_called("a");
  AuthorizedKey other_name = same;
  other_name.name = "b";
  EXPECT_THAT(error_of(entry(same) + entry(other_name)),
              AllOf(HasSubstr("authorized_keys.toml:6:"), HasSubstr("there already, called a")));
  EXPECT_THAT(error_of(first + "expires = 3\n"),
              AllOf(HasSubstr("authorized_keys.toml:6:"), HasSubstr("unknown key `expires`")));
  EXPECT_THAT(error_of(entry(key_called("s", Role::kServer))),
              AllOf(HasSubstr("authorized_keys.toml:3:"), HasSubstr("`role`")));
  EXPECT_THAT(error_of("[[keys]]\n"), HasSubstr("unknown key `keys`"));
  EXPECT_THAT(error_of("key = 3\n"), HasSubstr("authorized_keys.toml:1:"));
  EXPECT_THAT(error_of(first + "["), HasSubstr("authorized_keys.toml:6:"));
}

}  // namespace
}  // namespace oblique::protocol
