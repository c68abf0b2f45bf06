// oblique doctor: what somebody sends along with a defect report.
#include <sys/stat.h>
#include <sys/utsname.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/verbs/doctor/report.h"
#include "proto/system/limits_of_group.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"
#include "tests/support/reserved_port.h"
#include "tests/support/stored_study.h"

namespace oblique::client {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::set<std::string> names_in(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    names.insert(entry.path().filename().string());
  }
  return names;
}

class Doctor : public testing::Test {
 protected:
  /// In a folder that is the home of who asks.
  test::Outcome asked(std::vector<std::string> flags, test::Environment more = {}) const {
    flags.insert(flags.begin(), {"doctor", "--timeout", "600"});
    if (!times_) {
      flags.emplace_back("--no-timing");
    }
    more["HOME"] = folder_.path().string();
    return test::Process(folder_, test::client_program(), flags, more).outcome();
  }
  nlohmann::json json_of(const test::Outcome& outcome) const {
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }
  nlohmann::json broken(const std::vector<std::string>& flags, int exit_code = 1) const {
    auto words = flags;
    words.emplace_back("--json");
    const auto outcome = asked(words);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.out << outcome.err;
    return json_of(outcome).at("broken");
  }

  test::TemporaryFolder folder_;
  bool times_ = false;  // which takes a third of a second
};

TEST_F(Doctor, SaysInEightyColumnsWhatThereIsAndFindsNothingThatCannotWork) {
  times_ = true;
  const auto outcome = asked({});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out;
  EXPECT_EQ(outcome.err, "");
  for (const char* said :
       {"programs\n", "machine\n", "solver\n", "disk\n", "settings\n", "\n  cores  ",
        "; the solver", "SQLite ", "in lanes", "of the same build"}) {
    EXPECT_THAT(outcome.out, HasSubstr(said));
  }
  EXPECT_THAT(outcome.out, Not(HasSubstr("cannot work")));
  std::istringstream lines(outcome.out);
  for (std::string line; std::getline(lines, line);) {
    const bool is_one_word = line.find(' ', line.find_first_not_of(' ')) == std::string::npos;
    EXPECT_TRUE(line.size() <= 80 || is_one_word || line.find('/') != std::string::npos) << line;
  }
}

TEST_F(Doctor, ShowsNeitherTheHomeFolderNorTheMachinesNameUnlessAsked) {
  utsname system{};
  uname(&system);
  const auto outcome = asked({"--json", "--db", folder_.file("a.db")});
  EXPECT_THAT(outcome.out, Not(HasSubstr(folder_.path().string())));
  EXPECT_EQ(json_of(outcome).at("disk").at("folder"), "~");
  EXPECT_FALSE(json_of(outcome).at("machine").contains("host"));
  EXPECT_EQ(json_of(asked({"--json", "--host-name"})).at("machine").at("host"), system.nodename);
}

TEST_F(Doctor, GivesEveryPartAsJson) {
  times_ = true;
  const auto report = json_of(asked({"--json"}));
  EXPECT_GT(report.at("machine").at("cores"), 0);
  EXPECT_GT(report.at("machine").at("memory_bytes"), 1'000'000);
  EXPECT_GT(report.at("solver").at("case_in_lanes_s"), 0.0);
  EXPECT_GT(report.at("disk").at("free_bytes"), 0);
  EXPECT_TRUE(report.at("settings").at("variables").is_object());
  EXPECT_TRUE(report.at("odd").is_array());
  EXPECT_THAT(report.at("broken"), IsEmpty());
}

