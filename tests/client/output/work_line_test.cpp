#include "client/output/work_line.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <sstream>
#include <string>
#include <thread>

#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::Not;

WorkLineSettings at_once(std::size_t columns = 80) {
  return {.on_terminal = true,
          .columns = [columns] { return columns; },
          .first = std::chrono::milliseconds(0),
          .between = std::chrono::milliseconds(1)};
}

/// Tells, and knows how often it was asked.
class Teller {
 public:
  explicit Teller(std::string what) : what_(std::move(what)) {}
  WorkLine::HowFar how_far() {
    return [this] {
      ++asked_;
      return what_;
    };
  }
  void wait_until_asked() const {
    while (asked_ < 2) {  // what was told first has been drawn by then
      std::this_thread::yield();
    }
  }

 private:
  std::string what_;
  std::atomic<int> asked_{0};
};

/// What a terminal shows in the end of what was written to it.
std::string on_screen(const std::string& written) {
  std::string screen;
  std::string line;
  for (std::size_t i = 0; i < written.size(); ++i) {
    if (written[i] == '\n') {
      screen += line + '\n';
      line.clear();
    } else if (written[i] == '\r') {
      line.clear();  // every drawing begins with this, and clears the rest
    } else if (written.compare(i, 3, "\x1b[K") == 0) {
      i += 2;
    } else {
      line += written[i];
    }
  }
  return screen + line;
}

TEST(WorkLine, SaysWhatIsUnderWayAndLeavesNothingBehind) {
  std::ostringstream out;
  {
    WorkLine line(out, at_once());
    Teller fine("n = 32: fall 0.3 of 1.2 m");
    Teller coarse("n = 16: contact");
    const auto first = line.begin(fine.how_far());
    const auto second = line.begin(coarse.how_far());
    coarse.wait_until_asked();
  }
  EXPECT_THAT(out.str(), HasSubstr("\rn = 32: fall 0.3 of 1.2 m; n = 16: contact, "));
  EXPECT_EQ(on_screen(out.str()), "");
}

TEST(WorkLine, SaysNothingWhereThereIsNoTerminal) {
  std::ostringstream out;
  {
    auto settings = at_once();
    settings.on_terminal = false;
    WorkLine line(out, settings);
    const auto part = line.begin([]() -> std::string { throw std::logic_error("asked"); });
    line.tell("n = 4 solved");
  }
  EXPECT_EQ(out.str(), "n = 4 solved\n");
}

TEST(WorkLine, SaysNothingOfWhatDoesNotLast) {
  std::ostringstream out;
  {
    auto settings = at_once();
    settings.first = std::chrono::hours(1);
    WorkLine line(out, settings);
    const auto part = line.begin("contact");
  }
  EXPECT_EQ(out.str(), "");
}

TEST(WorkLine, StaysWithinTheTerminalsWidth) {
  std::ostringstream out;
  {
    WorkLine line(out, at_once(10));
    Teller teller("n = 32: fall 0.3 of 1.2 m");
    const auto part = line.begin(teller.how_far());
    teller.wait_until_asked();
  }
  EXPECT_THAT(out.str(), HasSubstr("\rn = 32: f\x1b[K"));
  EXPECT_THAT(out.str(), Not(HasSubstr("fall")));
}

TEST(WorkLine, LinesThatStayStandAlone) {
  std::ostringstream out;
  {
    WorkLine line(out, at_once());
    Teller teller("n = 32: contact");
    const auto part = line.begin(teller.how_far());
    teller.wait_until_asked();
    line.tell("n = 16 solved in 1.2 s");
  }
  EXPECT_EQ(on_screen(out.str()), "n = 16 solved in 1.2 s\n");
}

TEST(WorkLine, IsErasedAsSoonAsNothingIsUnderWay) {
  std::ostringstream out;
  WorkLine line(out, at_once());
  {
    Teller teller("contact");
    const auto part = line.begin(teller.how_far());
    teller.wait_until_asked();
  }
  line.tell("result");  // under the line's lock: nobody writes meanwhile
  EXPECT_EQ(on_screen(out.str()), "result\n");
}

TEST(WorkLine, AsksNothingOfAPartThatHasEnded) {
  std::ostringstream out;
  WorkLine line(out, at_once());
  auto ended = std::make_unique<Teller>("first");
  {
    const auto part = line.begin(ended->how_far());
    ended->wait_until_asked();
  }
  ended.reset();
  Teller teller("second");
  const auto part = line.begin(teller.how_far());
  teller.wait_until_asked();
}

TEST(WorkLineDeathTest, ASignalEndsTheProgramAndLeavesACleanLine) {
  const auto interrupted = [] {
    WorkLine line(std::cerr, at_once());
    Teller teller("falling");
    const auto part = line.begin(teller.how_far());
    teller.wait_until_asked();
    kill(getpid(), SIGINT);  // as a terminal does: to no thread in particular
    for (;;) {
      std::this_thread::yield();
    }
  };
  EXPECT_EXIT(interrupted(), testing::KilledBySignal(SIGINT),
              testing::AllOf(HasSubstr("falling"), testing::EndsWith("\r\x1b[K")));
}

TEST(WorkLine, NamesAFallByTheDropOfTheTip) {
  EXPECT_EQ(fall_so_far(solver::preset("paper"), 0.46312), "fall 0.463 of 1.2 m");
}

}  // namespace
}  // namespace oblique::client
