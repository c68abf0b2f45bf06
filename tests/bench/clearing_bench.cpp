// How long the writer is held up by each step in which a deleted study's rows go.
//   oblique-clearing-bench FOLDER [POINTS [PAGES]]
// The log is moved into the file when it has PAGES pages, 1000 unless told.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/store/store.h"
#include "tests/support/points.h"

namespace oblique::server {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point began) {
  return std::chrono::duration<double, std::milli>(Clock::now() - began).count();
}

void fill(Store& store, std::uint64_t study, std::uint64_t points) {
  const auto table = table_of(points);
  store.commit(std::vector<Change>{AddStudy{study, "study " + std::to_string(study), table, "now"},
                                   AddWorker{study, "host", 1, "0.1", "avx2", "then"}});
  constexpr std::uint64_t kAtOnce = 1000;
  for (std::uint64_t first = 0; first < points; first += kAtOnce) {
    AddResults results{study, table, study, "0.1", "avx2", 1, "2024-01-01T00:00:01.000Z", {}};
    for (std::uint64_t point = first; point < std::min(first + kAtOnce, points); ++point) {
      results.results.push_back(solved_point(point));
    }
    store.commit(std::vector<Change>{std::move(results)});
  }
}

/// Deletes the study with that number in steps of so many rows.
void clear(Store& store, std::uint64_t study, std::size_t most) {
  store.commit(std::vector<Change>{DeleteStudy{study}});
  std::vector<double> steps_ms;
  const auto began = Clock::now();
  for (bool is_all = false; !is_all;) {
    const auto step = Clock::now();
    is_all = store.clear_away(most) == ClearedAway::kAll;
    steps_ms.push_back(ms_since(step));
  }
  const double whole_s = ms_since(began) / 1e3;
  std::sort(steps_ms.begin(), steps_ms.end());
  const auto at = [&](double part) {
    return steps_ms[static_cast<std::size_t>(part * static_cast<double>(steps_ms.size() - 1))];
  };
  std::printf(
      "steps of %4zu rows: %6zu steps, median %.2f ms, 99 of 100 %.2f ms, longest %.2f ms; "
      "all %.1f s\n",
      most, steps_ms.size(), at(0.5), at(0.99), at(1.0), whole_s);
}

}  // namespace
}  // namespace oblique::server

int main(int argc, char** argv) {
  using namespace oblique::server;
  if (argc < 2) {
    std::fprintf(stderr, "usage: oblique-clearing-bench FOLDER [POINTS [PAGES]]\n");
    return 2;
  }
  const std::uint64_t points = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 100'000;
  const std::string path = std::string(argv[1]) + "/clearing-bench.db";
  Store store(path);
  store.checkpoint_at(argc > 3 ? std::atoi(argv[3]) : 1000);
  std::uint64_t study = store.last_study_id();
  fill(store, ++study, points);  // stays
  for (const std::size_t most : {std::size_t{16}, std::size_t{64}, std::size_t{512}}) {
    fill(store, ++study, points);
    store.merge_log();
    clear(store, study, most);
    store.merge_log();
    std::printf("  the file has %.1f MB afterwards\n",
                static_cast<double>(std::filesystem::file_size(path)) / 1e6);
  }
}
