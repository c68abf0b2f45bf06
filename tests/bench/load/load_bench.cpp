#include <sys/resource.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto/keys/key_file.h"
#include "tests/bench/load/load_generator.h"
#include "tests/bench/load/status_probe.h"
#include "tests/bench/process_usage.h"
#include "tests/support/database.h"
#include "tests/support/programs.h"

/// Benchmarks many simulated workers, which solve nothing, against one real server on loopback.
/// Measures results per second, their cost in the server, and the latency of a client. README.md
/// has the commands.
namespace oblique::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Flags {
  std::vector<std::size_t> workers{1, 10, 100, 1000};
  double seconds = 10.0;
  std::vector<double> point_ms{0.0};
  std::uint64_t most_results = 2'000'000;
  std::string keys = "off";
};

void take_all_descriptors() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    limit.rlim_cur = limit.rlim_max;
    static_cast<void>(setrlimit(RLIMIT_NOFILE, &limit));
  }
}

void wait_for(const std::string& what, const std::function<bool()>& condition) {
  constexpr std::chrono::seconds kLongest{60};
  const auto until = Clock::now() + kLongest;
  while (!condition()) {
    if (Clock::now() > until) {
      throw std::runtime_error("timeout while waiting for " + what);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

double seconds_since(Clock::time_point instant) {
  return std::chrono::duration<double>(Clock::now() - instant).count();
}

void check(const test::Outcome& ran) {
  if (ran.exit_code != 0) {
    throw std::runtime_error(ran.err);
  }
}

/// Folder of a server, which is measured for one row of the table, and of its keys, if any.
struct Place {
  explicit Place(bool with_keys) {
    if (with_keys) {
      check(test::run_oblique(folder, {"keygen", keys}));
      environment["OBLIQUE_KEYS"] = keys + "/server.key";
    }
  }
  std::optional<protocol::KeyFile> key(const std::string& role) const {
    return environment.empty() ? std::nullopt
                               : std::optional(protocol::read_key_file(keys + "/" + role + ".key"));
  }

  test::TemporaryFolder folder;
  std::string keys = folder.file("keys");
  test::Environment environment;
};

/// Submits a study that is too large to be completed.
void submit(const Place& place, const test::Server& server) {
  std::vector<std::string> words{
      "submit",        "--server", server.client_url(), "--preset", "paper",        "--H",
      "0.1:1.15:1000", "--mu",     "0.05:0.95:1000",    "--e",      "0.2:1.0:1000", "--name",
      "load"};
  if (!place.environment.empty()) {
    words.insert(words.end(), {"--keys", place.keys + "/client.key"});
  }
  check(test::run_oblique(place.folder, words));
}

/// Measures and prints one row of the table, with a new server and database. The measurement starts
/// at the first stored result.
void bench(const Flags& flags, std::size_t workers, double point_ms, bool with_keys) {
  const Place place(with_keys);
  const test::Database database(place.folder.file("bench.db"));
  test::Server server(place.folder, place.folder.file("bench.db"), place.environment);
  const pid_t pid = server.process().pid();
  const Usage at_rest = usage_of(pid);
  LoadCounts before;
  LoadCounts after;
  Usage began;
  Usage ended;
  double generator_cpu_s = 0.0;
  double wall_s = 0.0;
  double rows = 0.0;
  StatusProbe::Seen seen;
  {
    const LoadGenerator generator(
        {server.worker_url(), workers, point_ms / 1e3, place.key("worker")});
    wait_for("welcomes", [&] { return generator.counts().welcomed >= workers; });
    submit(place, server);
    wait_for("results", [&] { return database.rows() > 0.0; });
    const double rows_before = database.rows();
    before = generator.counts();
    began = usage_of(pid);
    generator_cpu_s = -usage_of(getpid()).cpu_s;
    const auto start = Clock::now();
    StatusProbe probe(server.client_url(), place.key("client"), "load",
                      std::chrono::milliseconds(100));
    while (seconds_since(start) < flags.seconds &&
           generator.counts().results - before.results < flags.most_results) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    wall_s = seconds_since(start);
    ended = usage_of(pid);
    generator_cpu_s += usage_of(getpid()).cpu_s;
    after = generator.counts();
    rows = database.rows() - rows_before;
    seen = probe.stop();
  }
  // After this time the server has removed the lost workers.
  std::this_thread::sleep_for(std::chrono::seconds(4));
  const Usage left = usage_of(pid);
  const double server_cpu_s = ended.cpu_s - began.cpu_s;
  const double loop_cpu_s = ended.first_thread_cpu_s - began.first_thread_cpu_s;
  const auto batches = static_cast<double>(after.batches - before.batches);
  std::printf(
      "| %zu | %s | %.4g | %.0f | %.0f | %.0f | %.0f %% | %.0f %% | %.0f %% | %.1f | %.1f | %.1f | "
      "%.1f "
      "| %zu "
      "| "
      "%.0f | %.0f | %.0f | %llu |\n",
      workers, with_keys ? "yes" : "no", point_ms, rows / wall_s, batches / wall_s,
      static_cast<double>(after.messages - before.messages) / wall_s, 100.0 * loop_cpu_s / wall_s,
      100.0 * (server_cpu_s - loop_cpu_s) / wall_s, 100.0 * generator_cpu_s / wall_s,
      1e6 * server_cpu_s / rows, seen.quantile_ms(0.5), seen.quantile_ms(0.99),
      seen.quantile_ms(1.0), seen.latencies_ms.size() + seen.unanswered, at_rest.resident_MB,
      left.peak_MB, left.resident_MB, static_cast<unsigned long long>(after.connects - workers));
  std::fflush(stdout);
  if (after.connects > workers) {
    std::fprintf(stderr, "longest delay of the load generator's thread: %.1f s\n",
                 after.longest_gap_s);
  }
}

void run(const Flags& flags) {
  take_all_descriptors();
  std::printf("Size of a result on the network: %zu bytes\n", bytes_of_result());
  std::printf(
      "| workers | keys | point [ms] | results/s | batches/s | their messages/s | CPU: loop | "
      "writer | "
      "generator | us per "
      "result | status p50 [ms] | p99 | max | requests | server MB: at rest | peak | after | "
      "reconnects |\n"
      "|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
      "\n");
  const std::vector<bool> keys =
      flags.keys == "both" ? std::vector<bool>{false, true} : std::vector<bool>{flags.keys == "on"};
  for (const std::size_t workers : flags.workers) {
    for (const double point_ms : flags.point_ms) {
      for (const bool with_keys : keys) {
        bench(flags, workers, point_ms, with_keys);
      }
    }
  }
}

}  // namespace
}  // namespace oblique::bench

int main(int argc, char** argv) {
  oblique::bench::Flags flags;
  CLI::App app{"Measures one server with many workers that solve nothing.", "oblique-load-bench"};
  app.add_option("--workers", flags.workers, "Numbers of workers; one row for each")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--seconds", flags.seconds, "Length of a row [s]")->capture_default_str();
  app.add_option("--results", flags.most_results, "A row ends earlier after this number of results")
      ->capture_default_str();
  app.add_option("--point-ms", flags.point_ms,
                 "Simulated time per point [ms]; one row for each; 0: none")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--keys", flags.keys, "Encryption: off, on, or both (one row for each)")
      ->check(CLI::IsMember({"off", "on", "both"}))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    oblique::bench::run(flags);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "oblique-load-bench: %s\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
