#include "client/service/watch_teller.h"

#include <string>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using Seconds = WatchTeller::Seconds;

protocol::StudyStatus status(std::uint64_t solved, const std::string& waits_for = {}) {
  protocol::StudyStatus status;
  status.set_points(1000);
  status.set_solved(solved);
  status.set_waits_for(waits_for);
  return status;
}

TEST(WatchTeller, SaysOnceWhatAStudyWaitsForAndThatItGoesOn) {
  WatchTeller teller;
  EXPECT_EQ(teller.update(status(0, "a worker"), Seconds{0}), "");
  EXPECT_EQ(teller.update(status(0, "a worker"), Seconds{1.9}), "");
  EXPECT_EQ(teller.update(status(0, "a worker"), Seconds{2}), "The study waits for a worker.");
  EXPECT_EQ(teller.update(status(0, "a worker"), Seconds{100}), "");
  EXPECT_EQ(teller.update(status(1), Seconds{101}), "The study goes on.");
  EXPECT_EQ(teller.update(status(2), Seconds{102}), "");
}

TEST(WatchTeller, SaysNothingOfAWaitThatIsSoonOver) {
  WatchTeller teller;
  EXPECT_EQ(teller.update(status(0, "a worker"), Seconds{0}), "");
  EXPECT_EQ(teller.update(status(0), Seconds{1}), "");
  EXPECT_EQ(teller.update(status(0, "a worker"), Seconds{2}), "");
  EXPECT_EQ(teller.update(status(0, "a worker"), Seconds{3.9}), "");
  EXPECT_EQ(teller.update(status(0), Seconds{4}), "");
}

TEST(WatchTeller, SaysThatTheReasonChanged) {
  WatchTeller teller;
  teller.update(status(0, "a worker"), Seconds{0});
  EXPECT_NE(teller.update(status(0, "a worker"), Seconds{3}), "");
  EXPECT_EQ(teller.update(status(0, "the database"), Seconds{4}), "");
  EXPECT_EQ(teller.update(status(0, "the database"), Seconds{6}),
            "The study waits for the database.");
}

TEST(WatchTeller, SaysOnceThatNothingIsSolvedForNoReasonThatIsKnown) {
  WatchTeller teller;
  EXPECT_EQ(teller.update(status(5), Seconds{0}), "");
  EXPECT_EQ(teller.update(status(5), Seconds{9.9}), "");
  const auto sentence = teller.update(status(5), Seconds{10});
  EXPECT_NE(sentence.find("Nothing was solved for 10 s"), std::string::npos) << sentence;
  EXPECT_EQ(teller.update(status(5), Seconds{30}), "");
  // A point later, the time counts anew.
  EXPECT_EQ(teller.update(status(6), Seconds{31}), "");
  EXPECT_EQ(teller.update(status(6), Seconds{40.9}), "");
  EXPECT_NE(teller.update(status(6), Seconds{41}), "");
}

TEST(WatchTeller, DoesNotCountTheTimeThatAStudyWaitsForAReasonItGave) {
  WatchTeller teller;
  teller.update(status(5, "a worker"), Seconds{0});
  EXPECT_NE(teller.update(status(5, "a worker"), Seconds{20}), "");
  EXPECT_EQ(teller.update(status(5), Seconds{21}), "The study goes on.");
  EXPECT_EQ(teller.update(status(5), Seconds{29.9}), "");
}

}  // namespace
}  // namespace oblique::client
