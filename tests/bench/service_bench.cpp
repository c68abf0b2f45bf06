#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "tests/bench/instant_worker.h"
#include "tests/bench/process_usage.h"
#include "tests/support/database.h"
#include "tests/support/programs.h"

/// Benchmarks whole studies with real processes. Measures wall time, CPU time and memory of each
/// process, and the size of the database. README.md has the commands.
namespace oblique::bench {
namespace {

using Clock = std::chrono::steady_clock;

/// Returns arguments for a study of about `points` points: a grid over H, mu and e.
std::vector<std::string> study_of(std::uint64_t points) {
  const auto side =
      static_cast<std::uint64_t>(std::llround(std::cbrt(static_cast<double>(points))));
  std::ostringstream text;
  text << ':' << std::max<std::uint64_t>(side, 2);
  const std::string count = text.str();
  return {
      "--preset",        "paper",  "--H",  "0.1:1.15" + count, "--mu", "0.05:0.95" + count, "--e",
      "0.2:1.0" + count, "--name", "bench"};
}

/// Returns arguments for a study of `points` points, each with its own model.
std::vector<std::string> models_of(std::uint64_t points) {
  return {"--k",      "1e7:9e7:" + std::to_string(points),
          "--preset", "paper",
          "--H",      "1",
          "--mu",     "0.4",
          "--e",      "1",
          "--name",   "bench"};
}

double megabytes(const std::string& file) {
  std::error_code missing;
  const auto bytes = std::filesystem::file_size(file, missing);
  return missing ? 0.0 : static_cast<double>(bytes) / 1e6;
}

/// A study that `oblique` submits and watches until its end.
struct Study {
  explicit Study(std::uint64_t points) : Study(study_of(points)) {}
  explicit Study(std::vector<std::string> flags) : arguments(std::move(flags)) {}

  void run() {
    std::vector<std::string> submit{"submit", "--server", server.client_url()};
    submit.insert(submit.end(), arguments.begin(), arguments.end());
    began = Clock::now();
    check(test::run_oblique(folder, submit));
    submitted_s = seconds();
    check(test::run_oblique(folder, {"watch", "bench", "--server", server.client_url()}));
    wall_s = seconds();
    rows = database.rows();
  }
  double seconds() const { return std::chrono::duration<double>(Clock::now() - began).count(); }
  static void check(const test::Outcome& ran) {
    if (ran.exit_code != 0) {
      throw std::runtime_error(ran.err);
    }
  }

