#include "client/explore/sensitivity.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

#include <Eigen/Core>

#include "proto/oblique.pb.h"

namespace oblique::client {
namespace {

using Eigen::ArrayXd;
using Eigen::ArrayXXd;
using Eigen::Index;

/// A whole number below `limit` < 2^32. Unlike the distributions of the C++ library it is the same
/// on every platform.
std::uint64_t random_below(std::uint64_t limit, std::mt19937_64& random) {
  return ((random() >> 32U) * limit) >> 32U;
}

/// Returns `numbers` as a matrix whose columns have `size` elements.
Eigen::Map<const ArrayXXd> in_columns(std::span<const double> numbers, std::size_t size) {
  return {numbers.data(), static_cast<Index>(size), static_cast<Index>(numbers.size() / size)};
}

/// Returns the largest rounding error of the finite elements.
double rounding_of(const ArrayXXd& numbers) {
  return kRounding * numbers.isFinite().select(numbers.abs(), 0.0).maxCoeff();
}

/// Returns the first number as an estimate, and as its interval the 2.5 % and 97.5 % percentiles of
/// the other numbers. Ignores NaN among these.
Estimate estimate_of(const ArrayXd& numbers) {
  Estimate estimate{.value = numbers[0]};
  std::vector<double> rising(numbers.begin() + 1, numbers.end());
  std::erase_if(rising, [](double value) { return std::isnan(value); });
  if (!rising.empty()) {
    std::sort(rising.begin(), rising.end());
    const auto last = static_cast<double>(rising.size() - 1);
    estimate.from = rising[static_cast<std::size_t>(0.025 * last + 0.5)];
    estimate.to = rising[static_cast<std::size_t>(0.975 * last + 0.5)];
  }
  return estimate;
}

/// Estimates measures that are functions of means, with bootstrap intervals. Each column of `terms`
/// belongs to a row of the design. `measures_of(means, rows)` computes the measures from the means
/// of the terms. It returns the first measure of all inputs, then the second, and so on.
Sensitivity estimated(const std::vector<std::string>& measures, std::size_t inputs,
                      const ArrayXXd& terms, std::uint64_t seed, const auto& measures_of) {
  constexpr Index kReplicates = 1000;
  std::vector<Index> used;
  for (Index row = 0; row < terms.cols(); ++row) {
    if (terms.col(row).isFinite().all()) {
      used.push_back(row);
    }
  }
  const auto rows = static_cast<double>(used.size());
  // Column 0 has the estimates from all rows, the other columns those from replicates.
  ArrayXXd estimates =
      ArrayXXd::Constant(std::ssize(measures) * static_cast<Index>(inputs), 1 + kReplicates, kNaN);
  std::mt19937_64 random(seed);
  for (Index replicate = 0; used.size() >= 2 && replicate <= kReplicates; ++replicate) {
    ArrayXd means = ArrayXd::Zero(terms.rows());
    for (std::size_t i = 0; i < used.size(); ++i) {
      means += terms.col(used[replicate == 0 ? i : random_below(used.size(), random)]) / rows;
    }
    estimates.col(replicate) = measures_of(means, rows);
  }
  Sensitivity found{.rows = used.size(),
                    .dropped = static_cast<std::uint64_t>(terms.cols()) - used.size()};
  Index row = 0;
  for (const std::string& name : measures) {
    auto& of_inputs = found.measures.emplace_back(Measure{name}).of_inputs;
    while (of_inputs.size() < inputs) {
      of_inputs.push_back(estimate_of(estimates.row(row++)));
    }
  }
  return found;
}

}  // namespace

std::vector<double> saltelli_row(std::size_t inputs, std::uint64_t seed, std::uint64_t number) {
  protocol::Sample sobol;
  sobol.set_kind(protocol::SAMPLE_SOBOL);
  sobol.set_count(sampling::kMaxSamples);
  sobol.set_seed(seed);
  std::vector<double> row((inputs + 2) * inputs);
  for (std::size_t i = 0; i < inputs; ++i) {
    const double a = sampling::fraction(sobol, static_cast<std::uint32_t>(i), number);
    const double b = sampling::fraction(sobol, static_cast<std::uint32_t>(inputs + i), number);
    for (std::size_t point = 0; point < inputs + 2; ++point) {
      row[point * inputs + i] = point == 1 || point == i + 2 ? b : a;
    }
  }
  return row;
}

std::vector<double> morris_trajectory(std::size_t inputs, std::uint64_t seed,
                                      std::uint64_t number) {
  constexpr std::uint64_t kLevels = 8;
  std::mt19937_64 random(sampling::hashed(seed, number));
  std::vector<double> point(inputs);
  for (double& coordinate : point) {
    coordinate = (static_cast<double>(random_below(kLevels, random)) + 0.5) / kLevels;
  }
  std::vector<std::size_t> order(inputs);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = inputs; i > 1; --i) {  // Fisher and Yates
    std::swap(order[i - 1], order[random_below(i, random)]);
  }
  std::vector<double> points = point;
  for (const std::size_t input : order) {
    point[input] += point[input] < 0.5 ? 0.5 : -0.5;
    points.insert(points.end(), point.begin(), point.end());
  }
  return points;
}

