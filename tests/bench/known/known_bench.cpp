// What a server is spared: rows that need not be looked at when it starts, and points that another
// study has solved. README.md says how to run it.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/database/sqlite.h"
#include "server/store/store.h"
#include "tests/bench/known/instant_worker.h"
#include "tests/bench/process_usage.h"
#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/support/recipes.h"

namespace oblique::bench {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point began) {
  return std::chrono::duration<double>(Clock::now() - began).count();
}

void check(const test::Outcome& ran) {
  if (ran.exit_code != 0) {
    throw std::runtime_error(ran.err);
  }
}

/// A study of ten times so many points, of which these have a row, with gaps between each million.
void make_database(const std::string& file, std::uint64_t results) {
  const auto table = std::make_shared<const protocol::PointTable>(protocol::recipe_of(
      {{protocol::range("H", 0.1, 1.1, 10), protocol::range("mu", 0.0, 1.0, results),
        protocol::listed("e", {1.0})}}));
  {
    server::Store store(file);
    const std::vector<server::Change> changes{
        server::AddStudy{1, "bench", table, "2024-01-01T00:00:00.000Z", {}},
        server::AddWorker{1, "bench", 1, "0.2.0", "avx2", "2024-01-01T00:00:00.000Z"}};
    store.commit(changes);
  }
  const server::DatabaseHandle database = server::open_database(file, SQLITE_OPEN_READWRITE);
  server::execute(database.get(), "PRAGMA synchronous = OFF");
  server::execute(database.get(),
                  "INSERT INTO models (links, lengths_m, E, A, I, rho, g, elements_per_link, k,"
                  " eta2, tip_mass, integrator, spectral_radius, dt, dt_fall, definition)"
                  " VALUES (1, '[1]', 1, 1, 1, 1, 1, 1, 1, 1, 0, 'explicit', 0, 0, 0, 'bench')");
  constexpr std::uint64_t kPart = 1'000'000;
  for (std::uint64_t first = 0; first < results; first += kPart) {
    const std::uint64_t last = std::min(first + kPart, results) - 2;
    server::execute(
        database.get(),
        fmt::format("WITH RECURSIVE n(i) AS (SELECT {} UNION ALL SELECT i + 1 FROM n WHERE i < {})"
                    " INSERT INTO packed_results (study_id, point, model_id, H, mu, e, worker,"
                    " attempt) SELECT 1, i, 1, 0.1, 0.5, 1, 1, 1 FROM n",
                    first, last));
    server::execute(database.get(), fmt::format("INSERT INTO settled_points VALUES (1, {}, {})",
                                                first, last + 1 - first));
  }
}

void bench_start(std::uint64_t results) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("bench.db");
  auto began = Clock::now();
  make_database(file, results);
  const double made_s = seconds_since(began);
  began = Clock::now();
  test::Server server(folder, file);
  check(test::run_oblique(folder, {"status", "--server", server.client_url()}));
  const double started_s = seconds_since(began);
  const Usage serving = usage_of(server.process().pid());
  server.process().send(SIGTERM);
  server.process().wait();
  began = Clock::now();
  check(test::run_oblique(folder, {"status", "--db", file}));
  std::printf("| %.0e | %.0f | %.2f | %.2f | %.2f | %.0f |\n", static_cast<double>(results), made_s,
              started_s, serving.cpu_s, seconds_since(began), serving.peak_MB);
  std::fflush(stdout);
}

std::vector<std::string> study_of(std::uint64_t points, const std::string& name) {
  const auto side =
      static_cast<std::uint64_t>(std::llround(std::cbrt(static_cast<double>(points))));
  const std::string count = fmt::format(":{}", std::max<std::uint64_t>(side, 2));
  return {"--preset",          "paper", "--H",           "0.1:1.15" + count, "--mu",
          "0.05:0.95" + count, "--e",   "0.2:1" + count, "--name",           name};
}

void bench_taken(std::uint64_t points) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("bench.db");
  const test::Database database(file);
  test::Server server(folder, file);
  const auto submit = [&](const std::string& name) {
    std::vector<std::string> arguments{"submit", "--server", server.client_url()};
    const auto study = study_of(points, name);
    arguments.insert(arguments.end(), study.begin(), study.end());
    check(test::run_oblique(folder, arguments));
  };
  submit("bench");
  {
    const InstantWorker worker(server.worker_url());
    check(test::run_oblique(folder, {"watch", "bench", "--server", server.client_url()}));
  }
  const double before_s = usage_of(server.process().pid()).cpu_s;
  const auto began = Clock::now();
  submit("again");
  const double submitted_s = seconds_since(began);
  check(test::run_oblique(folder, {"watch", "again", "--server", server.client_url()}));
  const double taken_s = seconds_since(began);
  const double rows = database.number("SELECT count(*) FROM packed_results WHERE study_id = 2");
  std::printf("| %.0f | %.2f | %.2f | %.0f | %.2f |\n", rows, submitted_s, taken_s, rows / taken_s,
              usage_of(server.process().pid()).cpu_s - before_s);
  std::fflush(stdout);
}

}  // namespace
}  // namespace oblique::bench

int main(int argc, char** argv) {
  try {
    const std::string what = argc < 3 ? "" : argv[1];
    if (what != "start" && what != "taken") {
      throw std::invalid_argument("usage: oblique-known-bench start|taken NUMBER...");
    }
    std::puts(what == "start"
                  ? "| results | made in [s] | started in [s] | server CPU [s] | status "
                    "of the file [s] | server MB |\n|---:|---:|---:|---:|---:|---:|"
                  : "| points | submitted in [s] | taken over in [s] | points/s | "
                    "server CPU [s] |\n|---:|---:|---:|---:|---:|");
    for (int i = 2; i < argc; ++i) {
      const std::uint64_t number = std::stoull(argv[i]);
      what == "start" ? oblique::bench::bench_start(number) : oblique::bench::bench_taken(number);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "oblique-known-bench: %s\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
