#include "client/service/connection.h"

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/service/source.h"
#include "client/service/watching.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "server/database/database_file.h"
#include "server/store/store.h"
#include "tests/client/service/scripted_server.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

/// Runs each test in a temporary folder. OBLIQUE_SERVER is not set when a test starts.
class SourceTest : public ::testing::Test {
 protected:
  SourceTest() {
    std::filesystem::current_path(folder_.path());
    unsetenv("OBLIQUE_SERVER");
  }
  ~SourceTest() override {
    unsetenv("OBLIQUE_SERVER");
    std::filesystem::current_path(before_);
  }

  static void make_database(const std::string& file, const std::string& study) {
    protocol::Recipe recipe;
    *recipe.mutable_model() = protocol::to_message(solver::preset("paper"));
    for (const auto& [key, value] : {std::pair{"H", 1.0}, {"mu", 0.4}, {"e", 1.0}}) {
      if (recipe.blocks().empty()) {
        recipe.add_blocks();
      }
      auto& axis = *recipe.mutable_blocks(0)->add_axes();
      axis.set_key(key);
      axis.add_values(value);
    }
    server::Store store(file);
    const std::vector<server::Change> changes{
        server::AddStudy{1, study, std::make_shared<const protocol::PointTable>(recipe),
                         "2026-01-01T00:00:00.000Z"}};
    store.commit(changes);
  }

  std::unique_ptr<Source> open(const SourceFlags& flags) { return open_source(console_, flags); }
  /// Returns the name of the source's only study, which identifies the source.
  std::string study_of(const SourceFlags& flags) { return open(flags)->status({}).at(0).name(); }

  std::ostringstream err_;
  Console console_{err_, err_};
  oblique::test::TemporaryFolder folder_;
  std::filesystem::path before_ = std::filesystem::current_path();
  ScriptedServer named_{answer("named")};
  ScriptedServer from_environment_{answer("environment")};

 private:
  static ScriptedServer::Answer answer(const std::string& name) {
    return [name](const protocol::ClientRequest& request) {
      auto reply = reply_to(request);
      reply.mutable_status()->add_studies()->set_name(name);
      return std::vector{protocol::encode(reply)};
    };
  }
};

TEST_F(SourceTest, IsNamedByFlagsThenTheEnvironmentThenTheFileInThisFolder) {
  make_database("oblique.db", "default");
  make_database("other.db", "other");
  EXPECT_EQ(study_of({}), "default");
  setenv("OBLIQUE_SERVER", "", 1);
  EXPECT_EQ(study_of({}), "default") << "an empty variable names no server";
  setenv("OBLIQUE_SERVER", from_environment_.url().c_str(), 1);
  EXPECT_EQ(study_of({}), "environment");
  EXPECT_EQ(study_of({.database = "other.db", .server = {}, .timeout_s = {}}), "other");
  EXPECT_EQ(study_of({.database = {}, .server = named_.url(), .timeout_s = {}}), "named");
}

TEST_F(SourceTest, IsTheServerAtItsDefaultAddressWithoutAFile) {
  EXPECT_EQ(open({})->place(), ConnectionSettings().server_url);
}

TEST_F(SourceTest, ReportsThatAFileHasNoServer) {
  make_database("oblique.db", "default");
  EXPECT_EQ(open({})->status("default").at(0).waits_for(), "a server; none uses oblique.db now");
  const server::Store at_work("oblique.db");
  EXPECT_EQ(open({})->status("default").at(0).waits_for(), "");
}

TEST_F(SourceTest, DoesNotBlockAServerByReadingItsFile) {
  make_database("oblique.db", "default");
  std::atomic<bool> goes_on{true};
  std::thread looking([&goes_on] {
    while (goes_on) {
      (void)server::is_in_use("oblique.db");
    }
  });
  for (int i = 0; i < 20; ++i) {
    EXPECT_NO_THROW(server::Store("oblique.db"));
  }
  goes_on = false;
  looking.join();
}

TEST_F(SourceTest, ReportsAWrongStatementAsWrongUsageForFilesAndServers) {
  make_database("oblique.db", "default");
  EXPECT_THROW(open({})->query("SELEC 1"), solver::InputError);
  EXPECT_THROW(open({})->query("DELETE FROM results"), solver::InputError);
  const ScriptedServer server([](const protocol::ClientRequest& request) {
    auto reply = reply_to(request);
    reply.mutable_error()->set_message("the statement is wrong");
    reply.mutable_error()->set_code(request.query().sql() == "SELEC 1"
                                        ? protocol::ERROR_CODE_WRONG_REQUEST
                                        : protocol::ERROR_CODE_FAILED);
    return std::vector{protocol::encode(reply)};
  });
  const auto source = open({.database = {}, .server = server.url(), .timeout_s = {}});
  EXPECT_THROW(source->query("SELEC 1"), solver::InputError);
  EXPECT_THROW(source->query("SELECT 1"), ServerError);
}

