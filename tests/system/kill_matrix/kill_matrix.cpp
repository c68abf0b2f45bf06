#include "tests/system/kill_matrix/kill_matrix.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <mutex>
#include <thread>

namespace oblique::test {
namespace {

constexpr unsigned kAtOncePerCore = 4;

std::string blow_of(const KillCase& kill_case) {
  if (kill_case.storm) {
    return kill_case.point;
  }
  const std::string after = kill_case.then == SIGKILL ? "SIGSTOP and SIGKILL" : "SIGSTOP";
  return std::string(kill_case.all_in_one ? "oblique run: " : "apart: ") + kill_case.program +
         ", " + (kill_case.signal == SIGKILL ? "SIGKILL" : after);
}

}  // namespace

MatrixReport run_matrix(std::uint64_t first_seed, std::uint64_t count) {
  const KillStudy study;
  MatrixReport report;
  std::mutex mutex;
  std::atomic<std::uint64_t> next = first_seed;
  const auto work = [&] {
    for (std::uint64_t seed = next++; seed < first_seed + count; seed = next++) {
      const KillCase kill_case = draw_case(seed);
      const CycleOutcome outcome = run_cycle(study, kill_case);
      const std::lock_guard lock(mutex);
      ++report.cycles;
      report.not_struck += outcome.struck ? 0 : 1;
      if (outcome.struck) {
        ++report.blows[blow_of(kill_case)];
      }
      if (outcome.failure) {
        report.failures.push_back(describe(kill_case) + ": " + *outcome.failure);
      }
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 0; i < kAtOncePerCore * std::max(1U, std::thread::hardware_concurrency());
       ++i) {
    threads.emplace_back(work);
  }
  threads.clear();
  return report;
}

}  // namespace oblique::test