Sensitivity sobol_indices(std::span<const double> values, std::size_t inputs, std::uint64_t seed) {
  const auto d = static_cast<Index>(inputs);
  const auto f = in_columns(values, inputs + 2);
  // Any constant may be subtracted; one near the mean keeps the digits of the variance.
  const auto finite =
      std::find_if(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
  const double f0 = finite == values.end() ? 0.0 : *finite;
  ArrayXXd terms(2 + 2 * d, f.cols());
  terms.row(0) = (f.row(0) - f0) + (f.row(1) - f0);
  terms.row(1) = (f.row(0) - f0).square() + (f.row(1) - f0).square();
  for (Index i = 0; i < d; ++i) {
    terms.row(2 + i) = (f.row(1) - f.row(2 + i)).square();
    terms.row(2 + d + i) = (f.row(0) - f.row(2 + i)).square();
  }
  const double rounding = rounding_of(f);
  const auto measures_of = [d, rounding](const ArrayXd& means, double) {
    const double V = means[1] / 2.0 - means[0] * means[0] / 4.0;
    ArrayXd indices = means.tail(2 * d) / (V > rounding * rounding ? 2.0 * V : kNaN);
    indices.head(d) = 1.0 - indices.head(d);
    return indices;
  };
  return estimated({"first", "total"}, inputs, terms, seed, measures_of);
}

Sensitivity morris_effects(std::span<const double> values, std::span<const double> coordinates,
                           std::size_t inputs, std::uint64_t seed) {
  const auto d = static_cast<Index>(inputs);
  const auto f = in_columns(values, inputs + 1);
  const auto points = in_columns(coordinates, inputs);
  ArrayXXd effects(d, f.cols());
  ArrayXd usual = ArrayXd::Zero(d);  // subtracted like f0 in `sobol_indices`
  for (Index row = 0; row < f.cols(); ++row) {
    for (Index step = 0; step < d; ++step) {
      const Index at = row * (d + 1) + step;
      const ArrayXd change = points.col(at + 1) - points.col(at);
      Index input = 0;
      change.abs().maxCoeff(&input);  // the coordinate that changes
      effects(input, row) = (f(step + 1, row) - f(step, row)) / change[input];
    }
    usual = effects.col(row).isFinite().all() ? ArrayXd(effects.col(row)) : usual;
  }
  ArrayXXd terms(3 * d, f.cols());
  terms << effects.abs(), (effects.colwise() - usual).square(), effects.colwise() - usual;
  const double rounding = rounding_of(f);
  const auto measures_of = [&](ArrayXd means, double rows) {
    const ArrayXd variances = (means.segment(d, d) - means.tail(d).square()) * rows / (rows - 1.0);
    means.segment(d, d) = variances.max(0.0).sqrt();
    means.tail(d) += usual;
    return ArrayXd((means.abs() > rounding).select(means, 0.0));
  };
  return estimated({"mu_star", "sigma", "mu"}, inputs, terms, seed, measures_of);
}

}  // namespace oblique::client
