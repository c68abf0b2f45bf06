#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
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

}  // namespace oblique::client
