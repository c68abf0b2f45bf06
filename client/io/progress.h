#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "client/io/console.h"

namespace oblique::client {

/// How far a study is.
struct ProgressState {
  std::string study;
  std::uint64_t points = 0;
  std::uint64_t completed = 0;  ///< solved, failed or left out by a filter
  std::uint64_t failed = 0;
  std::uint64_t left_out = 0;
  double elapsed_s = 0.0;                   ///< since the watching began
  std::optional<double> points_per_s = {};  ///< unknown until a point was completed
};

/// "study [####----] 5/10 50 %, 3.1 points/s, 2 s left" in at most `columns` characters: where
/// there is little room the bar gets shorter, then the name.
std::string progress_bar(const ProgressState& state, std::size_t columns = 1000);

/// "study: 5 of 10 points (50 %), 3.1 points/s, 2 s left", for logs.
std::string progress_line(const ProgressState& state);

/// Draws the progress of one study on the console: a bar over itself on a terminal, else a plain
/// line every ten seconds. The caller gives the time.
class Progress {
 public:
  explicit Progress(Console& console)
      : console_(console), next_s_(console.can_redraw() ? 0.0 : 2.0) {}

  /// Draws the state if it is time to, ten times a second at most. `elapsed_s` must not fall; the
  /// rate of the last seconds is filled in here.
  void update(ProgressState state);

  /// Draws the last state, if there is one, a last time and ends the line.
  void finish();

 private:
  Console& console_;
  std::optional<ProgressState> last_;
  std::deque<std::pair<double, std::uint64_t>> window_;  ///< recent (elapsed_s, completed)
  double next_s_;                                        ///< when the next drawing is due
};

/// Shows what a long computation is doing, on a line of a terminal that is drawn over itself.
/// Nothing is left of the line once no part is under way. Without a terminal nothing is drawn.
class StatusLine {
 public:
  /// Describes a part. Called from another thread while the part is under way.
  using Describe = std::function<std::string()>;

  struct Settings {
    bool is_shown = true;                    ///< false: the terminal is used for other output
    std::chrono::milliseconds first{1000};   ///< computations that end sooner show nothing
    std::chrono::milliseconds between{200};  ///< between two drawings
  };

  /// `console` must outlive it; nothing else may write notes while a part is under way.
  explicit StatusLine(Console& console, Settings settings);
  explicit StatusLine(Console& console) : StatusLine(console, Settings()) {}
  ~StatusLine();
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  /// A part of the computation, under way until the last copy of this is destroyed.
  using Part = std::shared_ptr<void>;
  /// Begins a part. Parts are shown in the order in which they began. From any thread.
  [[nodiscard]] Part begin(Describe describe);
  [[nodiscard]] Part begin(std::string what);

  /// Writes a line that stays. From any thread.
  void print(const std::string& line);

 private:
  void draw_until(const std::stop_token& stop);
  void draw();
  void erase();
  void end(std::list<Describe>::iterator part);

  Console& console_;
  Settings settings_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::mutex mutex_;  ///< guards the parts, the console and the flag
  std::list<Describe> parts_;
  bool is_drawn_ = false;
  std::condition_variable_any stopped_;
  std::jthread drawer_;  ///< last: it uses all members above
};

}  // namespace oblique::client
