#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <utility>

#include "client/output/human_units.h"

namespace oblique::client {

/// How far a study is.
struct ProgressState {
  std::string study;
  std::uint64_t points = 0;
  std::uint64_t settled = 0;  ///< solved, failed or left out by a filter
  std::uint64_t failed = 0;
  std::uint64_t left_out = 0;
  double elapsed_s = 0.0;                   ///< since the watching began
  std::optional<double> points_per_s = {};  ///< unknown until something moved
};

/// "study [####----] 5/10 50 % 3.1/s 2 s left", for a line that is drawn over itself, at most
/// `columns` characters wide: first the bar gets shorter, then the name.
std::string progress_bar(const ProgressState& state, std::size_t columns = 1000);

/// "study: 5 of 10 points (50 %), 3.1 points/s, 2 s left", for logs.
std::string progress_line(const ProgressState& state);

/// Draws the progress of one study: a bar over itself on a terminal, else a plain line now and
/// then. The clock is the caller's.
class Progress {
 public:
  /// How many characters a line of the terminal has; it may change meanwhile.
  using Columns = std::function<std::size_t()>;

  /// `out` must live as long; `on_terminal` says whether it may be drawn over, and `columns` how
  /// wide it is.
  Progress(
      std::ostream& out, bool on_terminal, Columns columns = [] { return std::size_t{80}; })
      : out_(out), on_terminal_(on_terminal), columns_(std::move(columns)) {}

  /// Takes in where the study is and draws it when it is time to, ten times a second at most.
  /// `elapsed_s` must not fall; the rate is filled in here. A time in which nobody answered is not
  /// part of it.
  void update(ProgressState state);

  /// Draws the last state, if there is one, a last time and ends the line.
  void finish();

 private:
  void measure(const ProgressState& state);
  void draw();

  std::ostream& out_;
  bool on_terminal_;
  Columns columns_;
  std::optional<ProgressState> last_;                    ///< none before the first
  std::deque<std::pair<double, std::uint64_t>> window_;  ///< (elapsed_s, settled) lately
  double gap_s_ = 0.0;                                   ///< between the last two updates
  double next_line_s_ = 2.0;
  double next_bar_s_ = 0.0;
};

}  // namespace oblique::client
