#include "client/output/progress.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

int percent(const ProgressState& state) {
  // Rounded down: 100 % is said of nothing unfinished.
  return state.points == 0 ? 100
                           : static_cast<int>(100.0 * static_cast<double>(state.settled) /
                                              static_cast<double>(state.points));
}

std::string shown_rate(double points_per_s) {
  return solver::readable_number(points_per_s, 3);
}

std::optional<double> seconds_left(const ProgressState& state) {
  if (!state.points_per_s || *state.points_per_s <= 0.0) {
    return std::nullopt;
  }
  return static_cast<double>(state.points - state.settled) / *state.points_per_s;
}

std::string two_units(std::int64_t large, const char* large_unit, std::int64_t small,
                      const char* small_unit) {
  return fmt::format("{} {} {:02} {}", large, large_unit, small, small_unit);
}

}  // namespace

std::string shown_duration(double seconds) {
  if (seconds < 9.95) {
    return fmt::format("{} s", solver::fixed_number(std::max(seconds, 0.0), 1));
  }
  constexpr double kLongest_s = 1e12;
  const auto whole = static_cast<std::int64_t>(std::llround(std::min(seconds, kLongest_s)));
  if (whole < 60) {
    return fmt::format("{} s", whole);
  }
  if (whole < 3600) {
    return two_units(whole / 60, "min", whole % 60, "s");
  }
  if (whole < 86400) {
    return two_units(whole / 3600, "h", whole % 3600 / 60, "min");
  }
  return two_units(whole / 86400, "d", whole % 86400 / 3600, "h");
}

std::string progress_bar(const ProgressState& state) {
  constexpr std::size_t kWidth = 30;
  const double part = state.points == 0
                          ? 1.0
                          : static_cast<double>(state.settled) / static_cast<double>(state.points);
  const auto filled = static_cast<std::size_t>(part * static_cast<double>(kWidth));
  std::string text =
      fmt::format("{} [{:#<{}}{:-<{}}] {}/{} {} %", protocol::visible(state.study), "", filled, "",
                  kWidth - filled, state.settled, state.points, percent(state));
  if (state.failed > 0) {
    text += fmt::format(", {} failed", state.failed);
  }
  if (state.points_per_s) {
    text += fmt::format(", {} points/s", shown_rate(*state.points_per_s));
  }
  if (const auto left = seconds_left(state); left && state.settled < state.points) {
    text += fmt::format(", {} left", shown_duration(*left));
  }
  return text;
}

std::string progress_line(const ProgressState& state) {
  std::string text = fmt::format("{}: {} of {} points ({} %)", protocol::visible(state.study),
                                 state.settled, state.points, percent(state));
  if (state.failed > 0) {
    text += fmt::format(", {} of them failed", state.failed);
  }
  if (state.points_per_s) {
    text += fmt::format(", {} points/s", shown_rate(*state.points_per_s));
  }
  if (state.settled == state.points) {
    text += fmt::format(", after {}", shown_duration(state.elapsed_s));
  } else if (const auto left = seconds_left(state)) {
    text += fmt::format(", {} left", shown_duration(*left));
  }
  return text;
}

void Progress::update(ProgressState state) {
  // The rate of the last seconds: long enough to be steady, short enough to follow workers that
  // come and go.
  constexpr double kWindow_s = 10.0;
  window_.emplace_back(state.elapsed_s, state.settled);
  while (window_.size() > 2 && state.elapsed_s - window_[1].first > kWindow_s) {
    window_.pop_front();
  }
  const auto [since_s, settled] = window_.front();
  if (state.settled > settled && state.elapsed_s > since_s) {
    state.points_per_s = static_cast<double>(state.settled - settled) / (state.elapsed_s - since_s);
  }
  last_ = std::move(state);
  if (on_terminal_ || last_->elapsed_s >= next_line_s_) {
    draw();
  }
}

void Progress::draw() {
  if (on_terminal_) {
    // Back to the first column, and what a longer line left behind cleared away.
    out_ << '\r' << progress_bar(*last_) << "\x1b[K" << std::flush;
    return;
  }
  out_ << progress_line(*last_) << std::endl;
  constexpr double kBetweenLines_s = 10.0;
  next_line_s_ = last_->elapsed_s + kBetweenLines_s;
}

void Progress::finish() {
  if (!last_) {
    return;
  }
  if (on_terminal_) {
    out_ << '\r' << "\x1b[K";
  }
  out_ << progress_line(*last_) << std::endl;
}

}  // namespace oblique::client
