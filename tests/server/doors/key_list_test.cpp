#include "server/doors/key_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "server/doors/doors.h"
#include "tests/support/hang_limit.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using protocol::AuthorizedKeys;
using protocol::Role;
using testing::AllOf;
using testing::HasSubstr;

class KeyListTest : public testing::Test {
 protected:
  protocol::CurveKey add(const std::string& name, Role role) {
    const protocol::CurveKey key = protocol::made_key_pair().public_key;
    protocol::change_authorized_keys(path_, [&](AuthorizedKeys& keys) {
      keys.add({name, role, key, protocol::utc_now()});
    });
    return key;
  }
  void revoke(const std::string& name) {
    protocol::change_authorized_keys(path_, [&](AuthorizedKeys& keys) { keys.remove(name); });
  }
  std::string text() const {
    std::ifstream file(path_);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static RefusalCause cause_of(const Verdict& verdict) { return std::get<Refusal>(verdict).cause; }
  static std::string name_in(const Verdict& verdict) {
    return std::get<std::shared_ptr<const KeyHolder>>(verdict)->name;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("authorized_keys.toml");
};

TEST_F(KeyListTest, EachRoleHasItsPort) {
  const auto worker = add("w", Role::kWorker);
  const auto client = add("c", Role::kClient);
  const auto reader = add("r", Role::kReader);
  const auto list = std::make_shared<const KeyList>(path_);
  const PortKeeper workers(list, PortKeeper::Port::kWorkers);
  const PortKeeper clients(list, PortKeeper::Port::kClients);
  EXPECT_EQ(name_in(workers.judge(worker)), "w");
  EXPECT_EQ(name_in(clients.judge(client)), "c");
  EXPECT_EQ(name_in(clients.judge(reader)), "r");
  EXPECT_EQ(cause_of(clients.judge(worker)), RefusalCause::kOtherRole);
  EXPECT_EQ(cause_of(workers.judge(client)), RefusalCause::kOtherRole);
  EXPECT_EQ(cause_of(workers.judge(reader)), RefusalCause::kOtherRole);
  EXPECT_EQ(cause_of(workers.judge(protocol::made_key_pair().public_key)),
            RefusalCause::kUnknownKey);
}

TEST_F(KeyListTest, AKeyThatIsAddedOrRevokedCountsAtTheNextLook) {
  const auto first = add("first", Role::kWorker);
  const auto list = std::make_shared<KeyList>(path_);
  const PortKeeper workers(list, PortKeeper::Port::kWorkers);
  EXPECT_FALSE(list->look());
  const auto second = add("second", Role::kWorker);
  auto news = list->look();
  ASSERT_TRUE(news);
  EXPECT_TRUE(news->admission_changed);
  EXPECT_THAT(news->text, HasSubstr("new: second (worker)"));
  EXPECT_EQ(name_in(workers.judge(second)), "second");
  revoke("first");
  news = list->look();
  ASSERT_TRUE(news);
  EXPECT_THAT(news->text, HasSubstr("revoked: first"));
  EXPECT_EQ(cause_of(workers.judge(first)), RefusalCause::kRevokedKey);
  EXPECT_FALSE(list->look());
}

TEST_F(KeyListTest, AListThatIsBrokenOrGoneChangesNothingAndIsToldOnce) {
  const auto key = add("w", Role::kWorker);
  const auto list = std::make_shared<KeyList>(path_);
  const PortKeeper workers(list, PortKeeper::Port::kWorkers);
  std::ofstream(path_, std::ios::app) << "[[key";
  auto news = list->look();
  ASSERT_TRUE(news);
  EXPECT_TRUE(news->is_fault);
  EXPECT_FALSE(news->admission_changed);
  EXPECT_THAT(news->text, AllOf(HasSubstr(path_), HasSubstr("admitted still")));
  EXPECT_FALSE(list->look());
  EXPECT_EQ(name_in(workers.judge(key)), "w");
  std::filesystem::remove(path_);
  EXPECT_TRUE(list->look()->is_fault);
  EXPECT_FALSE(list->look());
  EXPECT_EQ(name_in(workers.judge(key)), "w");
  const auto other = add("other", Role::kWorker);
  EXPECT_TRUE(list->look()->admission_changed);
  EXPECT_EQ(cause_of(workers.judge(key)), RefusalCause::kRevokedKey);
  EXPECT_EQ(name_in(workers.judge(other)), "other");
}

TEST_F(KeyListTest, AListThatIsEmptiedCountsWhenItStaysSo) {
  const auto key = add("w", Role::kWorker);
  const auto list = std::make_shared<KeyList>(path_);
  const PortKeeper workers(list, PortKeeper::Port::kWorkers);
  std::ofstream(path_, std::ios::trunc).close();  // as by an editor that goes on to write
  struct stat file {};
  ASSERT_EQ(::stat(path_.c_str(), &file), 0);
  const KeyList::Clock::time_point written{std::chrono::seconds(file.st_ctim.tv_sec)};
  EXPECT_FALSE(list->look(written));
  EXPECT_EQ(name_in(workers.judge(key)), "w");
  EXPECT_TRUE(list->look(written + test::kHangLimit));
  EXPECT_EQ(cause_of(workers.judge(key)), RefusalCause::kRevokedKey);
}

TEST_F(KeyListTest, AChangeWithinTheSameTickOfTheClockIsSeen) {
  add("w", Role::kWorker);
  const std::string before = text();
  std::string after = before;
  after.replace(after.find("\"w\""), 3, "\"v\"");
  for (int i = 0; i < 50; ++i) {
    std::ofstream(path_) << before;
    KeyList list(path_);
    std::ofstream(path_) << after;  // of the same size, in the same file
    EXPECT_TRUE(list.look());
  }
}

TEST_F(KeyListTest, AServerTakesItsOwnKeyFileAndTheListBesideIt) {
  const protocol::KeyFile server{Role::kServer, "server", protocol::made_key_pair()};
  protocol::write_key_file(folder_.file("server.key"), server);
  const DoorSettings settings{"127.0.0.1", folder_.file("server.key"), false};
  EXPECT_THROW(Doors{settings}, solver::InputError) << "there is no list";
  add("w", Role::kWorker);
  Doors doors(settings);
  EXPECT_EQ(doors.access(), Access::kKeys);
  EXPECT_EQ(doors.guard(PortKeeper::Port::kWorkers)->server_public, server.pair.public_key);
  EXPECT_THAT(doors.look(5).lines.at(0).text, HasSubstr(protocol::z85(server.pair.public_key)));
  add("another", Role::kClient);
  EXPECT_FALSE(doors.look(6).admission_changed) << "it was looked at just now";
  EXPECT_TRUE(doors.look(505).admission_changed);
  protocol::write_key_file(folder_.file("worker.key"),
                           {Role::kWorker, "w", protocol::made_key_pair(), server.pair.public_key});
  EXPECT_THROW((Doors{{"127.0.0.1", folder_.file("worker.key"), false}}), solver::InputError);
}

}  // namespace
}  // namespace oblique::server
