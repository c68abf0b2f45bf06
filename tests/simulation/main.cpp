// simulate FIRST COUNT [killers | storms | forgetful]: runs that many seeds, on all cores, and
// names those that fail.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

#include "tests/simulation/simulation.h"

namespace {

using oblique::simulation::simulate;
using oblique::simulation::SimulationOutcome;
using oblique::simulation::SimulationSettings;

/// Seeds between two reports of a process.
constexpr std::uint64_t kSeedsPerReport = 20;
constexpr std::chrono::seconds kBetweenLines{10};

struct Seeds {
  std::uint64_t first;
  std::uint64_t count;
};

/// What a process says through a pipe; fewer bytes than a pipe takes at once.
struct Report {
  SimulationOutcome outcome;
  std::uint64_t seeds = 0;
  std::uint64_t failures = 0;
};

/// Runs every `step`-th seed and reports to `pipe`.
void run_some(Seeds seeds, std::uint64_t begin, std::uint64_t step,
              const SimulationSettings& settings, int pipe) {
  Report report;
  const auto send = [&] {
    if (::write(pipe, &report, sizeof report) != static_cast<ssize_t>(sizeof report)) {
      throw std::runtime_error("nobody listens any more");
    }
    report = {};
  };
  for (std::uint64_t i = begin; i < seeds.count; i += step) {
    try {
      report.outcome += simulate(seeds.first + i, settings);
    } catch (const std::exception& error) {
      ++report.failures;
      // One write, so that lines of several processes do not mix.
      std::cout << "seed " + std::to_string(seeds.first + i) + ": " + error.what() + "\n"
                << std::flush;
    }
    if (++report.seeds == kSeedsPerReport) {
      send();
    }
  }
  send();
}

/// SQLite and the simulated files have state of the process, so that each core gets a process.
std::vector<pid_t> start_processes(Seeds seeds, const SimulationSettings& settings,
                                   const int (&pipe)[2]) {
  const std::uint64_t count =
      std::clamp<std::uint64_t>(seeds.count, 1, std::max(1U, std::thread::hardware_concurrency()));
  std::vector<pid_t> processes;
  for (std::uint64_t i = 0; i < count; ++i) {
    const pid_t process = ::fork();
    if (process < 0) {
      throw std::runtime_error("cannot start another process");
    }
    if (process == 0) {
      ::close(pipe[0]);
      run_some(seeds, i, count, settings, pipe[1]);
      std::exit(0);
    }
    processes.push_back(process);
  }
  return processes;
}

Report run(Seeds seeds, const SimulationSettings& settings) {
  int pipe[2] = {};
  if (::pipe(pipe) != 0) {
    throw std::runtime_error("cannot make a pipe");
  }
  const auto processes = start_processes(seeds, settings, pipe);
  ::close(pipe[1]);
  Report all;
  Report some;
  auto last_line = std::chrono::steady_clock::now();
  while (::read(pipe[0], &some, sizeof some) == static_cast<ssize_t>(sizeof some)) {
    all.outcome += some.outcome;
    all.seeds += some.seeds;
    all.failures += some.failures;
    if (std::chrono::steady_clock::now() - last_line > kBetweenLines) {
      last_line = std::chrono::steady_clock::now();
      std::cerr << all.seeds << " of " << seeds.count << " seeds, " << all.failures << " failed\n";
    }
  }
  for (const pid_t process : processes) {
    int status = 0;
    ::waitpid(process, &status, 0);
    if (status != 0) {
      throw std::runtime_error("a process of the simulation died");
    }
  }
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: simulate FIRST_SEED COUNT [killers | storms | forgetful]\n";
    return 2;
  }
  try {
    SimulationSettings settings;
    settings.killers = argc > 3 && std::string(argv[3]) == "killers";
    settings.storms = argc > 3 && std::string(argv[3]) == "storms";
    settings.forgetful_syncs = argc > 3 && std::string(argv[3]) == "forgetful";
    const Report all = run({std::stoull(argv[1]), std::stoull(argv[2])}, settings);
    std::cout << all.seeds << " seeds, " << all.failures << " failed: " << all.outcome.text()
              << '\n';
    return all.failures == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
