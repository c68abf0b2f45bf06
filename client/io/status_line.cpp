#include "client/io/status_line.h"

#include <algorithm>
#include <cstddef>
#include <ostream>
#include <utility>

#include "client/io/format_units.h"

namespace oblique::client {

StatusLine::StatusLine(Console& console, Settings settings)
    : console_(console), settings_(settings) {
  if (settings_.is_shown && console_.can_redraw()) {
    drawer_ = std::jthread([this](const std::stop_token& stop) { draw_until(stop); });
  }
}

StatusLine::~StatusLine() {
  drawer_ = std::jthread();  // stops and joins
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
  // The last column stays free: some terminals wrap the line there.
  text.resize(std::min(text.size(), std::max<std::size_t>(console_.columns(), 2) - 1));
  console_.notes() << '\r' + text + "\x1b[K" << std::flush;
  is_drawn_ = true;
}

void StatusLine::erase() {
  if (std::exchange(is_drawn_, false)) {
    console_.notes() << "\r\x1b[K" << std::flush;
  }
}

}  // namespace oblique::client
