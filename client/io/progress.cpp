#include "client/io/progress.h"

#include <algorithm>
#include <ostream>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

double completed_part(const ProgressState& state) {
  return state.points == 0
             ? 1.0
             : static_cast<double>(state.completed) / static_cast<double>(state.points);
}

/// Percentage of completed points, rounded down so that an unfinished study never shows 100 %.
int percent(const ProgressState& state) {
  return state.points == 0 ? 100 : static_cast<int>(state.completed * 100 / state.points);
}

/// Returns ", 3.1 points/s, 2 s left". The time left is omitted once the study is finished.
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
  // The rate is an average over this time: long enough for a steady rate, and short enough to show
  // when workers come or go.
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
    console_.redraw(progress_bar(*last_, console_.columns()));
  } else {
    console_.notes() << progress_line(*last_) << std::endl;
  }
  // Time between drawings of the bar, or between lines.
  next_s_ = now_s + (console_.can_redraw() ? 0.1 : 10.0);
}

void Progress::finish() {
  if (last_) {
    console_.redraw("");
    console_.notes() << progress_line(*last_) << std::endl;
  }
}

StatusLine::StatusLine(Console& console, Settings settings)
    : console_(console), settings_(settings) {
  if (settings_.is_shown && console_.can_redraw()) {
    drawer_ = std::jthread([this](const std::stop_token& stop) { draw_until(stop); });
  }
}

StatusLine::~StatusLine() {
  drawer_ = std::jthread();  // stops the thread and waits for its end
  erase();
}

StatusLine::Part StatusLine::begin(Describe describe) {
  const std::lock_guard lock(mutex_);
  const auto part = parts_.insert(parts_.end(), std::move(describe));
  return {this, [part](StatusLine* line) { line->end(part); }};
}

StatusLine::Part StatusLine::begin(std::string what) {
  return begin(Describe([what = std::move(what)] { return what; }));
}

void StatusLine::end(std::list<Describe>::iterator part) {
  const std::lock_guard lock(mutex_);
  parts_.erase(part);
  if (parts_.empty()) {
    erase();  // the next output starts on an empty line
  }
}

void StatusLine::print(const std::string& line) {
  const std::lock_guard lock(mutex_);
  erase();
  console_.notes() << line << std::endl;
}

void StatusLine::draw_until(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  auto next = start_ + settings_.first;
  while (!stopped_.wait_until(lock, stop, next, [&stop] { return stop.stop_requested(); })) {
    draw();
    next = std::chrono::steady_clock::now() + settings_.between;
  }
}

void StatusLine::draw() {
  if (parts_.empty()) {
    erase();
    return;
  }
  std::string text;
  for (const auto& describe : parts_) {
    text += (text.empty() ? "" : "; ") + describe();
  }
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
  text += ", " + format_duration(elapsed.count());
  console_.redraw(protocol::shortened(text, console_.columns()));
  is_drawn_ = true;
}

void StatusLine::erase() {
  if (std::exchange(is_drawn_, false)) {
    console_.redraw("");
  }
}

}  // namespace oblique::client
