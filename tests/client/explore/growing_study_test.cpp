#include "client/explore/growing_study.h"

#include <cmath>
#include <csignal>
#include <cstdint>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "client/service/connection.h"
#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

protocol::Block drops(const std::vector<double>& H_m) {
  return listed_points({"H", "mu", "e"}, {H_m, {0.4}, {1.0}});
}

double number(const protocol::Table& table, std::size_t row, std::size_t column) {
  return std::get<double>(table.rows.at(row).at(column));
}

/// A study that grows at a server with a worker.
class GrowingStudyTest : public ::testing::Test {
 protected:
  GrowingStudyTest() { flags_.source.server = server_.client_url(); }

  GrowingStudy open(const std::string& name = "growing",
                    const solver::ModelParameters& model = solver::preset("paper")) {
    return {console_, flags_, name, model, stop_};
  }

  double solved() const { return test::Database(database_).rows(); }

  std::ostringstream out_;
  std::ostringstream err_;
  Console console_{out_, err_};
  ExploreFlags flags_;
  protocol::StopSignals stop_;
  test::TemporaryFolder folder_;
  std::string database_{folder_.file("growing.db")};
  test::Server server_{folder_, database_};
  std::optional<test::Worker> worker_{std::in_place, folder_, server_.worker_url()};
};

TEST_F(GrowingStudyTest, GrowsByBlocksAndReturnsTheRowsOfEachInTheOrderOfItsPoints) {
  auto study = open();
  const auto first = study.solve(drops({1.0, 0.5}), "H, fn_peak_N", "round 1");
  ASSERT_EQ(first.columns, (std::vector<std::string>{"H", "fn_peak_N"}));
  ASSERT_EQ(first.rows.size(), 2U);
  EXPECT_EQ(number(first, 0, 0), 1.0);
  EXPECT_EQ(number(first, 1, 0), 0.5);
  EXPECT_GT(number(first, 0, 1), number(first, 1, 1));
  const auto second = study.solve(drops({0.75}), "H", "round 2");
  EXPECT_EQ(number(second, 0, 0), 0.75);
  EXPECT_EQ(study.rounds(), 2U);
  EXPECT_EQ(study.points(), 3U);
}

TEST_F(GrowingStudyTest, AFailedPointHasNoValues) {
  auto study = open();
  const auto rows = study.solve(drops({1.0, 1.199}), "fn_peak_N", "round 1").rows;
  EXPECT_TRUE(std::holds_alternative<double>(rows.at(0).at(0)));
  EXPECT_TRUE(std::holds_alternative<std::monostate>(rows.at(1).at(0)));
}

TEST_F(GrowingStudyTest, ContinuesBetweenRoundsWithoutSolvingAPointTwice) {
  const auto first = open().solve(drops({1.0, 0.5}), "fn_peak_N", "round 1");
  worker_.reset();  // the results of round 1 are stored, so it needs no worker
  auto again = open();
  EXPECT_EQ(again.solve(drops({1.0, 0.5}), "fn_peak_N", "round 1").rows, first.rows);
  EXPECT_EQ(solved(), 2.0);
  worker_.emplace(folder_, server_.worker_url());
  again.solve(drops({0.75}), "fn_peak_N", "round 2");
  EXPECT_EQ(solved(), 3.0);
}

TEST_F(GrowingStudyTest, ContinuesWithinARoundThatASignalStopped) {
  worker_.reset();
  {
    auto study = open();
    raise(SIGINT);
    EXPECT_THROW(study.solve(drops({1.0, 0.5}), "fn_peak_N", "round 1"), Interrupted);
  }
  EXPECT_EQ(stop_.exit_code(), 128 + SIGINT);
  worker_.emplace(folder_, server_.worker_url());
  protocol::StopSignals other;
  GrowingStudy again(console_, flags_, "growing", solver::preset("paper"), other);
  EXPECT_EQ(again.solve(drops({1.0, 0.5}), "fn_peak_N", "round 1").rows.size(), 2U);
  EXPECT_EQ(solved(), 2.0);
}

TEST_F(GrowingStudyTest, ContinuesACancelledStudy) {
  open().solve(drops({1.0}), "fn_peak_N", "round 1");
  Connection({.server_url = server_.client_url()}).change("growing", protocol::STUDY_CHANGE_CANCEL);
  auto again = open();
  again.solve(drops({1.0}), "fn_peak_N", "round 1");
  EXPECT_EQ(again.solve(drops({0.5}), "fn_peak_N", "round 2").rows.size(), 1U);
}

