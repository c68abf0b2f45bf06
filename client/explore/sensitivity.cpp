#include "client/explore/sensitivity.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "proto/oblique.pb.h"

namespace oblique::client {
namespace {

constexpr std::size_t kReplicates = 1000;
constexpr std::uint64_t kLevels = 8;

/// Hashes of one stream: number 0, 1, ... of `key`, as whole numbers below a limit.
class Draws {
 public:
  explicit Draws(std::uint64_t key) : key_(key) {}
  /// A number below `limit` < 2^32; the excess of the smaller numbers is below limit/2^32.
  std::uint64_t below(std::uint64_t limit) {
    return ((sampling::hashed(key_, next_++) >> 32U) * limit) >> 32U;
  }

 private:
  std::uint64_t key_;
  std::uint64_t next_ = 0;
};

/// Terms of the rows of a design, row by row.
struct RowTerms {
  std::size_t width;
  std::vector<double> terms = {};

  std::size_t rows() const { return terms.size() / width; }
};

/// Statistics as a function of the means of the terms.
using Statistics = std::function<std::vector<double>(std::span<const double> means)>;

/// The `share` quantile of values, which it reorders; NaN values count for nothing.
double percentile(std::vector<double>& values, double share) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) {
    return kNaN;
  }
  const auto place =
      static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

/// Statistics with the 2.5 % and 97.5 % percentiles over replicates, each of which draws as many
/// rows with replacement: B. Efron and R. J. Tibshirani, An Introduction to the Bootstrap (1993).
std::vector<Estimate> bootstrap(const RowTerms& rows, const Statistics& statistics_of,
                                std::uint64_t seed) {
  const std::size_t count = rows.rows();
  const auto add_row = [&](std::vector<double>& sums, std::size_t row) {
    const double* terms = rows.terms.data() + row * rows.width;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] += terms[i];
    }
  };
  const auto statistics_of_sums = [&](std::vector<double>& sums) {
    for (double& sum : sums) {
      sum /= static_cast<double>(count);
    }
    return statistics_of(sums);
  };
  std::vector<double> sums(rows.width);
  for (std::size_t row = 0; row < count; ++row) {
    add_row(sums, row);
  }
  const std::vector<double> values = statistics_of_sums(sums);
  std::vector<std::vector<double>> replicates(values.size());
  Draws draws(seed);
  for (std::size_t replicate = 0; replicate < kReplicates; ++replicate) {
    std::fill(sums.begin(), sums.end(), 0.0);
    for (std::size_t i = 0; i < count; ++i) {
      add_row(sums, draws.below(count));
    }
    const std::vector<double> drawn = statistics_of_sums(sums);
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      replicates[i].push_back(drawn[i]);
    }
  }
  std::vector<Estimate> estimates;
  for (std::size_t i = 0; i < values.size(); ++i) {
    estimates.push_back({.value = values[i],
                         .from = percentile(replicates[i], 0.025),
                         .to = percentile(replicates[i], 0.975)});
  }
  return estimates;
}

bool are_finite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(),
                     [](double value) { return std::isfinite(value); });
}

std::vector<Estimate> part_of(const std::vector<Estimate>& estimates, std::size_t part,
                              std::size_t inputs) {
  const auto begin = estimates.begin() + static_cast<std::ptrdiff_t>(part * inputs);
  return {begin, begin + static_cast<std::ptrdiff_t>(inputs)};
}

}  // namespace

std::vector<double> saltelli_row(std::size_t inputs, std::uint64_t seed, std::uint64_t number) {
  if (inputs > kMaxSobolInputs) {
    throw std::out_of_range("Saltelli's design has too many inputs");
  }
  protocol::Sample sobol;
  sobol.set_kind(protocol::SAMPLE_SOBOL);
  sobol.set_count(sampling::kMaxSamples);
  sobol.set_seed(seed);
  std::vector<double> a_and_b(2 * inputs);
  for (std::size_t i = 0; i < a_and_b.size(); ++i) {
    a_and_b[i] = sampling::fraction(sobol, static_cast<std::uint32_t>(i), number);
  }
  std::vector<double> row;
  row.reserve((inputs + 2) * inputs);
  for (std::size_t point = 0; point < inputs + 2; ++point) {
    for (std::size_t i = 0; i < inputs; ++i) {
      const bool is_of_b = point == 1 || point == i + 2;
      row.push_back(a_and_b[is_of_b ? inputs + i : i]);
    }
  }
  return row;
}

