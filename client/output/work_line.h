#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <iostream>
#include <list>
#include <memory>
#include <mutex>
#include <ostream>
#include <string>
#include <thread>

#include "client/output/terminal.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// "fall 0.463 of 1.2 m", of a fall in which the tip has dropped drop_m: it turns back near the
/// length of the chain.
std::string fall_so_far(const solver::ModelParameters& model, double drop_m);

/// When and where a WorkLine is drawn.
struct WorkLineSettings {
  bool on_terminal = draws_on_terminal();
  std::function<std::size_t()> columns = terminal_columns;
  std::chrono::milliseconds first{1000};   ///< what lasts less is not worth a line
  std::chrono::milliseconds between{200};  ///< two drawings
};

/// Says what a long computation is at, on a line of a terminal that is drawn over itself, once it
/// has lasted a second. Nothing of it is left when no part is under way any more, nor when a signal
/// ends the program. Says nothing where there is no terminal.
class WorkLine {
 public:
  /// Called from another thread, now and then.
  using HowFar = std::function<std::string()>;

  /// `out` must live as long. Make it before any thread is started: for a signal to leave a clean
  /// line, other threads must have it blocked.
  explicit WorkLine(std::ostream& out = std::cerr, WorkLineSettings settings = {});
  ~WorkLine();
  WorkLine(const WorkLine&) = delete;
  WorkLine& operator=(const WorkLine&) = delete;

  /// Something under way for as long as it lives.
  class Part {
   public:
    Part(Part&& other) noexcept;
    Part& operator=(Part&&) = delete;
    ~Part();

   private:
    friend class WorkLine;
    Part(WorkLine& line, std::list<HowFar>::iterator place) : line_(&line), place_(place) {}
    WorkLine* line_;
    std::list<HowFar>::iterator place_;
  };
  /// Begins a part, of which `how_far` tells; it is not called once the part has ended. Parts under
  /// way are shown in the order in which they began. From any thread.
  [[nodiscard]] Part begin(HowFar how_far);
  [[nodiscard]] Part begin(std::string what);

  /// Writes a line that stays. From any thread.
  void tell(const std::string& line);

 private:
  class Watch;
  void draw();
  void erase();

  std::ostream& out_;
  WorkLineSettings settings_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::mutex mutex_;  ///< of what follows, and of out_
  std::list<HowFar> parts_;
  bool is_drawn_ = false;
  std::unique_ptr<Watch> watch_;  ///< draws; only on a terminal
};

}  // namespace oblique::client
