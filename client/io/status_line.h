#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "client/io/console.h"

namespace oblique::client {

/// Shows what a long computation is doing, on a line of a terminal that is drawn over itself.
/// Nothing is left of the line once no part is under way. Without a terminal nothing is drawn.
class StatusLine {
 public:
  /// Describes a part. Called from another thread while the part is under way.
  using Describe = std::function<std::string()>;

  struct Settings {
    bool is_shown = true;                    ///< false: the terminal is used for other output
    std::chrono::milliseconds first{1000};   ///< computations that end sooner show nothing
    std::chrono::milliseconds between{200};  ///< between two drawings
  };

  /// `console` must outlive it; nothing else may write notes while a part is under way.
  explicit StatusLine(Console& console, Settings settings);
  explicit StatusLine(Console& console) : StatusLine(console, Settings()) {}
  ~StatusLine();
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  /// A part of the computation, under way until the last copy of this is destroyed.
  using Part = std::shared_ptr<void>;
  /// Begins a part. Parts are shown in the order in which they began. From any thread.
  [[nodiscard]] Part begin(Describe describe);
  [[nodiscard]] Part begin(std::string what);

  /// Writes a line that stays. From any thread.
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
  std::jthread drawer_;  ///< last: it uses all members above
};

}  // namespace oblique::client