SobolIndices sobol_indices(std::span<const double> outputs, std::size_t inputs,
                           std::uint64_t seed) {
  const std::size_t points = inputs + 2;
  SobolIndices indices;
  std::vector<std::span<const double>> rows;
  for (std::size_t at = 0; at + points <= outputs.size(); at += points) {
    const auto row = outputs.subspan(at, points);
    if (are_finite(row)) {
      rows.push_back(row);
    } else {
      ++indices.dropped;
    }
  }
  indices.rows = rows.size();
  double sum = 0.0;
  for (const auto row : rows) {
    sum += row[0] + row[1];
  }
  indices.mean = rows.empty() ? kNaN : sum / static_cast<double>(2 * rows.size());
  // Terms of a row: f(A) + f(B) and f(A)^2 + f(B)^2 about the mean, and the sums' of the indices.
  RowTerms terms{.width = 2 + 2 * inputs};
  for (const auto row : rows) {
    const double a = row[0] - indices.mean;
    const double b = row[1] - indices.mean;
    terms.terms.insert(terms.terms.end(), {a + b, a * a + b * b});
    for (const std::size_t of : {1U, 0U}) {
      for (std::size_t i = 0; i < inputs; ++i) {
        const double difference = row[of] - row[2 + i];
        terms.terms.push_back(difference * difference);
      }
    }
  }
  const auto statistics = [inputs](std::span<const double> means) {
    const double variance = means[1] / 2.0 - means[0] * means[0] / 4.0;
    std::vector<double> values{variance};
    for (std::size_t i = 0; i < 2 * inputs; ++i) {
      const double part = means[2 + i] / (2.0 * variance);
      values.push_back(!(variance > 0.0) ? kNaN : i < inputs ? 1.0 - part : part);
    }
    return values;
  };
  auto estimates =
      rows.empty() ? std::vector<Estimate>(1 + 2 * inputs) : bootstrap(terms, statistics, seed);
  indices.variance = estimates[0].value;
  estimates.erase(estimates.begin());
  indices.first = part_of(estimates, 0, inputs);
  indices.total = part_of(estimates, 1, inputs);
  return indices;
}

MorrisTrajectory morris_trajectory(std::size_t inputs, std::uint64_t seed, std::uint64_t number) {
  Draws draws(sampling::hashed(seed, number));
  MorrisTrajectory trajectory;
  std::vector<double> point(inputs);
  for (double& coordinate : point) {
    coordinate = (static_cast<double>(draws.below(kLevels)) + 0.5) / static_cast<double>(kLevels);
  }
  trajectory.changed.resize(inputs);
  std::iota(trajectory.changed.begin(), trajectory.changed.end(), std::size_t{0});
  for (std::size_t i = inputs; i > 1; --i) {  // Fisher and Yates
    std::swap(trajectory.changed[i - 1], trajectory.changed[draws.below(i)]);
  }
  trajectory.points = point;
  for (const std::size_t input : trajectory.changed) {
    point[input] += point[input] < 0.5 ? 0.5 : -0.5;
    trajectory.points.insert(trajectory.points.end(), point.begin(), point.end());
  }
  return trajectory;
}

MorrisEffects morris_effects(std::span<const double> outputs, std::size_t inputs,
                             std::uint64_t seed) {
  MorrisEffects effects;
  // Terms of a trajectory: the effects, their magnitudes and their squares.
  RowTerms terms{.width = 3 * inputs};
  for (std::uint64_t number = 0; (number + 1) * (inputs + 1) <= outputs.size(); ++number) {
    const auto values = outputs.subspan(number * (inputs + 1), inputs + 1);
    if (!are_finite(values)) {
      ++effects.dropped;
      continue;
    }
    const MorrisTrajectory trajectory = morris_trajectory(inputs, seed, number);
    std::vector<double> row(terms.width);
    for (std::size_t step = 0; step < inputs; ++step) {
      const std::size_t input = trajectory.changed[step];
      const double change =
          trajectory.points[(step + 1) * inputs + input] - trajectory.points[step * inputs + input];
      const double effect = (values[step + 1] - values[step]) / change;
      row[input] = effect;
      row[inputs + input] = std::abs(effect);
      row[2 * inputs + input] = effect * effect;
    }
    terms.terms.insert(terms.terms.end(), row.begin(), row.end());
  }
  effects.trajectories = terms.rows();
  const auto n = static_cast<double>(effects.trajectories);
  const auto statistics = [inputs, n](std::span<const double> means) {
    std::vector<double> values(means.begin(), means.end());
    for (std::size_t i = 0; i < inputs; ++i) {
      const double variance = (means[2 * inputs + i] - means[i] * means[i]) * n / (n - 1.0);
      values[2 * inputs + i] = std::sqrt(std::max(variance, 0.0));
    }
    return values;
  };
  const auto estimates = effects.trajectories < 2 ? std::vector<Estimate>(3 * inputs)
                                                  : bootstrap(terms, statistics, seed);
  effects.mu = part_of(estimates, 0, inputs);
  effects.mu_star = part_of(estimates, 1, inputs);
  effects.sigma = part_of(estimates, 2, inputs);
  return effects;
}

}  // namespace oblique::client
