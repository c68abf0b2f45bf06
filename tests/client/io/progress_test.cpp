#include "client/io/progress.h"

#include <algorithm>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

TEST(Progress, ShowsRateAndTimeLeftInTheBar) {
  EXPECT_EQ(progress_bar({.study = "paper",
                          .points = 10,
                          .completed = 5,
                          .failed = 1,
                          .elapsed_s = 1.0,
                          .points_per_s = 2.0}),
            "paper [###############---------------] 5/10 50 %, 1 failed, 2 points/s, 2.5 s left");
}

TEST(Progress, SaysNothingOfARateThatIsNotKnown) {
  EXPECT_EQ(progress_line({.study = "paper", .points = 10}), "paper: 0 of 10 points (0 %)");
}

TEST(Progress, NeverCallsAnUnfinishedStudyFinished) {
  EXPECT_NE(progress_line({.study = "s", .points = 100000, .completed = 99999}).find("(99 %)"),
            std::string::npos);
}

TEST(Progress, DrawsPlainLinesNowAndThenWhereThereIsNoTerminal) {
  std::ostringstream out;
  Console console(out, out);
  Progress progress(console);
  for (int i = 0; i <= 300; ++i) {
    progress.update({.study = "s",
                     .points = 1000,
                     .completed = static_cast<std::uint64_t>(i),
                     .elapsed_s = 0.1 * i});
  }
  progress.finish();
  const auto text = out.str();
  EXPECT_EQ(text.find('\r'), std::string::npos);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  const auto lines = std::count(text.begin(), text.end(), '\n');
  EXPECT_GE(lines, 3);
  EXPECT_LE(lines, 5);
  EXPECT_NE(text.find("10 points/s, 1 min 10 s left"), std::string::npos) << text;
}

TEST(Progress, FollowsTheRateOfTheLastSeconds) {
  std::ostringstream out;
  Console console(out, out, {.is_terminal = true});
  Progress progress(console);
  // 100 points a second for ten seconds, then 1 a second for a minute.
  for (int second = 0; second <= 70; ++second) {
    const int settled = second <= 10 ? 100 * second : 1000 + (second - 10);
    progress.update({.study = "s",
                     .points = 5000,
                     .completed = static_cast<std::uint64_t>(settled),
                     .elapsed_s = static_cast<double>(second)});
  }
  const auto text = out.str();
  EXPECT_NE(text.substr(text.rfind('\r')).find(" 1 points/s"), std::string::npos);
}

TEST(Progress, WeighsSamplesByTheTimeBetweenThem) {
  std::ostringstream out;
  Console console(out, out, {.is_terminal = true});
  Progress progress(console);
  const auto update = [&progress](double elapsed_s, std::uint64_t settled) {
    progress.update({.study = "s", .points = 5000, .completed = settled, .elapsed_s = elapsed_s});
  };
  const auto last_bar = [&out] {
    const auto text = out.str();
    return text.substr(text.rfind('\r'));
  };
  // A burst of looks, then one 4 s later: 400 points in 5 s, however many looks there were.
  for (int i = 0; i <= 100; ++i) {
    update(0.01 * i, static_cast<std::uint64_t>(i));
  }
  update(5.0, 400);
  EXPECT_NE(last_bar().find(" 80 points/s"), std::string::npos) << last_bar();
}

TEST(Progress, LeavesOutTheTimeThatAServerWasAwayAndSaysNoRateUntilSomethingHasCome) {
  std::ostringstream out;
  Console console(out, out, {.is_terminal = true});
  Progress progress(console);
  const auto bar_after = [&](double elapsed_s, std::uint64_t settled) {
    progress.update({.study = "s", .points = 5000, .completed = settled, .elapsed_s = elapsed_s});
    const auto text = out.str();
    return text.substr(text.rfind('\r'));
  };
  bar_after(0.0, 0);
  EXPECT_NE(bar_after(0.5, 50).find(" 100 points/s"), std::string::npos);
  EXPECT_EQ(bar_after(600.0, 51).find("points/s"), std::string::npos);
  EXPECT_EQ(bar_after(600.5, 51).find("left"), std::string::npos);
  const auto bar = bar_after(601.0, 151);
  EXPECT_NE(bar.find(" 100 points/s, 48 s left"), std::string::npos) << bar;
}

TEST(Progress, KnowsARateWhereEveryAnswerTakesLong) {
  std::ostringstream out;
  Console console(out, out, {.is_terminal = true});
  Progress progress(console);
  for (int i = 0; i <= 3; ++i) {
    progress.update({.study = "s",
                     .points = 5000,
                     .completed = static_cast<std::uint64_t>(200 * i),
                     .elapsed_s = 20.0 * i});
  }
  const auto text = out.str();
  EXPECT_NE(text.substr(text.rfind('\r')).find(" 10 points/s"), std::string::npos) << text;
}

TEST(Progress, KeepsToTheWidthOfTheTerminalTheBarFirst) {
  const ProgressState state{.study = "abc\u00e9",
                            .points = 1'000'000,
                            .completed = 500'000,
                            .failed = 12,
                            .points_per_s = 1234.5};
  const std::string end = " 500,000/1,000,000 50 %, 12 failed, 1,230 points/s, 6 min 45 s left";
  EXPECT_EQ(progress_bar(state, 79), "abc\u00e9 [##---]" + end);
  EXPECT_EQ(progress_bar(state, end.size() + 10), "abc\u00e9" + end) << "a bar too short to read";
  EXPECT_EQ(progress_bar(state, end.size() + 3), "abc" + end);
  EXPECT_EQ(progress_bar(state, 10), end.substr(0, 10));
  EXPECT_EQ(progress_bar(state, 0), "");
}

TEST(Progress, IsDrawnTenTimesASecondAtMostAndAsWideAsTheTerminalIsThen) {
  std::ostringstream out;
  std::size_t columns = 80;
  Console console(out, out, {.is_terminal = true, .columns = [&columns] { return columns; }});
  Progress progress(console);
  for (int i = 0; i < 1000; ++i) {
    columns = i < 500 ? 80 : 20;
    progress.update({.study = "s", .points = 10, .completed = 5, .elapsed_s = 0.001 * i});
  }
  const auto text = out.str();
  const auto drawn = std::count(text.begin(), text.end(), '\r');
  EXPECT_GE(drawn, 9);
  EXPECT_LE(drawn, 11);
  EXPECT_LE(text.size() - text.rfind('\r'), 19U + std::string("\r\x1b[K").size());
}

TEST(Progress, ShowsTheNameOfAStudyWithoutSteeringTheTerminal) {
  EXPECT_TRUE(progress_line({.study = "a\x1b[2J", .points = 1}).starts_with("a\\x1b[2J: "));
  EXPECT_TRUE(progress_bar({.study = "a\u202e", .points = 1}).starts_with("a\\u202e ["));
}

TEST(Progress, ThatNeverBeganHasNothingToDrawAtItsEnd) {
  std::ostringstream out;
  Console console(out, out);
  Progress(console).finish();
  EXPECT_EQ(out.str(), "");
}

}  // namespace
}  // namespace oblique::client