TEST_F(Doctor, ReadsADatabaseWhoseServerWasKilledAndMakesNoFileBesideIt) {
  std::filesystem::create_directory(folder_.path() / "data");
  {
    server::Store store(folder_.file("data/alive.db"));
    test::add_study(store, "friction", 4, 2);
    // As a killed server leaves them.
    std::filesystem::copy(folder_.file("data/alive.db"), folder_.file("data/dead.db"));
    std::filesystem::copy(folder_.file("data/alive.db-wal"), folder_.file("data/dead.db-wal"));
    const auto alive = asked({"--db", "data/alive.db"});
    EXPECT_THAT(alive.out, HasSubstr("a server works on it")) << alive.out;
    EXPECT_EQ(alive.exit_code, 0);
  }
  const auto before = names_in(folder_.path() / "data");
  const auto outcome = asked({"--db", "data/dead.db", "--json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out;
  EXPECT_EQ(names_in(folder_.path() / "data"), before);
  const auto database = json_of(outcome).at("database");
  EXPECT_EQ(database.at("studies"), 1);
  EXPECT_EQ(database.at("completed_points"), 2);
  EXPECT_GT(database.at("log_bytes"), 0);
  EXPECT_EQ(database.at("in_use"), false);
  EXPECT_THAT(json_of(outcome).at("odd"), Contains(HasSubstr("copy both files or none")));
}

TEST_F(Doctor, NamesADatabaseThatIsNotThereOrIsNone) {
  EXPECT_THAT(broken({"--db", "nowhere.db"}),
              Contains(HasSubstr("There is no database nowhere.db")));
  std::ofstream(folder_.file("text.db")) << "no database, but long enough to be looked at\n";
  EXPECT_THAT(broken({"--db", "text.db"}), Contains(HasSubstr("text.db")));
  EXPECT_THAT(broken({"--db", "."}), Contains(HasSubstr("is a directory")));
  EXPECT_EQ(asked({"--db", "/nowhere/a.db"}).exit_code, 1);
}

TEST_F(Doctor, SaysHowFarItGetsWithAServer) {
  // Where no name service answers either, that is said.
  EXPECT_THAT(broken({"--server", "tcp://nobody.invalid:7600"}),
              Contains(AnyOf(HasSubstr("No address is known"), HasSubstr("did not answer"))));
  EXPECT_THAT(broken({"--server", "hub"}), Contains(HasSubstr("tcp://")));
  const test::ReservedPort port;
  EXPECT_THAT(broken({"--server", port.url()}), Contains(HasSubstr("Nothing takes connections")));
  const test::Server server(folder_, folder_.file("a.db"));
  const auto began = std::chrono::steady_clock::now();
  const auto reached = json_of(asked({"--server", server.client_url(), "--json"}));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  EXPECT_THAT(reached.at("broken"), IsEmpty());
  EXPECT_EQ(reached.at("server").at("version"), reached.at("programs").at("oblique"));
  EXPECT_LT(std::abs(reached.at("server").at("clock_ahead_s").get<double>()), took.count())
      << "one clock, which the server read during the call";
  EXPECT_THAT(reached.at("odd"), Contains(HasSubstr("No worker is there")));
  // The other port takes connections, and no client.
  EXPECT_THAT(broken({"--server", server.worker_url()}), Contains(HasSubstr("tcp://127.0.0.1")));
}

TEST_F(Doctor, SaysOfKeysWhetherTheyCanBeUsedAndNothingThatTheyHold) {
  ASSERT_EQ(test::run_oblique(folder_, {"keygen", "keys"}).exit_code, 0);
  const std::string key = folder_.file("keys/client.key");
  const auto good = asked({"--json", "--keys", key});
  EXPECT_EQ(json_of(good).at("settings").at("key_file").at("mode"), "0600");
  EXPECT_EQ(json_of(good).at("settings").at("key_file").at("usable"), true);
  std::ifstream file(key);
  for (std::string word; file >> word;) {
    if (word.size() > 30) {
      EXPECT_THAT(good.out, Not(HasSubstr(word)));
    }
  }
  const test::Server server(folder_, folder_.file("a.db"),
                            {{"OBLIQUE_KEYS", folder_.file("keys/server.key")}});
  const auto refused =
      asked({"--json", "--server", server.client_url(), "--keys", folder_.file("keys/worker.key")});
  EXPECT_THAT(json_of(refused).at("broken"), Contains(HasSubstr("The server at")));
  EXPECT_THAT(refused.out, Not(HasSubstr("public key")));
  EXPECT_EQ(asked({"--server", server.client_url(), "--keys", key}).exit_code, 0);
  EXPECT_EQ(asked({"--server", server.client_url()}).exit_code, 1);
  ::chmod(key.c_str(), 0644);
  EXPECT_THAT(broken({"--keys", key}), Contains(HasSubstr("chmod")));
  EXPECT_THAT(broken({"--keys", "none.key"}), Contains(HasSubstr("There is no key file none.key")));
}

TEST_F(Doctor, NamesVariablesThatNothingReadsWithoutTheirValues) {
  const auto outcome = asked({}, {{"OBLIQUE_SEVER", "tcp://secret"}, {"OBLIQUE_PAGER", "less -S"}});
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("OBLIQUE_SEVER is set, and no program of oblique reads it"),
                    HasSubstr("OBLIQUE_PAGER = less -S"), Not(HasSubstr("secret"))));
}

TEST(LimitsOfAGroup, AreTheTightestFromTheProcessUpwards) {
  const test::TemporaryFolder folder;
  const auto write = [&](const std::string& name, const std::string& text) {
    std::filesystem::create_directories(std::filesystem::path(folder.file(name)).parent_path());
    std::ofstream(folder.file(name)) << text;
  };
  const std::string root = folder.path().string();
  EXPECT_FALSE(protocol::limits_of_group(root, "0::/\n").cores);
  write("a/cpu.max", "150000 100000\n");
  write("a/b/cpu.max", "max 100000\n");
  write("a/b/memory.max", "500000000\n");
  const auto limits = protocol::limits_of_group(root, "4:memory:/c\n0::/a/b\n");
  EXPECT_EQ(limits.cores, 1.5);
  EXPECT_EQ(limits.memory_bytes, 500'000'000U);
  EXPECT_FALSE(protocol::limits_of_group(root, "4:memory:/a/b\n").cores) << "of version 1";
}

TEST(TheHomeFolder, IsATildeWhereverItStandsAndNowhereElse) {
  EXPECT_EQ(doctor::without_home("/home/anna/a.db and /home/anna", "/home/anna/"), "~/a.db and ~");
  EXPECT_EQ(doctor::without_home("/home/annabel/a.db", "/home/anna"), "/home/annabel/a.db");
  EXPECT_EQ(doctor::without_home("/mnt/home/anna", "/home/anna"), "/mnt/home/anna");
  EXPECT_EQ(doctor::without_home("/a", "/"), "/a");
  EXPECT_EQ(doctor::without_home("/a", ""), "/a");
}

}  // namespace
}  // namespace oblique::client
