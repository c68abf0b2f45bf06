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
  std::uint64_t completed = 0;  ///< points that are solved, failed or filtered out
  std::uint64_t failed = 0;
  std::uint64_t left_out = 0;
  double elapsed_s = 0.0;                   ///< time since watching began
  std::optional<double> points_per_s = {};  ///< unknown until a point is completed
};

/// Returns "study [####----] 5/10 50 %, 3.1 points/s, 2 s left" in at most `columns` characters. To
/// fit, it first shortens the bar, then the name.
std::string progress_bar(const ProgressState& state, std::size_t columns = 1000);

/// Returns "study: 5 of 10 points (50 %), 3.1 points/s, 2 s left", a line for logs.
std::string progress_line(const ProgressState& state);

/// Shows the progress of one study on the console. On a terminal it redraws a bar; otherwise it
/// prints a line every ten seconds. The caller supplies the time.
class Progress {
 public:
  explicit Progress(Console& console)
      : console_(console), next_s_(console.can_redraw() ? 0.0 : 2.0) {}

  /// Draws the state and rate, at most ten times a second. `elapsed_s` must not decrease.
  void update(ProgressState state);

  /// Draws the last state once more and ends the line.
  void finish();

 private:
  Console& console_;
  std::optional<ProgressState> last_;
  std::deque<std::pair<double, std::uint64_t>> window_;  ///< recent (elapsed_s, completed)
  double next_s_;                                        ///< elapsed time at which to draw next
};

/// Shows the status of a long computation on one line of the terminal, overwrites it with each
/// change, and erases it at the end. Without a terminal it shows nothing.
class StatusLine {
 public:
  /// Returns the text that describes a part. It is called on another thread.
  using Describe = std::function<std::string()>;

  struct Settings {
    bool is_shown = true;                    ///< false if the terminal is used for other output
    std::chrono::milliseconds first{1000};   ///< delay before the line appears
    std::chrono::milliseconds between{200};  ///< interval of drawings
  };

  /// `console` must outlive this object. While a part is active, nothing else may write notes.
  explicit StatusLine(Console& console, Settings settings);
  explicit StatusLine(Console& console) : StatusLine(console, Settings()) {}
  ~StatusLine();
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  /// A part of the computation. It is active until the last copy of this pointer is destroyed.
  using Part = std::shared_ptr<void>;
  /// Begins a part. The line shows parts in the order in which they began. Thread-safe.
  [[nodiscard]] Part begin(Describe describe);
  [[nodiscard]] Part begin(std::string what);

  /// Writes a permanent line above the status line. Thread-safe.
  void print(const std::string& line);

 private:
  void draw_until(const std::stop_token& stop);
  void draw();
  void erase();
  void end(std::list<Describe>::iterator part);

  Console& console_;
  Settings settings_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::mutex mutex_;  ///< guards parts_, console_ and is_drawn_
  std::list<Describe> parts_;
  bool is_drawn_ = false;
  std::condition_variable_any stopped_;
  std::jthread drawer_;  ///< declared last: its thread uses all members above
};

}  // namespace oblique::client
