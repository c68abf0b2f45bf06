// A run whose workers may not solve what is left ends and says so; so does one whose study somebody
// else has stopped.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/study/study_file.h"
#include "server/store/store.h"
#include "tests/client/study/pretended_fall.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"

namespace oblique::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kBegun = R"(name = "begun"
[model]
elements_per_link = 1
[[block]]
H = 0.9
mu = [0.2, 0.4, 0.6]
e = 0.8
)";

/// A folder with begun.toml and a database in which solver 0.1 has solved its first point.
class BegunByAnotherSolver : public testing::Test {
 protected:
  BegunByAnotherSolver() {
    std::ofstream(folder_.path() / "begun.toml") << kBegun;
    const Study study = parse_study(kBegun, "begun.toml", pretended_reach());
    const auto table = std::make_shared<const protocol::PointTable>(study.recipe);
    server::Store store((folder_.path() / "oblique.db").string());
    constexpr const char* kThen = "2024-01-01T00:00:00.000Z";
    const std::vector<server::Change> changes{
        server::AddStudy{1, study.name, table, kThen},
        server::AddWorker{1, "ann", 1, "0.1", "avx2", kThen},
        server::AddResults{1, table, 1, "0.1", "avx2", 1, kThen, {server::solved_point(0)}}};
    store.commit(changes);
  }

  test::TemporaryFolder folder_;
};

TEST_F(BegunByAnotherSolver, IsNotWaitedForAndTheWaysOutAreNamed) {
  const auto outcome = test::run_oblique(folder_, {"run", "begun.toml"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("are of solver 0.1, and the workers here have "));
  EXPECT_THAT(outcome.err, HasSubstr("its other 2 points"));
  EXPECT_THAT(outcome.err, HasSubstr("--mix-versions"));
  EXPECT_THAT(test::run_oblique(folder_, {"status"}).out, HasSubstr("0.1\n"))
      << "a file says it as a server does";
  const auto mixed = test::run_oblique(folder_, {"run", "begun.toml", "--mix-versions"});
  EXPECT_EQ(mixed.exit_code, 0) << mixed.err;
  EXPECT_THAT(test::run_oblique(folder_, {"status"}).out,
              AllOf(HasSubstr("100 %"), HasSubstr("mixed\n")));
}

TEST(RunOnAnOlderDatabase, SaysWhatIsDoneToItAndThatItIsOnce) {
  const test::TemporaryFolder folder;
  std::filesystem::copy_file(OBLIQUE_SOURCE_DIR "/tests/server/store/old/made_by_schema_7.sqlite",
                             folder.path() / "oblique.db");
  std::ofstream(folder.path() / "begun.toml") << kBegun;
  const auto first = test::run_oblique(folder, {"run", "begun.toml"});
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.err, HasSubstr("oblique.db: the database is brought from schema 7 to 8, once"));
  EXPECT_THAT(first.err, HasSubstr(" results are brought over."));
  const auto second = test::run_oblique(folder, {"run", "begun.toml"});
  EXPECT_EQ(second.exit_code, 0) << second.err;
  EXPECT_EQ(second.err.find("schema"), std::string::npos) << second.err;
}

/// Sockets that a process has open, as /proc names them.
std::vector<std::string> sockets_of(pid_t pid) {
  std::vector<std::string> sockets;
  std::error_code gone;
  const std::string folder = "/proc/" + std::to_string(pid) + "/fd";
  for (const auto& entry : std::filesystem::directory_iterator(folder, gone)) {
    const std::string what = std::filesystem::read_symlink(entry.path(), gone).string();
    if (what.starts_with("socket:[")) {
      sockets.push_back(what.substr(8, what.size() - 9));
    }
  }
  return sockets;
}

/// Ports on which a process listens.
std::vector<std::string> ports_of(pid_t pid) {
  constexpr const char* kListens = "0A";
  const auto sockets = sockets_of(pid);
  std::vector<std::string> ports;
  std::ifstream table("/proc/" + std::to_string(pid) + "/net/tcp");
  for (std::string line; std::getline(table, line);) {
    std::istringstream fields(line);
    std::vector<std::string> field{std::istream_iterator<std::string>(fields), {}};
    if (field.size() > 9 && field[3] == kListens &&
        std::find(sockets.begin(), sockets.end(), field[9]) != sockets.end()) {
      ports.push_back(std::to_string(std::stoul(field[1].substr(field[1].find(':') + 1), {}, 16)));
    }
  }
  return ports;
}

/// The file with the client's key of the run that keeps its keys in `folder`; empty before.
std::string key_in(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (const auto key = entry.path() / "client.key"; std::filesystem::exists(key)) {
      return key.string();
    }
  }
  return {};
}

/// Gives the service of `run` that order, as its user can from another terminal.
bool order(const test::TemporaryFolder& folder, const test::Process& run, const std::string& verb) {
  const std::string key = key_in(folder.path());
  for (const pid_t child : test::children_of(run.pid())) {
    for (const auto& port : key.empty() ? std::vector<std::string>() : ports_of(child)) {
      const auto outcome = test::run_oblique(
          folder,
          {verb, "long", "--server", "tcp://127.0.0.1:" + port, "--keys", key, "--timeout", "1"});
      if (outcome.exit_code == 0) {
        return true;
      }
    }
  }
  return false;
}

class StoppedByAnother : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(StoppedByAnother, EndsTheRunThatSaysSo) {
  const auto& [verb, state] = GetParam();
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "long.toml") << R"(name = "long"
[model]
elements_per_link = 4
[[block]]
H = 1.0
mu = { from = 0.1, to = 2.0, count = 20000 }
e = 0.9
)";
  test::Process run(folder, test::client_program(), {"run", "long.toml"},
                    {{"TMPDIR", folder.path().string()}});
  test::wait_until("the order is taken",
                   [&, verb = std::string(verb)] { return order(folder, run, verb); });
  const auto outcome = run.outcome();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr(std::string("somebody has ") + state +
                                     " \"long\": the same command again goes on with it"));
  EXPECT_THAT(test::run_oblique(folder, {"status"}).out, HasSubstr(state));
}

INSTANTIATE_TEST_SUITE_P(Orders, StoppedByAnother,
                         testing::Values(std::pair{"pause", "paused"},
                                         std::pair{"cancel", "cancelled"}));

}  // namespace
}  // namespace oblique::client
