#include "client/io/status_line.h"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using testing::Not;

constexpr StatusLine::Settings kAtOnce{.first = milliseconds(0), .between = milliseconds(1)};

class StatusLineTest : public testing::Test {
 protected:
  std::ostringstream out_;
  std::ostringstream err_;
  std::size_t columns_ = 80;
  Console terminal_{out_, err_, {.is_terminal = true, .columns = [this] { return columns_; }}};
};

/// A description of a part that counts how often it was drawn.
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
    while (drawn_ < 2) {  // the first drawing is complete by then
      std::this_thread::yield();
    }
  }

 private:
  std::string what_;
  std::atomic<int> drawn_{0};
};

/// What a terminal shows at the end of what was written to it.
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

TEST_F(StatusLineTest, ShowsThePartsUnderWayAndLeavesNothingBehind) {
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

TEST_F(StatusLineTest, IsNotDrawnWithoutATerminalNorWhereThatIsUsedOtherwise) {
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

TEST_F(StatusLineTest, LinesThatArePrintedStayAndAnEndedPartIsErasedAtOnce) {
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
