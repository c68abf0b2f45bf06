#include "client/verbs/doctor/solving_time.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <optional>
#include <stdexcept>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/solve.h"

namespace oblique::client::doctor {
namespace {

using Clock = std::chrono::steady_clock;

/// Of this thread: what others take of the machine does not count.
double cpu_time_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  constexpr double kNano = 1e-9;
  return static_cast<double>(time.tv_sec) + kNano * static_cast<double>(time.tv_nsec);
}

/// So much of a processor or, where others are at work, so much time by the clock.
class Budget {
 public:
  Budget(double cpu_s, std::chrono::milliseconds wall)
      : cpu_end_s_(cpu_time_s() + cpu_s), end_(Clock::now() + wall) {}
  bool is_spent() const { return cpu_time_s() >= cpu_end_s_ || Clock::now() >= end_; }

 private:
  double cpu_end_s_;
  Clock::time_point end_;
};

/// Points of a sweep over mu, all of the default model's fall to 1 m, in no order.
solver::PointRequest point_of(std::uint64_t number) {
  constexpr double kGolden = 0.6180339887498949;
  const double part = std::fmod(static_cast<double>(number) * kGolden, 1.0);
  return {number, 1.0, 0.1 + 1.9 * part, 0.5 + 0.5 * std::fmod(part * 7.0, 1.0)};
}

struct Timing {
  std::uint64_t cases = 0;
  double cpu_s = 0.0;
  double case_s() const { return cpu_s / static_cast<double>(std::max<std::uint64_t>(cases, 1)); }
};

Timing one_by_one(const solver::Finger& finger, const Budget& budget) {
  Timing timing;
  const double start_s = cpu_time_s();
  do {
    const auto point = point_of(timing.cases++);
    (void)finger.solve(point.H_m, point.mu, point.e_star);
  } while (!budget.is_spent());
  timing.cpu_s = cpu_time_s() - start_s;
  return timing;
}

Timing side_by_side(const solver::Finger& finger, const Budget& budget) {
  Timing timing;
  const double start_s = cpu_time_s();
  std::uint64_t next = 0;
  finger.solve_points(
      [&]() -> std::optional<solver::PointRequest> {
        return budget.is_spent() ? std::nullopt : std::optional(point_of(next++));
      },
      [&](solver::PointOutcome&& outcome) {
        if (!outcome.result) {
          throw std::runtime_error("a point of the default model has no answer: " + outcome.error);
        }
        ++timing.cases;
      });
  timing.cpu_s = cpu_time_s() - start_s;
  return timing;
}

/// On processors of 2023; see tests/bench/README.md.
double usual_case_s(const std::string& instruction_set) {
  return instruction_set == "avx512" ? 0.07e-3 : instruction_set == "avx2" ? 0.12e-3 : 0.30e-3;
}

}  // namespace

Findings examine_solver() {
  Findings found{"solver", "solver"};
  const double start_s = cpu_time_s();
  const auto start = Clock::now();
  const solver::Finger finger(solver::preset("paper"));
  (void)finger.solve(1.0, 0.4, 1.0);
  const double first_s = cpu_time_s() - start_s;
  const auto alone = one_by_one(finger, Budget(0.05, std::chrono::milliseconds(150)));
  const auto lanes = side_by_side(finger, Budget(0.15, std::chrono::milliseconds(400)));
  const double cpu_s = cpu_time_s() - start_s;
  const double wall_s = std::chrono::duration<double>(Clock::now() - start).count();

  const std::string set = solver::instruction_set();
  found.add("instruction_set", "kernel", set, set);
  found.add("first_case_s", "first case",
            fmt::format("{}, with its fall", shown_milliseconds(first_s)), first_s);
  found.add("case_alone_s", "one by one",
            fmt::format("{} a case", shown_milliseconds(alone.case_s())), alone.case_s());
  found.add("case_in_lanes_s", "in lanes",
            fmt::format("{} a case; usual with {}: {}", shown_milliseconds(lanes.case_s()), set,
                        shown_milliseconds(usual_case_s(set))),
            lanes.case_s());
  found.note("usual_case_in_lanes_s", usual_case_s(set));
  found.add("share_of_core", "share of a core", fmt::format("{:.0f} %", 100.0 * cpu_s / wall_s),
            cpu_s / wall_s);
  constexpr double kSlow = 3.0;
  if (lanes.case_s() > kSlow * usual_case_s(set)) {
    found.odd.push_back(fmt::format(
        "Cases take {:.0f} times as long as usual: the processor is old, throttled or shared with "
        "other machines, or the program was not built for speed.",
        lanes.case_s() / usual_case_s(set)));
  }
  if (set != "avx512" && set != "avx2") {
    found.odd.push_back(fmt::format(
        "The solver takes the kernel {}: with a processor that has AVX2 it would be more than "
        "twice as fast. In a virtual machine, the processor's own type shows it.",
        set));
  }
  return found;
}

}  // namespace oblique::client::doctor
