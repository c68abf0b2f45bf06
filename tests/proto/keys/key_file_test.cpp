#include "proto/keys/key_file.h"

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <functional>
#include <stdexcept>
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

std::string message_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

KeyFile worker_key() {
  return {Role::kWorker, "worker", made_key_pair(), made_key_pair().public_key};
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

TEST(CurveKeyTest, AreWrittenAsLibzmqWritesThem) {
  const KeyPair pair = made_key_pair();
  char text[kKeyCharacters + 1];
  ASSERT_NE(zmq_z85_encode(text, pair.secret_key.data(), pair.public_key.size()), nullptr);
  EXPECT_EQ(z85(pair.secret_key.bytes()), text);
  EXPECT_EQ(secret_key_of_z85(text), pair.secret_key);
  char public_half[kKeyCharacters + 1];
  ASSERT_EQ(zmq_curve_public(public_half, text), 0);
  EXPECT_EQ(z85(pair.public_key), public_half);
  EXPECT_EQ(public_half_of(pair.secret_key), pair.public_key);
}

TEST(CurveKeyTest, AreNotReadFromTextThatIsNone) {
  const std::string good = z85(made_key_pair().public_key);
  EXPECT_FALSE(key_of_z85(""));
  EXPECT_FALSE(key_of_z85(good.substr(1)));
  EXPECT_FALSE(key_of_z85(good + "00000"));
  EXPECT_FALSE(key_of_z85(std::string(40, '"')));
  EXPECT_FALSE(key_of_z85(std::string(40, '#'))) << "more than 32 bits in five digits";
}

TEST_F(KeyFileTest, IsReadAsItWasWrittenAndIsForItsOwnerAlone) {
  const KeyFile server{Role::kServer, "server", made_key_pair(), std::nullopt};
  for (const KeyFile& key : {worker_key(), server}) {
    const std::string path = folder_.file(key.name);
    write_key_file(path, key);
    const KeyFile read = read_key_file(path);
    EXPECT_EQ(read.role, key.role);
    EXPECT_EQ(read.name, key.name);
    EXPECT_EQ(read.pair.public_key, key.pair.public_key);
    EXPECT_EQ(read.pair.secret_key, key.pair.secret_key);
    EXPECT_EQ(read.server, key.server);
    EXPECT_EQ(mode_of(path), 0600U);
  }
}

TEST_F(KeyFileTest, IsNeverOverwrittenNorWrittenThroughALink) {
  const std::string path = written("precious");
  EXPECT_THAT(message_of([&] { write_key_file(path, worker_key()); }),
              AllOf(HasSubstr(path), HasSubstr("never overwritten")));
  std::string kept;
  std::ifstream(path) >> kept;
  EXPECT_EQ(kept, "precious");
  ASSERT_EQ(symlink(folder_.file("elsewhere").c_str(), folder_.file("link.key").c_str()), 0);
  EXPECT_THROW(write_key_file(folder_.file("link.key"), worker_key()), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder_.file("elsewhere")));
}

TEST_F(KeyFileTest, IsRefusedWhenOthersMayReadItWithTheCommandThatMendsIt) {
  for (const mode_t mode : {0640U, 0604U, 0666U}) {
    const std::string path = written(text_of(worker_key()), mode);
    EXPECT_THAT(message_of([&] { read_key_file(path); }),
                AllOf(HasSubstr(path), HasSubstr("chmod 600 '" + path + "'")));
  }
  EXPECT_THAT(message_of([&] { read_key_file(folder_.file("some.key")); }), HasSubstr("0666"));
  chmod(folder_.file("some.key").c_str(), 0400);
  EXPECT_NO_THROW(read_key_file(folder_.file("some.key")));
}

TEST_F(KeyFileTest, NamesFileLineAndKeyOfAFaultAndShowsNoSecret) {
  const KeyFile key = worker_key();
  const std::string other = z85(made_key_pair().secret_key.bytes());
  const std::string secret = z85(key.pair.secret_key.bytes());
  for (const auto& [from, to, place, words] : std::vector<std::array<std::string, 4>>{
           {"\"worker\"", "\"boss\"", ":1:", "`role` must be \"server\", \"client\", \"worker\""},
           {"\"w\"", "\"../w\"", ":2:", "`name`"},
           {"public", "pubic", ":3:", "did you mean `public`"},
           {secret, other, ":4:", "not the other half"},
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

/// A key file that another process has written, so that nothing of it is in this one's memory.
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

class SecretKeyTest : public KeyFileTest {
 protected:
  void SetUp() override {
    if (!test::kAllMemoryMayBeRead) {
      GTEST_SKIP() << "a sanitizer objects to reading all memory";
    }
  }
  static void expect_no_copy_in_a_core_dump(const SecretKey& key) {
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
};

TEST_F(SecretKeyTest, ThatIsReadIsLockedInMemoryAndNotInACoreDump) {
  const KeyFile key = read_key_file(file_of_another_process(folder_.file("worker.key")));
  expect_no_copy_in_a_core_dump(key.pair.secret_key);
  // Nor as text, of which freed memory keeps the end. What is searched for is not dumped either.
  constexpr std::size_t kEnd = 24;
  SecretKey end;
  std::string text = z85(key.pair.secret_key.bytes());
  std::copy_n(text.end() - kEnd, kEnd, end.bytes().begin());
  sodium_memzero(text.data(), text.size());
  EXPECT_FALSE(test::is_in_a_core_dump({reinterpret_cast<const char*>(end.data()), kEnd}));
}

TEST_F(SecretKeyTest, ThatIsMadeAndWrittenIsLockedInMemoryAndNotInACoreDump) {
  const KeyFile key = worker_key();
  write_key_file(folder_.file("worker.key"), key);
  expect_no_copy_in_a_core_dump(key.pair.secret_key);
}

}  // namespace
}  // namespace oblique::protocol
