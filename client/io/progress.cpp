#include "client/io/progress.h"

#include <algorithm>
#include <ostream>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/format_units.h"
#include "client/io/row_output.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

double completed_part(const ProgressState& state) {
  return state.points == 0
             ? 1.0
             : static_cast<double>(state.completed) / static_cast<double>(state.points);
}

/// Rounded down: an unfinished study never shows 100 %.
int percent(const ProgressState& state) {
  return state.points == 0 ? 100 : static_cast<int>(state.completed * 100 / state.points);
}

/// ", 3.1 points/s, 2 s left"; the time only of an unfinished study.
std::string rate_and_time_left(const ProgressState& state) {
  if (!state.points_per_s) {
    return {};
  }
  std::string text = fmt::format(", {} points/s", format_rate(*state.points_per_s));
  if (*state.points_per_s > 0.0 && state.completed < state.points) {
    const auto open = static_cast<double>(state.points - state.completed);
    text += fmt::format(", {} left", format_duration(open / *state.points_per_s));
  }
  return text;
}

}  // namespace

std::string progress_bar(const ProgressState& state, std::size_t columns) {
  std::string end = fmt::format(" {}/{} {} %", format_count(state.completed),
                                format_count(state.points), percent(state));
  end += state.failed > 0 ? fmt::format(", {} failed", format_count(state.failed)) : "";
  end += state.left_out > 0 ? fmt::format(", {} left out", format_count(state.left_out)) : "";
  end += rate_and_time_left(state);
  const std::string name = protocol::visible(state.study);
  constexpr std::size_t kWidest = 30;
  constexpr std::size_t kNarrowest = 4;
  const std::size_t around = width_of(name) + std::string_view(" []").size() + end.size();
  if (columns < around + kNarrowest) {
    return protocol::shortened(name, columns > end.size() ? columns - end.size() : 0) +
           protocol::shortened(end, columns);
  }
  const std::size_t width = std::min(kWidest, columns - around);
  const auto filled = static_cast<std::size_t>(completed_part(state) * static_cast<double>(width));
  return fmt::format("{} [{:#<{}}{:-<{}}]{}", name, "", filled, "", width - filled, end);
}

std::string progress_line(const ProgressState& state) {
  std::string text =
      fmt::format("{}: {} of {} points ({} %)", protocol::visible(state.study),
                  format_count(state.completed), format_count(state.points), percent(state));
  text += state.failed > 0 ? fmt::format(", {} of them failed", format_count(state.failed)) : "";
  text +=
      state.left_out > 0 ? fmt::format(", {} left out by where", format_count(state.left_out)) : "";
  text += rate_and_time_left(state);
  text += state.completed == state.points
              ? fmt::format(", after {}", format_duration(state.elapsed_s))
              : "";
  return text;
}

void Progress::update(ProgressState state) {
  // The rate of the last seconds: long enough to be steady, short enough to follow workers that
  // come and go.
  constexpr double kWindow_s = 10.0;
  const double now_s = state.elapsed_s;
  window_.emplace_back(now_s, state.completed);
  while (window_.size() > 2 && now_s - window_[1].first > kWindow_s) {
    window_.pop_front();
  }
  const auto& [since_s, completed] = window_.front();
  if (state.completed > completed && now_s > since_s) {
    state.points_per_s = static_cast<double>(state.completed - completed) / (now_s - since_s);
  }
  last_ = std::move(state);
  if (now_s < next_s_) {
    return;
  }
  if (console_.can_redraw()) {
    // The last column stays free: some terminals wrap the line there.
    const std::size_t columns = std::max<std::size_t>(console_.columns(), 2) - 1;
    console_.notes() << '\r' << progress_bar(*last_, columns) << "\x1b[K" << std::flush;
  } else {
    console_.notes() << progress_line(*last_) << std::endl;
  }
  constexpr double kBetweenBars_s = 0.1;
  constexpr double kBetweenLines_s = 10.0;
  next_s_ = now_s + (console_.can_redraw() ? kBetweenBars_s : kBetweenLines_s);
}

void Progress::finish() {
  if (last_) {
    console_.notes() << (console_.can_redraw() ? "\r\x1b[K" : "") << progress_line(*last_)
                     << std::endl;
  }
}

}  // namespace oblique::client
