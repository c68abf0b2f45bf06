// `oblique plot` of one point, and `oblique paper --figures`, as people call them.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::Not;

/// A folder with oblique.db: a study `a` of 12 points, of which the first has a result.
class PlotPoint : public testing::Test {
 protected:
  PlotPoint() {
    server::Store store((folder_.path() / "oblique.db").string());
    const auto table = server::table_of(12);
    const std::vector<server::Change> changes{
        server::AddStudy{1, "a", table, "2024-01-01T00:00:00.000Z"},
        server::AddResults{1, table, 0, "", "", 1, "now", {server::solved_point(0)}}};
    store.commit(changes);
  }
  test::Outcome plot(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "plot");
    const auto says_where = [](const std::string& word) {
      return word == "--out" || word == "--format" || word == "--show" || word == "--help";
    };
    if (std::none_of(arguments.begin(), arguments.end(), says_where)) {
      arguments.insert(arguments.end(), {"--format", "svg"});
    }
    return test::run_oblique(folder_, arguments);
  }

  test::TemporaryFolder folder_;
};

TEST_F(PlotPoint, DrawsAPointOfAStudySolvedAgainOrForTheFirstTime) {
  for (const char* point : {"0", "11"}) {
    const auto outcome = plot({"a", "--point", point});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(outcome.out.starts_with("<?xml"));
    EXPECT_THAT(outcome.out, HasSubstr("Point " + std::string(point) + " of a"));
    EXPECT_THAT(outcome.out, HasSubstr("Shape of the finger"));
  }
}

TEST_F(PlotPoint, DrawsTheFingerAsItFalls) {
  const auto shape =
      plot({"--preset", "paper", "--H", "0.4", "--mu", "0.4", "--e", "1", "--panel", "shape"});
  EXPECT_EQ(shape.exit_code, 0) << shape.err;
  for (const char* drop : {"0.1 m", "0.2 m", "0.3 m"}) {
    EXPECT_THAT(shape.out, HasSubstr(drop));
  }
}

TEST_F(PlotPoint, ALogarithmHasNoRangeFromZero) {
  const auto outcome = plot({"a", "--histogram", "fn_peak_N", "--log-x", "--range", "0:1"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--range 0:1 is not allowed with --log-x"));
}

TEST_F(PlotPoint, SaysWhereThePointSolvedAgainIsOtherThanStored) {
  const auto other = plot({"a", "--point", "0"});
  EXPECT_THAT(other.err, HasSubstr("Solved again, it is other than stored in "));
  EXPECT_THAT(other.err, HasSubstr("fn_peak_N"));
  EXPECT_THAT(other.out, HasSubstr("it is other than stored in")) << "in the picture too";
  const auto not_stored = plot({"a", "--point", "11"});
  EXPECT_THAT(not_stored.err, Not(HasSubstr("stored")));

  test::run_oblique(folder_, {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1",
                              "--name", "own"});
  const auto same = plot({"own", "--point", "0"});
  EXPECT_EQ(same.exit_code, 0) << same.err;
  EXPECT_THAT(same.err + same.out, Not(HasSubstr("stored")));
}

TEST_F(PlotPoint, OfAServerHasTheShapesThatAWorkerSends) {
  const test::Server server(folder_, "oblique.db");
  const test::Worker worker(folder_, server.worker_url(), {"--threads", "1", "--name", "ann"});
  const auto ask = [&](const std::string& more) {
    return plot({"a", "--point", "11", "--panel", "shape", "--server", server.client_url(), more});
  };
  test::wait_until("the worker is there", [&] { return ask("--on-worker").exit_code == 0; });
  const auto there = ask("--on-worker");
  EXPECT_THAT(there.out, HasSubstr("at touch"));
  EXPECT_THAT(there.out, HasSubstr("at separation"));
  EXPECT_THAT(there.out, HasSubstr("drop "));
  EXPECT_THAT(there.out, Not(HasSubstr("--local")));
  const auto here = ask("--local");
  EXPECT_EQ(here.out, there.out);
}

TEST_F(PlotPoint, DrawsAPointOfNoStudy) {
  const auto outcome = plot({"--preset", "paper", "--H", "1", "--mu", "1.2", "--e", "1", "--panel",
                             "forces", "--tip-mass", "0.001"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Contact forces"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("Shape of the finger")));
}

TEST_F(PlotPoint, ShowsItInTheTerminal) {
  const auto outcome = plot({"a", "--point", "0", "--panel", "loop", "--show"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("compression"));
}

TEST_F(PlotPoint, SaysWhatIsWrongWithTheFlags) {
  const auto refused = [this](const std::vector<std::string>& arguments) {
    const auto outcome = plot(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    return outcome.err;
  };
  EXPECT_THAT(refused({}), HasSubstr("the name of a study, or the values of a point"));
  EXPECT_THAT(refused({"a", "--H", "1"}), HasSubstr("--point N"));
  EXPECT_THAT(refused({"--point", "3"}), HasSubstr("name the study"));
  EXPECT_THAT(refused({"a", "--panel", "loop"}), HasSubstr("--point N"));
  EXPECT_THAT(refused({"a", "--point", "3", "--panel", "lop"}), HasSubstr("did you mean `loop`"));
  EXPECT_THAT(refused({"a", "--point", "3", "--map", "fn_peak_N"}), HasSubstr("--map"));
  EXPECT_THAT(refused({"a", "--point", "3", "--on-worker"}), HasSubstr("--server"));
  EXPECT_THAT(refused({"--H", "0.5,1", "--mu", "1", "--e", "1"}), HasSubstr("one value each"));
}

TEST_F(PlotPoint, ThatTheStudyLacksIsNoWrongUsage) {
  const auto outcome = plot({"a", "--point", "12"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("0 to 11"));
}

TEST(PaperFiguresVerb, WritesFiveFilesIntoAFolderOfItsOwn) {
  const test::TemporaryFolder folder;
  const auto outcome = test::run_oblique(folder, {"paper", "--figures", "made/here"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() / "made" / "here")) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string svg{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    EXPECT_TRUE(svg.starts_with("<?xml") && svg.find("</svg>") != std::string::npos)
        << entry.path();
    ++files;
  }
  EXPECT_EQ(files, 5U);
}

TEST(PaperFiguresVerb, RefusesAFolderThatIsAFile) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "taken") << "x";
  const auto outcome = test::run_oblique(folder, {"paper", "--figures", "taken"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--figures taken"));
}

}  // namespace
}  // namespace oblique::client