TEST_F(GrowingStudyTest, ReportsMissingRowsOfAStudyThatWasRenamed) {
  {
    auto study = open();
    study.solve(drops({1.0}), "fn_peak_N", "round 1");
    study.solve(drops({0.5, 0.6}), "fn_peak_N", "round 2");
  }
  auto again = open();
  again.solve(drops({1.0}), "fn_peak_N", "round 1");
  Connection connection({.server_url = server_.client_url()});
  connection.change("growing", protocol::STUDY_CHANGE_RENAME,
                    connection.status("growing").at(0).study_id(), "renamed");
  EXPECT_THROW(again.solve(drops({0.5, 0.6}), "fn_peak_N", "round 2"), std::runtime_error);
}

TEST_F(GrowingStudyTest, ContinuesBlocksThatDifferByRoundingErrors) {
  const auto first = open().solve(drops({1.0, 0.5}), "H, fn_peak_N", "round 1");
  auto again = open();
  const auto nearly = drops({std::nextafter(1.0, 2.0), std::nextafter(0.5, 0.0)});
  EXPECT_EQ(again.solve(nearly, "H, fn_peak_N", "round 1").rows, first.rows);
  again.solve(drops({0.75}), "fn_peak_N", "round 2");
  EXPECT_EQ(solved(), 3.0);
  auto other = open();
  EXPECT_THROW(other.solve(drops({1.0 + 1e-9, 0.5}), "H", "round 1"), solver::InputError);
}

TEST_F(GrowingStudyTest, GrowsSideBySideWithAnEqualExploration) {
  auto ours = open();
  auto other = open();
  const auto first = other.solve(drops({1.0}), "fn_peak_N", "round 1");
  const auto second = other.solve(drops({0.5, 0.6}), "fn_peak_N", "round 2");
  EXPECT_EQ(ours.solve(drops({1.0}), "fn_peak_N", "round 1").rows, first.rows);
  EXPECT_EQ(ours.solve(drops({0.5, 0.6}), "fn_peak_N", "round 2").rows, second.rows);
  ours.solve(drops({0.75}), "fn_peak_N", "round 3");
  EXPECT_EQ(other.solve(drops({0.75}), "fn_peak_N", "round 3").rows.size(), 1U);
  EXPECT_EQ(solved(), 4.0);
}

TEST_F(GrowingStudyTest, RefusesAStudyThatAnotherExplorationMadeLonger) {
  auto ours = open();
  auto other = open();
  other.solve(drops({0.9}), "fn_peak_N", "round 1");
  other.solve(drops({0.5}), "fn_peak_N", "round 2");
  EXPECT_THROW(ours.solve(drops({1.0}), "fn_peak_N", "round 1"), std::runtime_error);
  EXPECT_EQ(solved(), 2.0);
}

TEST_F(GrowingStudyTest, RefusesAnotherBlockOrModelUnderTheSameName) {
  open().solve(drops({1.0, 0.5}), "fn_peak_N", "round 1");
  auto again = open();
  EXPECT_THROW(again.solve(drops({1.0, 0.6}), "fn_peak_N", "round 1"), solver::InputError);
  EXPECT_THROW(open("growing", solver::preset("standard")), solver::InputError);
  EXPECT_EQ(solved(), 2.0);
}

TEST(GrowingStudyHere, SolvesWithoutAServerAndContinues) {
  const test::TemporaryFolder folder;
  std::ostringstream out;
  std::ostringstream err;
  Console console(out, err);
  ExploreFlags flags;
  flags.source.database = folder.file("here.db");
  protocol::StopSignals stop;
  const auto solve = [&] {
    GrowingStudy study(console, flags, "growing", solver::preset("paper"), stop);
    return study.solve(drops({1.0, 0.5}), "fn_peak_N", "round 1").rows;
  };
  const auto rows = solve();
  EXPECT_EQ(solve(), rows);
  EXPECT_NE(err.str().find("Continuing \"growing\": 2 of 2 points"), std::string::npos)
      << err.str();
  EXPECT_EQ(test::Database(flags.source.database).rows(), 2.0);
}

TEST(ExploredName, IsTheSameForTheSameSettingsUnlessGiven) {
  ExploreFlags flags;
  const auto name = explored_name(flags, "map", "x=mu");
  EXPECT_EQ(name, explored_name(flags, "map", "x=mu"));
  EXPECT_NE(name, explored_name(flags, "map", "x=e"));
  EXPECT_TRUE(name.starts_with("map-")) << name;
  flags.name = "mine";
  EXPECT_EQ(explored_name(flags, "map", "x=mu"), "mine");
  flags.name = "-x";
  EXPECT_THROW(explored_name(flags, "map", "x=mu"), solver::InputError);
}

}  // namespace
}  // namespace oblique::client