TEST(ResultQuery, BecomesARequestWithTheSameClauses) {
  const auto plain = request_for({.study = "a"}).question();
  EXPECT_FALSE(plain.has_limit());
  EXPECT_TRUE(plain.select().empty());
  const auto full = request_for({"a", "mu > 1 OR 1", "e, avg(mu)", "e", "avg(mu)", 5}).question();
  EXPECT_EQ(full.study(), "a");
  EXPECT_EQ(full.where(), "mu > 1 OR 1");
  EXPECT_EQ(full.select(0), "e, avg(mu)");
  EXPECT_EQ(full.group(), "e");
  EXPECT_EQ(full.order(), "avg(mu)");
  EXPECT_EQ(full.limit(), 5U);
}

TEST(ResultQuery, AnErrorNamesTheWrongFlag) {
  const auto refusal = [](const ResultQuery& query) -> std::string {
    try {
      check(query);
    } catch (const solver::InputError& error) {
      return error.what();
    }
    return {};
  };
  using testing::HasSubstr;
  EXPECT_EQ(refusal({.study = "a"}), "");
  EXPECT_THAT(refusal({.where = "mu > 0.5 --"}), HasSubstr("--where"));
  EXPECT_THAT(refusal({.select = "mu FROM runs --"}), HasSubstr("--select"));
  EXPECT_THAT(refusal({.order = "mu LIMIT 1"}), HasSubstr("--order"));
  EXPECT_THAT(refusal({.group = "mu ORDER BY 1"}), HasSubstr("--group"));
  EXPECT_THAT(refusal({.limit = -1}), HasSubstr("--limit -1"));
}

std::string update(WaitMessages& messages, double elapsed_s, const std::string& waits_for) {
  protocol::StudyStatus status;
  status.set_waits_for(waits_for);
  return messages.update(status, WaitMessages::Seconds{elapsed_s});
}

TEST(WaitMessages, ReportAReasonForWaitingOnceAndThatTheStudyContinues) {
  WaitMessages messages;
  EXPECT_EQ(update(messages, 0, "a worker"), "");
  EXPECT_EQ(update(messages, 1.9, "a worker"), "");
  EXPECT_EQ(update(messages, 2, "a worker"), "The study waits for a worker.");
  EXPECT_EQ(update(messages, 100, "a worker"), "");
  EXPECT_EQ(update(messages, 101, ""), "The study continues.");
  EXPECT_EQ(update(messages, 102, ""), "");
}

TEST(WaitMessages, IgnoreAShortWait) {
  WaitMessages messages;
  EXPECT_EQ(update(messages, 0, "a worker"), "");
  EXPECT_EQ(update(messages, 1, ""), "");
  EXPECT_EQ(update(messages, 2, "a worker"), "");
  EXPECT_EQ(update(messages, 3.9, "a worker"), "");
  EXPECT_EQ(update(messages, 4, ""), "");
}

TEST(WaitMessages, ReportAChangedReason) {
  WaitMessages messages;
  update(messages, 0, "a worker");
  EXPECT_NE(update(messages, 3, "a worker"), "");
  EXPECT_EQ(update(messages, 4, "the database"), "");
  EXPECT_EQ(update(messages, 6, "the database"), "The study waits for the database.");
}

// ---- Renamed studies ----------------------------------------------------------------------------

/// A source with one study.
class OneStudy : public Source {
 public:
  using Source::status;
  std::vector<protocol::StudyStatus> status(const std::string& study, const Tell&) override {
    if (study.empty() || study == held.name()) {
      return {held};
    }
    throw std::runtime_error("there is no study called " + study);
  }
  std::unique_ptr<RowStream> rows(protocol::QueryRequest) override { return nullptr; }
  std::string place() const override { return "here"; }

  protocol::StudyStatus held;
};

TEST(FollowedStudy, IsFollowedByItsNumberAfterARename) {
  OneStudy source;
  source.held.set_study_id(7);
  source.held.set_name("first");
  FollowedStudy followed(source, "first");
  std::string printed;
  const Tell tell = [&printed](const std::string& sentence) { printed += sentence; };
  EXPECT_EQ(followed.status(tell).name(), "first");
  source.held.set_name("other");
  EXPECT_EQ(followed.status(tell).name(), "other");
  EXPECT_EQ(followed.status(tell).name(), "other");
  EXPECT_EQ(printed, "first is now called other.") << "the new name is reported once";
  source.held.set_study_id(8);
  EXPECT_THROW(followed.status(tell), std::runtime_error) << "study 7 was deleted";
}

}  // namespace
}  // namespace oblique::client
