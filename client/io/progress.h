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

struct ProgressState {
  std::string study;
  std::uint64_t points = 0;
  std::uint64_t completed = 0;  ///< solved, failed or left out by a filter
  std::uint64_t failed = 0;
  std::uint64_t left_out = 0;
  double elapsed_s = 0.0;                   ///< since watching began
  std::optional<double> points_per_s = {};  ///< unknown until a point is completed
};

/// "study [####----] 5/10 50 %, 3.1 points/s, 2 s left" in at most `columns` characters. First the
/// bar is shortened, then the name.
std::string progress_bar(const ProgressState& state, std::size_t columns = 1000);

/// "study: 5 of 10 points (50 %), 3.1 points/s, 2 s left", for logs.
std::string progress_line(const ProgressState& state);

/// Draws the progress of one study on the console: a bar that is overwritten on a terminal, else a
/// line every ten seconds. The caller supplies the time.
class Progress {
 public:
  explicit Progress(Console& console)
      : console_(console), next_s_(console.can_redraw() ? 0.0 : 2.0) {}

  /// Draws the state, at most ten times a second. `elapsed_s` must not decrease. Fills in the rate
  /// of the last seconds.
  void update(ProgressState state);

  /// Draws the last state once more and ends the line.
  void finish();

 private:
  Console& console_;
  std::optional<ProgressState> last_;
  std::deque<std::pair<double, std::uint64_t>> window_;  ///< recent (elapsed_s, completed)
  double next_s_;                                        ///< time of the next drawing
};

/// Shows what a long computation does on one line of the terminal, which is overwritten and finally
/// erased. Without a terminal nothing is drawn.
class StatusLine {
 public:
  /// Returns the text of a part. Called from another thread while the part is active.
  using Describe = std::function<std::string()>;

  struct Settings {
    bool is_shown = true;                    ///< false: the terminal is used for other output
    std::chrono::milliseconds first{1000};   ///< shorter computations show nothing
    std::chrono::milliseconds between{200};  ///< interval of drawings
  };

  /// `console` must outlive it; nothing else may write notes while a part is active.
  explicit StatusLine(Console& console, Settings settings);
  explicit StatusLine(Console& console) : StatusLine(console, Settings()) {}
  ~StatusLine();
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  /// A part of the computation, active until the last copy of this is destroyed.
  using Part = std::shared_ptr<void>;
  /// Begins a part; parts are shown in the order of their beginning. From any thread.
  [[nodiscard]] Part begin(Describe describe);
  [[nodiscard]] Part begin(std::string what);

  /// Writes a line that is not overwritten. From any thread.
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
  std::jthread drawer_;  ///< last, because it uses all members above
};

}  // namespace oblique::client
