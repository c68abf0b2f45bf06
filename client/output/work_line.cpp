#include "client/output/work_line.h"

#include <poll.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <numeric>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/output/progress.h"
#include "proto/program/process.h"
#include "proto/system/descriptor.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::milliseconds;

// As if nobody had watched for the signal.
void end_by(int signal) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, signal);
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
  static_cast<void>(std::raise(signal));
}

}  // namespace

std::string fall_so_far(const solver::ModelParameters& model, double drop_m) {
  const double length_m = std::accumulate(model.lengths_m.begin(), model.lengths_m.end(), 0.0);
  return fmt::format("fall {} of {} m", solver::readable_number(drop_m, 3),
                     solver::readable_number(length_m, 3));
}

/// Draws now and then, and ends the program when a signal comes, with nothing left on the line.
class WorkLine::Watch {
 public:
  explicit Watch(WorkLine& line) : line_(line), thread_([this] { run(); }) {}
  ~Watch() {
    over_.wake();
    thread_.join();
    heed_signal();  // one that came since
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

 private:
  void run() {
    auto next = line_.start_ + line_.settings_.first;
    for (;;) {
      pollfd items[]{{stop_.descriptor(), POLLIN, 0}, {over_.descriptor(), POLLIN, 0}};
      const auto left = std::chrono::ceil<Milliseconds>(next - Clock::now()).count();
      static_cast<void>(
          poll(items, std::size(items),
               static_cast<int>(std::clamp<std::int64_t>(left, 0, line_.settings_.first.count()))));
      if (items[1].revents != 0) {
        return;
      }
      heed_signal();
      if (Clock::now() >= next) {
        const std::lock_guard lock(line_.mutex_);
        line_.draw();
        next = Clock::now() + line_.settings_.between;
      }
    }
  }
  void heed_signal() {
    if (stop_.requested()) {
      const std::lock_guard lock(line_.mutex_);  // for good: nobody draws any more
      line_.erase();
      end_by(stop_.exit_code() - 128);
    }
  }

  WorkLine& line_;
  protocol::StopSignals stop_;
  protocol::WakeUp over_;
  std::thread thread_;  // last: it uses what stands above
};

WorkLine::WorkLine(std::ostream& out, WorkLineSettings settings)
    : out_(out), settings_(std::move(settings)) {
  if (settings_.on_terminal) {
    watch_ = std::make_unique<Watch>(*this);
  }
}

WorkLine::~WorkLine() {
  watch_.reset();
  erase();
}

WorkLine::Part::Part(Part&& other) noexcept
    : line_(std::exchange(other.line_, nullptr)), place_(other.place_) {}

WorkLine::Part::~Part() {
  if (line_ != nullptr) {
    const std::lock_guard lock(line_->mutex_);
    line_->parts_.erase(place_);
    if (line_->parts_.empty()) {
      line_->erase();  // what is printed next finds an empty line
    }
  }
}

WorkLine::Part WorkLine::begin(HowFar how_far) {
  const std::lock_guard lock(mutex_);
  return {*this, parts_.insert(parts_.end(), std::move(how_far))};
}

WorkLine::Part WorkLine::begin(std::string what) {
  return begin(HowFar([what = std::move(what)] { return what; }));
}

void WorkLine::tell(const std::string& line) {
  const std::lock_guard lock(mutex_);
  erase();
  out_ << line << std::endl;
}

void WorkLine::draw() {
  if (parts_.empty()) {
    erase();
    return;
  }
  std::string text;
  for (const auto& how_far : parts_) {
    text += (text.empty() ? "" : "; ") + how_far();
  }
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count();
  text += ", " + shown_duration(elapsed_s);
  // The last column stays free: there some terminals go on in the next line.
  text.resize(std::min(text.size(), std::max<std::size_t>(settings_.columns(), 2) - 1));
  out_ << '\r' + text + "\x1b[K" << std::flush;
  is_drawn_ = true;
}

void WorkLine::erase() {
  if (std::exchange(is_drawn_, false)) {
    out_ << "\r\x1b[K" << std::flush;
  }
}

}  // namespace oblique::client
