#include "client/output/progress.h"

#include <algorithm>
#include <cmath>
#include <string_view>
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

std::optional<double> seconds_left(const ProgressState& state) {
  if (!state.points_per_s || *state.points_per_s <= 0.0) {
    return std::nullopt;
  }
  return static_cast<double>(state.points - state.settled) / *state.points_per_s;
}

std::size_t characters_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char byte) {
    return (static_cast<unsigned char>(byte) & 0xc0U) != 0x80U;
  }));
}

std::string first_characters(std::string_view text, std::size_t count) {
  std::size_t bytes = 0;
  for (; count > 0 && bytes < text.size(); --count) {
    bytes += protocol::first_character(text.substr(bytes)).bytes;
  }
  return std::string(text.substr(0, bytes));
}

}  // namespace

std::string progress_bar(const ProgressState& state, std::size_t columns) {
  std::string end = fmt::format(" {}/{} {} %", shown_count(state.settled),
                                shown_count(state.points), percent(state));
  if (state.failed > 0) {
    end += fmt::format(", {} failed", shown_count(state.failed));
  }
  if (state.left_out > 0) {
    end += fmt::format(", {} left out", shown_count(state.left_out));
  }
  if (state.points_per_s) {
    end += fmt::format(", {} points/s", shown_rate(*state.points_per_s));
  }
  if (const auto left = seconds_left(state); left && state.settled < state.points) {
    end += fmt::format(", {} left", shown_duration(*left));
  }
  const std::string name = protocol::visible(state.study);
  constexpr std::size_t kWidest = 30;
  constexpr std::size_t kNarrowest = 4;
  const std::size_t around = characters_of(name) + std::string_view(" []").size() + end.size();
  const std::size_t room = columns > around ? columns - around : 0;
  if (room < kNarrowest) {
    return first_characters(name, columns > end.size() ? columns - end.size() : 0) +
           first_characters(end, columns);
  }
  const std::size_t width = std::min(kWidest, room);
  const double part = state.points == 0
                          ? 1.0
                          : static_cast<double>(state.settled) / static_cast<double>(state.points);
  const auto filled = std::min(width, static_cast<std::size_t>(part * static_cast<double>(width)));
  return fmt::format("{} [{:#<{}}{:-<{}}]{}", name, "", filled, "", width - filled, end);
}

std::string progress_line(const ProgressState& state) {
  std::string text =
      fmt::format("{}: {} of {} points ({} %)", protocol::visible(state.study),
                  shown_count(state.settled), shown_count(state.points), percent(state));
  if (state.failed > 0) {
    text += fmt::format(", {} of them failed", shown_count(state.failed));
  }
  if (state.left_out > 0) {
    text += fmt::format(", {} left out by where", shown_count(state.left_out));
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

void Progress::measure(const ProgressState& state) {
  // The rate of the last seconds: long enough to be steady, short enough to follow workers that
  // come and go.
  constexpr double kWindow_s = 10.0;
  // So long without an answer, where they came sooner before, and the server was away.
  constexpr double kAway_s = 5.0;
  if (!window_.empty()) {
    const double gap_s = state.elapsed_s - window_.back().first;
    if (gap_s > kAway_s && gap_s_ <= kAway_s) {
      window_.clear();
    }
    gap_s_ = gap_s;
  }
  window_.emplace_back(state.elapsed_s, state.settled);
  while (window_.size() > 2 && state.elapsed_s - window_[1].first > kWindow_s) {
    window_.pop_front();
  }
}

void Progress::update(ProgressState state) {
  measure(state);
  const auto [since_s, settled] = window_.front();
  if (state.settled > settled && state.elapsed_s > since_s) {
    state.points_per_s = static_cast<double>(state.settled - settled) / (state.elapsed_s - since_s);
  }
  last_ = std::move(state);
  if (last_->elapsed_s >= (on_terminal_ ? next_bar_s_ : next_line_s_)) {
    draw();
  }
}

void Progress::draw() {
  if (on_terminal_) {
    // The last column stays free: there some terminals go on in the next line.
    const std::size_t columns = std::max<std::size_t>(columns_(), 2) - 1;
    // Back to the first column, and what a longer line left behind cleared away.
    out_ << '\r' << progress_bar(*last_, columns) << "\x1b[K" << std::flush;
    constexpr double kBetweenBars_s = 0.1;
    next_bar_s_ = last_->elapsed_s + kBetweenBars_s;
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