  test::TemporaryFolder folder;
  std::string file = folder.file("bench.db");
  test::Database database{file};
  test::Server server{folder, file};
  std::vector<std::string> arguments;
  Clock::time_point began;
  double submitted_s = 0.0;
  double wall_s = 0.0;
  double rows = 0.0;
};

void bench_service(const std::vector<std::string>& flags) {
  Study study(flags);
  test::Worker worker(study.folder, study.server.worker_url());
  study.run();
  const Usage solving = usage_of(worker.pid());
  const Usage serving = usage_of(study.server.process().pid());
  const double wal_MB = megabytes(study.file + "-wal");
  std::printf("| %.0f | %.1f | %.0f | %.1f | %.1f | %.1f %% | %.1f | %.0f | %.0f | %.0f |\n",
              study.rows, study.wall_s, study.rows / study.wall_s, solving.cpu_s, serving.cpu_s,
              100.0 * serving.cpu_s / (serving.cpu_s + solving.cpu_s),
              1e6 * serving.cpu_s / study.rows, solving.peak_MB, serving.peak_MB,
              megabytes(study.file) + wal_MB);
  std::fflush(stdout);
}

void bench_server_alone(const std::vector<std::string>& flags) {
  Study study(flags);
  const InstantWorker worker(study.server.worker_url());
  const double before_s = usage_of(getpid()).cpu_s;
  study.run();
  const Usage serving = usage_of(study.server.process().pid());
  const double answering_s = usage_of(getpid()).cpu_s - before_s;
  std::printf("| %.0f | %.1f | %.0f | %.1f | %.1f | %.1f | %.0f |\n", study.rows, study.wall_s,
              study.rows / study.wall_s, serving.cpu_s, 1e6 * serving.cpu_s / study.rows,
              1e6 * answering_s / study.rows, serving.peak_MB);
  std::fflush(stdout);
}

/// Runs `oblique` to its end and returns the resources that it used.
Usage run_and_watch(const test::TemporaryFolder& folder,
                    const std::vector<std::string>& arguments) {
  test::Process process(folder, test::client_program(), arguments);
  Usage last;
  while (!process.exit_code()) {
    const Usage now = usage_of(process.pid());
    last = now.peak_MB > 0.0 ? now : last;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  Study::check(process.outcome());
  return last;
}

/// Merges a complete study into an empty database, and then again into the same database.
void bench_merge(std::uint64_t points) {
  Study study(points);
  {
    const InstantWorker worker(study.server.worker_url());
    study.run();
  }
  study.server.process().send(SIGTERM);
  study.server.process().wait();
  const std::string target = study.folder.file("all.db");
  for (const char* what : {"new", "known"}) {
    const auto began = Clock::now();
    const Usage merging = run_and_watch(study.folder, {"merge", study.file, "--db", target});
    const std::chrono::duration<double> wall = Clock::now() - began;
    std::printf("| %.0f | %s | %.1f | %.0f | %.1f | %.0f |\n", study.rows, what, wall.count(),
                study.rows / wall.count(), 1e6 * merging.cpu_s / study.rows, merging.peak_MB);
    std::fflush(stdout);
  }
}

void wait_for(const std::function<bool()>& condition) {
  while (!condition()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// A study that is submitted without waiting for its end.
struct Underway : Study {
  explicit Underway(std::uint64_t points) : Study(points) {
    std::vector<std::string> submit{"submit", "--server", server.client_url()};
    submit.insert(submit.end(), arguments.begin(), arguments.end());
    check(test::run_oblique(folder, submit));
  }
  double count() const { return database.rows(); }
};

/// Measures the time from killing a worker until another worker has solved all points that the
/// killed worker held. The results of these points have `attempt` = 2.
void bench_worker_killed(std::uint64_t points) {
  Underway study(points);
  test::Worker survivor(study.folder, study.server.worker_url());
  test::Worker victim(study.folder, study.server.worker_url());
  wait_for([&] { return study.count() > 10'000; });
  const auto killed = std::chrono::system_clock::now().time_since_epoch();
  victim.send(SIGKILL);
  victim.wait();
  std::this_thread::sleep_for(std::chrono::seconds(5));
  const double held = study.database.number("SELECT count(*) FROM results WHERE attempt > 1");
  // Converts SQLite's Julian days to seconds since 1970.
  const double solved_s = study.database.number(
      "SELECT (julianday(max(solved_at)) - 2440587.5) * 86400 FROM results WHERE attempt > 1");
  std::printf("| %.3g | %.0f | %.2f |\n", static_cast<double>(points), held,
              solved_s - std::chrono::duration<double>(killed).count());
}

/// Kills and restarts the server. Measures the time from the kill until results of both workers are
/// stored.
void bench_server_killed(std::uint64_t points) {
  Underway study(points);
  test::Worker one(study.folder, study.server.worker_url());
  test::Worker other(study.folder, study.server.worker_url());
  wait_for([&] { return study.count() > 5000; });
  study.server.process().send(SIGKILL);
  study.server.process().wait();
  const auto killed = Clock::now();
  const test::Server again(study.folder, study.file, study.server);
  const std::chrono::duration<double> started = Clock::now() - killed;
  const std::string joined = "SELECT count(DISTINCT worker_id) FROM results WHERE worker_id > 2";
  wait_for([&] { return study.database.number(joined) >= 2; });
  const std::chrono::duration<double> full = Clock::now() - killed;
  std::printf("| %.3g | %.2f | %.2f |\n", static_cast<double>(points), started.count(),
              full.count());
}

void run_all(const std::string& what, const std::vector<std::uint64_t>& points) {
  const auto table = [&](const char* header, const std::function<void(std::uint64_t)>& row) {
    std::puts(header);
    for (const std::uint64_t count : points) {
      row(count);
    }
  };
  const auto row_of = [](const auto& flags_of, const auto& bench) {
    return std::function<void(std::uint64_t)>([=](std::uint64_t count) { bench(flags_of(count)); });
  };
  if (what == "service" || what == "models") {
    table(
        "| points | wall [s] | points/s | worker CPU [s] | server CPU [s] | server's share | "
        "server "
        "us a point | worker MB | server MB | database MB |\n"
        "|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
        what == "models" ? row_of(models_of, bench_service) : row_of(study_of, bench_service));
  } else if (what == "server-alone" || what == "server-alone-models") {
    table(
        "| results | wall [s] | results/s | server CPU [s] | us a result | worker us a result | "
        "server "
        "MB |\n"
        "|---:|---:|---:|---:|---:|---:|---:|",
        what == "server-alone" ? row_of(study_of, bench_server_alone)
                               : row_of(models_of, bench_server_alone));
  } else if (what == "merge") {
    table(
        "| rows | which are | wall [s] | rows/s | us a row | MB |\n"
        "|---:|---|---:|---:|---:|---:|",
        bench_merge);
  } else if (what == "worker-killed") {
    table(
        "| points | of them held by the killed worker | solved elsewhere after [s] |\n"
        "|---:|---:|---:|",
        bench_worker_killed);
  } else if (what == "server-killed") {
    table(
        "| points | listens again after [s] | rows of both workers again after [s] |\n"
        "|---:|---:|---:|",
        bench_server_killed);
  } else {
    throw std::invalid_argument("`" + what +
                                "` is none of service, models, server-alone, server-alone-models, "
                                "merge, worker-killed and server-killed");
  }
}

}  // namespace
}  // namespace oblique::bench

int main(int argc, char** argv) {
  try {
    if (argc < 3) {
      throw std::invalid_argument(
          "usage: oblique-service-bench "
          "service|models|server-alone|server-alone-models|merge|"
          "worker-killed|server-killed POINTS...");
    }
    std::vector<std::uint64_t> points;
    for (int i = 2; i < argc; ++i) {
      points.push_back(std::stoull(argv[i]));
    }
    oblique::bench::run_all(argv[1], points);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "oblique-service-bench: %s\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
