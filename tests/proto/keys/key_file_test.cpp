#include "proto/keys/key_file.h"

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <sodium.h>
#include <zmq.hpp>

#include "tests/support/dumped_memory.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

std::string message_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

KeyFile worker_key() {
  return {Role::kWorker, "worker", generate_key_pair(), generate_key_pair().public_key};
}

mode_t mode_of(const std::string& path) {
  struct stat file {};
  EXPECT_EQ(stat(path.c_str(), &file), 0);
  return file.st_mode & 07777U;
}

class KeyFileTest : public ::testing::Test {
 protected:
  std::string written(const std::string& text, mode_t mode = 0600) const {
    const std::string path = folder_.file("some.key");
    std::ofstream(path) << text;
    chmod(path.c_str(), mode);
    return path;
  }
  std::string text_of(const KeyFile& key) const {
    return "role = \"worker\"\nname = \"w\"\npublic = \"" + z85(key.pair.public_key) +
           "\"\nsecret = \"" + z85(key.pair.secret_key.bytes()) + "\"\nserver = \"" +
           z85(*key.server) + "\"\n";
  }
  std::string error_of(const std::string& text) const {
    const std::string path = written(text);
    return message_of([&] { read_key_file(path); });
  }
  test::TemporaryFolder folder_;
};

TEST(CurveKeyTest, KeysAreFormattedAsByLibzmq) {
  const KeyPair pair = generate_key_pair();
  const std::string secret = z85(pair.secret_key.bytes());
  char text[kKeyCharacters + 1];
  ASSERT_NE(zmq_z85_encode(text, pair.secret_key.data(), pair.public_key.size()), nullptr);
  EXPECT_EQ(secret, text);
  char public_half[kKeyCharacters + 1];
  ASSERT_EQ(zmq_curve_public(public_half, secret.c_str()), 0);
  EXPECT_EQ(z85(pair.public_key), public_half);
  EXPECT_EQ(public_key_of(pair.secret_key), pair.public_key);
}

TEST(CurveKeyTest, InvalidTextIsNotParsedAsAKey) {
  const std::string good = z85(generate_key_pair().public_key);
  EXPECT_FALSE(parse_z85(""));
  EXPECT_FALSE(parse_z85(good.substr(1)));
  EXPECT_FALSE(parse_z85(good + "00000"));
  EXPECT_FALSE(parse_z85(good.substr(5) + std::string(5, '\0')));
  EXPECT_FALSE(parse_z85(std::string(40, '"')));
  EXPECT_FALSE(parse_z85(std::string(40, '#'))) << "five digits exceed 32 bits";
}

TEST_F(KeyFileTest, IsReadAsWrittenAndOnlyItsOwnerMayReadIt) {
  const KeyFile server{Role::kServer, "server", generate_key_pair(), std::nullopt};
  for (const KeyFile& key : {worker_key(), server}) {
    const std::string path = folder_.file(key.name);
    write_key_file(path, key);
    const KeyFile read = read_key_file(path);
    EXPECT_EQ(read.role, key.role);
    EXPECT_EQ(read.name, key.name);
    EXPECT_EQ(read.pair.public_key, key.pair.public_key);
    EXPECT_EQ(public_key_of(read.pair.secret_key), key.pair.public_key);
    EXPECT_EQ(read.server, key.server);
    EXPECT_EQ(mode_of(path), 0600U);
  }
}

TEST_F(KeyFileTest, IsNeverOverwrittenNorWrittenThroughALink) {
  const std::string path = written("precious");
  EXPECT_THAT(message_of([&] { write_key_file(path, worker_key()); }),
              AllOf(HasSubstr(path), HasSubstr("File exists")));
  std::string kept;
  std::ifstream(path) >> kept;
  EXPECT_EQ(kept, "precious");
  ASSERT_EQ(symlink(folder_.file("elsewhere").c_str(), folder_.file("link.key").c_str()), 0);
  EXPECT_THROW(write_key_file(folder_.file("link.key"), worker_key()), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder_.file("elsewhere")));
}

TEST_F(KeyFileTest, IsRefusedWithTheRemedyWhenOthersMayReadIt) {
  for (const mode_t mode : {0640U, 0604U, 0666U}) {
    const std::string path = written(text_of(worker_key()), mode);
    EXPECT_THAT(message_of([&] { read_key_file(path); }),
                AllOf(HasSubstr(path), HasSubstr("chmod 600 '" + path + "'")));
  }
  EXPECT_THAT(message_of([&] { read_key_file(folder_.file("some.key")); }), HasSubstr("0666"));
  chmod(folder_.file("some.key").c_str(), 0400);
  EXPECT_NO_THROW(read_key_file(folder_.file("some.key")));
}

