#include "client/io/progress.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Progress, ShowsRateAndTimeLeftInTheBar) {
  EXPECT_EQ(progress_bar({.study = "paper",
                          .points = 10,
                          .completed = 5,
                          .failed = 1,
                          .elapsed_s = 1.0,
                          .points_per_s = 2.0}),
            "paper [###############---------------] 5/10 50 %, 1 failed, 2 points/s, 2.5 s left");
}

TEST(Progress, HidesAnUnknownRateAndStaysBelow100PercentUntilTheEnd) {
  EXPECT_THAT(progress_line({.study = "s", .points = 100000, .completed = 99999}),
              HasSubstr("(99 %)"));
  EXPECT_EQ(progress_line({.study = "paper", .points = 10}), "paper: 0 of 10 points (0 %)");
}

TEST(Progress, DrawsPlainLinesWithoutATerminal) {
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

/// The progress bar of a study of 5000 points on a terminal.
class Drawn {
 public:
  /// Updates the bar and returns its text.
  std::string at(double elapsed_s, std::uint64_t completed) {
    progress_.update(
        {.study = "s", .points = 5000, .completed = completed, .elapsed_s = elapsed_s});
    const auto text = out_.str();
    return text.substr(text.rfind('\r'));
  }

 private:
  std::ostringstream out_;
  Console console_{out_, out_, {.is_terminal = true}};
  Progress progress_{console_};
};

TEST(Progress, FollowsTheRateOfTheLastSeconds) {
  Drawn bar;
  for (std::uint64_t second = 0; second <= 10; ++second) {
    bar.at(static_cast<double>(second), 100 * second);
  }
  for (std::uint64_t second = 11; second < 70; ++second) {
    bar.at(static_cast<double>(second), 990 + second);
  }
  EXPECT_THAT(bar.at(70.0, 1060), HasSubstr(" 1 points/s"));
  bar.at(600.0, 1061);  // the server was unreachable for 530 s
  bar.at(605.0, 1561);
  EXPECT_THAT(bar.at(611.0, 2161), HasSubstr(" 100 points/s, 28 s left"));
}

TEST(Progress, ShortensTheBarFirstToFitTheTerminal) {
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

TEST(Progress, IsDrawnAtMostTenTimesASecondInTheCurrentWidthOfTheTerminal) {
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

TEST(Progress, EscapesControlCodesInTheNameOfAStudy) {
  EXPECT_TRUE(progress_line({.study = "a\x1b[2J", .points = 1}).starts_with("a\\x1b[2J: "));
  EXPECT_TRUE(progress_bar({.study = "a\u202e", .points = 1}).starts_with("a\\u202e ["));
}

using std::chrono::milliseconds;

constexpr StatusLine::Settings kAtOnce{.first = milliseconds(0), .between = milliseconds(1)};

class StatusLineTest : public testing::Test {
 protected:
  std::ostringstream out_;
  std::ostringstream err_;
  std::size_t columns_ = 80;
  Console terminal_{out_, err_, {.is_terminal = true, .columns = [this] { return columns_; }}};
};

/// A description that counts how often it is drawn.
class Description {
 public:
  explicit Description(std::string what) : what_(std::move(what)) {}
  StatusLine::Describe describe() {
    return [this] {
      ++drawn_;
      return what_;
    };
  }
  void wait_until_drawn() const {
    while (drawn_ < 2) {  // the second drawing starts after the first is complete
      std::this_thread::yield();
    }
  }

 private:
  std::string what_;
  std::atomic<int> drawn_{0};
};

/// Returns the text on a terminal after the output `written`.
std::string on_screen(const std::string& written) {
  std::string screen;
  std::string line;
  for (std::size_t i = 0; i < written.size(); ++i) {
    if (written[i] == '\n') {
      screen += line + '\n';
      line.clear();
    } else if (written[i] == '\r') {
      line.clear();  // each drawing begins with \r and erases the rest of the line
    } else if (written.compare(i, 3, "\x1b[K") == 0) {
      i += 2;
    } else {
      line += written[i];
    }
  }
  return screen + line;
}

TEST_F(StatusLineTest, ShowsActivePartsAndErasesItself) {
  {
    StatusLine line(terminal_, kAtOnce);
    Description fine("n = 32: fall 0.3 of 1.2 m");
    Description coarse("n = 16: contact");
    const auto first = line.begin(fine.describe());
    const auto second = line.begin(coarse.describe());
    coarse.wait_until_drawn();
  }
  EXPECT_THAT(err_.str(), HasSubstr("\rn = 32: fall 0.3 of 1.2 m; n = 16: contact, "));
  EXPECT_EQ(on_screen(err_.str()), "");
  EXPECT_EQ(out_.str(), "");
}

TEST_F(StatusLineTest, IsNotDrawnInAFileOrIfHidden) {
  Console file(out_, err_);
  const auto refuse = []() -> std::string { throw std::logic_error("drawn"); };
  {
    StatusLine line(file, kAtOnce);
    const auto part = line.begin(refuse);
    line.print("n = 4 solved");
  }
  EXPECT_EQ(err_.str(), "n = 4 solved\n");
  {
    StatusLine line(terminal_,
                    {.is_shown = false, .first = milliseconds(0), .between = milliseconds(1)});
    const auto part = line.begin(refuse);
  }
  {
    StatusLine line(terminal_, {.first = std::chrono::hours(1)});
    const auto part = line.begin(refuse);
  }
  EXPECT_EQ(err_.str(), "n = 4 solved\n");
}

TEST_F(StatusLineTest, StaysWithinTheTerminalsWidth) {
  columns_ = 10;
  {
    StatusLine line(terminal_, kAtOnce);
    Description contact("n = 32: fall 0.3 of 1.2 m");
    const auto part = line.begin(contact.describe());
    contact.wait_until_drawn();
  }
  EXPECT_THAT(err_.str(), HasSubstr("\rn = 32: f\x1b[K"));
  EXPECT_THAT(err_.str(), Not(HasSubstr("fall")));
}

TEST_F(StatusLineTest, KeepsPrintedLinesAndErasesAnEndedPartAtOnce) {
  StatusLine line(terminal_, kAtOnce);
  {
    Description contact("n = 32: contact");
    const auto part = line.begin(contact.describe());
    contact.wait_until_drawn();
    line.print("n = 16 solved in 1.2 s");
  }
  line.print("result");
  EXPECT_EQ(on_screen(err_.str()), "n = 16 solved in 1.2 s\nresult\n");
}

}  // namespace
}  // namespace oblique::client
