#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <vector>

#include "worker/solver/library/solver.h"

namespace {

double user_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

/// Value i of n from `from` to `to`, as numpy.linspace gives it.
double value(double from, double to, int i, int n) {
  return i == n - 1 ? to : from + i * ((to - from) / (n - 1));
}

}  // namespace

/// The same points as compare.py, all results kept; prints wall and user time and the sum of the
/// forces.
int main() {
  constexpr int kDrops = 20;
  constexpr int kFrictions = 50;
  constexpr int kRestitutions = 20;
  std::vector<oblique::ModelPoint> points;
  for (int i = 0; i < kDrops; ++i) {
    for (int j = 0; j < kFrictions; ++j) {
      for (int k = 0; k < kRestitutions; ++k) {
        points.push_back({0,
                          {value(0.3, 1.1, i, kDrops), value(0.0, 2.0, j, kFrictions),
                           value(0.5, 1.0, k, kRestitutions)}});
      }
    }
  }
  const std::vector<oblique::ModelParameters> models{oblique::preset("paper")};
  std::vector<std::optional<oblique::CaseResult>> results(points.size());
  const double user_before_s = user_s();
  const auto begun = std::chrono::steady_clock::now();
  oblique::solve_many(models, points, [&results](oblique::Outcome&& outcome) {
    results[outcome.number] = std::move(outcome.result);
  });
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begun;
  const double user = user_s() - user_before_s;
  double sum_N = 0.0;
  for (const auto& result : results) {
    sum_N += result->fn_peak_N;
  }
  std::printf("%.4f %.4f %.10g\n", wall.count(), user, sum_N);
}