TEST_F(KeyFileTest, ErrorsHaveFileLineAndKeyAndNoSecret) {
  const KeyFile key = worker_key();
  const std::string other = z85(generate_key_pair().secret_key.bytes());
  const std::string secret = z85(key.pair.secret_key.bytes());
  for (const auto& [from, to, place, words] : std::vector<std::array<std::string, 4>>{
           {"\"worker\"", "\"boss\"", ":1:", "`role` must be \"server\", \"client\", \"worker\""},
           {"\"w\"", "\"../w\"", ":2:", "`name`"},
           {"public", "pubic", ":3:", "did you mean `public`"},
           {secret, other, ":4:", "does not belong to `public`"},
           {"secret", " secret", ":4:", "must begin its line"},
           {"server = ", "#", ":1:", "`server` is missing"},
           {"server = ", "server = 3 #", ":5:", "`server` must be a text"},
           {"server = ", "= server = ", ":5:", ""}}) {
    std::string text = text_of(key);
    text.replace(text.find(from), from.size(), to);
    EXPECT_THAT(error_of(text), AllOf(HasSubstr("some.key" + place), HasSubstr(words),
                                      Not(HasSubstr(secret)), Not(HasSubstr(other))));
  }
  EXPECT_THAT(error_of(""), HasSubstr("`role` is missing"));
  EXPECT_THAT(message_of([&] { read_key_file(folder_.file("none.key")); }),
              AllOf(HasSubstr("none.key"), HasSubstr("No such file")));
}

/// Writes a key file in a child process, so that the secret is not yet in the memory of this
/// process. Returns `path`.
std::string file_of_another_process(const std::string& path) {
  const pid_t writer = fork();
  if (writer == 0) {
    write_key_file(path, worker_key());
    _exit(0);
  }
  int status = -1;
  waitpid(writer, &status, 0);
  EXPECT_EQ(status, 0);
  return path;
}

void expect_no_copy_in_a_core_dump(const SecretKey& key) {
  const test::MappedRange* range = nullptr;
  const auto ranges = test::mapped_ranges();
  for (const auto& each : ranges) {
    range = each.contains(key.data()) ? &each : range;
  }
  ASSERT_NE(range, nullptr);
  EXPECT_TRUE(range->has("dd")) << range->flags;
  rlimit lockable{};
  getrlimit(RLIMIT_MEMLOCK, &lockable);
  constexpr rlim_t kEnough = 64 * 1024;
  EXPECT_EQ(range->has("lo"), lockable.rlim_cur >= kEnough) << range->flags;
  EXPECT_FALSE(
      test::is_in_a_core_dump({reinterpret_cast<const char*>(key.data()), key.bytes().size()}));
}

TEST_F(KeyFileTest, TheSecretIsInLockedMemoryAndNotInACoreDump) {
  if (!test::kAllMemoryMayBeRead) {
    GTEST_SKIP() << "the sanitizer does not allow reading all memory";
  }
  const KeyFile made = worker_key();
  write_key_file(folder_.file("made.key"), made);
  expect_no_copy_in_a_core_dump(made.pair.secret_key);
  const KeyFile key = read_key_file(file_of_another_process(folder_.file("worker.key")));
  expect_no_copy_in_a_core_dump(key.pair.secret_key);
  // A core dump must not contain the secret as text either. The test searches for the end of the
  // text, because freeing memory overwrites its beginning. `end` itself is in memory that core
  // dumps leave out.
  constexpr std::size_t kEnd = 24;
  SecretKey end;
  std::string text = z85(key.pair.secret_key.bytes());
  std::copy_n(text.end() - kEnd, kEnd, end.bytes().begin());
  sodium_memzero(text.data(), text.size());
  EXPECT_FALSE(test::is_in_a_core_dump({reinterpret_cast<const char*>(end.data()), kEnd}));
}

AuthorizedKey key_called(const std::string& name, Role role = Role::kWorker) {
  return {name, role, generate_key_pair().public_key, "2026-11-22T03:00:00Z"};
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
  std::string path_ = authorized_keys_in(folder_.path());
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
  EXPECT_EQ(keys.find(generate_key_pair().public_key), nullptr);
}

