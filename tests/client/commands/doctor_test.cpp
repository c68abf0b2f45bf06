// `oblique doctor`, whose output users attach to defect reports.
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"
#include "tests/support/reserved_port.h"
#include "tests/support/stored_study.h"

namespace oblique::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Doctor : public testing::Test {
 protected:
  test::Outcome outcome_of(std::vector<std::string> flags) const {
    flags.insert(flags.begin(), "doctor");
    return test::run_oblique(folder_, flags);
  }
  /// Returns the output of `oblique doctor`; expects exit code 0.
  std::string healthy(const std::vector<std::string>& flags) const {
    const auto outcome = outcome_of(flags);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
    return outcome.out;
  }
  /// Returns the lines that report errors; expects exit code 1.
  std::string errors(const std::vector<std::string>& flags) const {
    const auto outcome = outcome_of(flags);
    EXPECT_EQ(outcome.exit_code, 1) << outcome.out << outcome.err;
    std::string errors;
    std::istringstream lines(outcome.out);
    for (std::string line; std::getline(lines, line);) {
      errors += line.starts_with("error ") ? line + '\n' : std::string();
    }
    return errors;
  }

  test::TemporaryFolder folder_;
};

TEST_F(Doctor, ReportsEachCheckOnOneLine) {
  const auto out = healthy({});
  for (const char* line : {"versions   oblique ", "oblique-server is of the same build\n",
                           "oblique-worker is of the same build\n", "processor  ",
                           "threads may be used; the solver uses ", "solver     ",
                           "ms of processor time per point; reference for ", "disk       ",
                           "there is no database oblique.db yet", "key        no key file",
                           "server     not checked"}) {
    EXPECT_THAT(out, HasSubstr(line));
  }
  std::istringstream lines(out);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_TRUE(line.starts_with("ok ") || line.starts_with("warning ")) << line;
  }
}

TEST_F(Doctor, ReadsADatabaseWhoseServerWasKilled) {
  std::filesystem::create_directory(folder_.path() / "data");
  {
    server::Store store(folder_.file("data/alive.db"));
    test::add_study(store, "friction", 4, 2);
    // Copies the open database: a killed server leaves the same files.
    std::filesystem::copy(folder_.file("data/alive.db"), folder_.file("data/dead.db"));
    std::filesystem::copy(folder_.file("data/alive.db-wal"), folder_.file("data/dead.db-wal"));
    EXPECT_THAT(healthy({"--db", "data/alive.db"}), HasSubstr("1 study, in use by a server"));
  }
  EXPECT_THAT(healthy({"--db", "data/dead.db"}), HasSubstr("1 study, not in use by a server"));
}

TEST_F(Doctor, NamesAMissingOrInvalidDatabase) {
  std::ofstream(folder_.file("text.db")) << "no database, but long enough to be looked at\n";
  EXPECT_THAT(errors({"--db", "missing.db"}), HasSubstr("there is no database missing.db"));
  EXPECT_THAT(errors({"--db", "text.db"}), HasSubstr("text.db"));
  EXPECT_THAT(errors({"--db", "."}), HasSubstr("is a directory"));
  EXPECT_THAT(errors({"--db", "/nowhere/a.db"}), HasSubstr("there is no folder /nowhere"));
}

TEST_F(Doctor, ReportsWhetherAServerAnswers) {
  EXPECT_THAT(errors({"--server", "hub"}), HasSubstr("tcp://"));
  const test::ReservedPort port;
  EXPECT_THAT(errors({"--server", port.url(), "--timeout", "0.05"}),
              HasSubstr("no answer from " + port.url()));
  const test::Server server(folder_, folder_.file("a.db"));
  EXPECT_THAT(healthy({"--server", server.client_url()}),
              AllOf(HasSubstr(server.client_url() + " answers: oblique-server "),
                    HasSubstr("start oblique-worker"), Not(HasSubstr("install one version"))));
}

TEST_F(Doctor, ReportsWhetherAKeyIsAdmittedWithoutPrintingIt) {
  ASSERT_EQ(test::run_oblique(folder_, {"keygen", "keys"}).exit_code, 0);
  const std::string key = folder_.file("keys/client.key");
  const test::Server server(folder_, folder_.file("a.db"),
                            {{"OBLIQUE_KEYS", folder_.file("keys/server.key")}});
  const auto good = healthy({"--server", server.client_url(), "--keys", key});
  EXPECT_THAT(good, AllOf(HasSubstr("client.key holds the client key"),
                          HasSubstr("answers and admits the key")));
  std::ifstream file(key);
  for (std::string word; file >> word;) {
    if (word.size() > 30) {
      EXPECT_THAT(good, Not(HasSubstr(word)));
    }
  }
  EXPECT_THAT(errors({"--server", server.client_url(), "--keys", folder_.file("keys/worker.key")}),
              HasSubstr("server     "));
  EXPECT_THAT(errors({"--server", server.client_url()}), HasSubstr("server     "));
  chmod(key.c_str(), 0644);
  EXPECT_THAT(errors({"--keys", key}), HasSubstr("chmod"));
  EXPECT_THAT(errors({"--keys", "none.key"}), HasSubstr("none.key"));
}

}  // namespace
}  // namespace oblique::client