TEST_F(AuthorizedKeysTest, ARefusedChangeChangesNothing) {
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

TEST_F(AuthorizedKeysTest, ConcurrentChangesLoseNothing) {
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

TEST_F(AuthorizedKeysTest, KeepsItsModeAndIsRefusedIfEveryUserMayWriteOrReplaceIt) {
  add(key_called("a"));
  chmod(path_.c_str(), 0640);
  add(key_called("b"));
  struct stat file {};
  ASSERT_EQ(stat(path_.c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 07777U, 0640U);
  chmod(folder_.path().c_str(), 01777);
  EXPECT_THAT(read_authorized_keys(path_).all(), SizeIs(2))
      << "in a sticky folder only owners can replace files";
  chmod(folder_.path().c_str(), 0777);
  EXPECT_THAT(error_of(text()),
              AllOf(HasSubstr("chmod o-w"), HasSubstr(folder_.path().string() + " has mode 0777")));
  chmod(path_.c_str(), 0666);
  EXPECT_THAT(error_of(text()), AllOf(HasSubstr("chmod o-w"), HasSubstr(path_ + " has mode 0666")));
}

TEST_F(AuthorizedKeysTest, AChangeThroughALinkChangesItsTarget) {
  const std::string real = folder_.file("real.toml");
  std::ofstream{real};
  std::filesystem::create_symlink("real.toml", path_);
  add(key_called("a"));
  EXPECT_TRUE(std::filesystem::is_symlink(path_));
  EXPECT_THAT(read_authorized_keys(real).all(), SizeIs(1));
}

TEST_F(AuthorizedKeysTest, ErrorsNameTheLineOfAnInvalidOrRepeatedEntry) {
  const AuthorizedKey a = key_called("a");
  AuthorizedKey same_key = a;
  same_key.name = "b";
  for (const auto& [text, line, expected] : std::vector<std::array<std::string, 3>>{
           {entry(a) + entry(key_called("a")), "6", "already has a key called a"},
           {entry(a) + entry(same_key), "6", "already has the public key"},
           {entry(a) + "expires = 3\n", "6", "unknown key `expires`"},
           {entry(a) + "[", "6", ""},
           {entry(key_called("s", Role::kServer)), "3", "`role`"},
           {"[[keys]]\n", "1", "unknown key `keys`"},
           {"key = 3\n", "1", "[[key]]"}}) {
    EXPECT_THAT(error_of(text),
                AllOf(HasSubstr("authorized_keys.toml:" + line + ":"), HasSubstr(expected)));
  }
}

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

TEST_F(KeyFolderTest, IsNotCreatedOverExistingFilesAndChangesNothing) {
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

TEST_F(KeyFolderTest, FurtherKeysAreAddedWithAFileOrByTheirPublicKey) {
  make_key_folder(keys_);
  const AuthorizedKey alice = add_key(keys_, "alice", Role::kClient, std::nullopt);
  EXPECT_EQ(read_key_file(key_file_in(keys_, "alice")).pair.public_key, alice.public_key);
  const CurveKey bobs = generate_key_pair().public_key;
  add_key(keys_, "bob", Role::kWorker, bobs);
  EXPECT_FALSE(std::filesystem::exists(key_file_in(keys_, "bob")));
  const AuthorizedKeys listed = read_authorized_keys(authorized_keys_in(keys_));
  EXPECT_EQ(listed.find(bobs)->name, "bob");
  EXPECT_EQ(listed.find(alice.public_key)->role, Role::kClient);
}

TEST_F(KeyFolderTest, AKeyIsNeitherListedWithoutItsFileNorWrittenWithoutBeingListed) {
  make_key_folder(keys_);
  std::ofstream(keys_ + "/alice.key") << "precious";
  EXPECT_THROW(add_key(keys_, "alice", Role::kClient, std::nullopt), std::runtime_error);
  EXPECT_THROW(add_key(keys_, "worker", Role::kClient, std::nullopt), solver::InputError);
  EXPECT_THROW(add_key(keys_, "server", Role::kWorker, std::nullopt), std::runtime_error);
  EXPECT_THAT(read_authorized_keys(authorized_keys_in(keys_)).all(), SizeIs(3));
  EXPECT_EQ(files(), 6);
  const std::string draft = authorized_keys_in(keys_) + ".new";
  std::filesystem::create_directory(draft);  // so the list cannot be replaced
  EXPECT_THROW(add_key(keys_, "carol", Role::kClient, std::nullopt), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(key_file_in(keys_, "carol")));
  std::filesystem::remove(draft);
  EXPECT_NO_THROW(add_key(keys_, "carol", Role::kClient, std::nullopt));
}

}  // namespace
}  // namespace oblique::protocol
