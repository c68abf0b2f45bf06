#include "client/explore/sensitivity.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <stdexcept>
#include <utility>

#include "proto/oblique.pb.h"

namespace oblique::client {
namespace {

/// A whole number below `limit` < 2^32; unlike the standard's distributions, equal everywhere.
std::uint64_t below(std::uint64_t limit, std::mt19937_64& random) {
  return ((random() >> 32U) * limit) >> 32U;
}

/// Estimators that are functions of the means of terms of the rows.
struct Estimators {
  std::vector<std::string> names;  ///< of the measures
  std::size_t points;              ///< of a row
  /// Appends the terms of a row, of which all rows have the same number.
  std::function<void(std::uint64_t row, std::span<const double> values, std::vector<double>& terms)>
      append_terms;
  /// The measures one after the other, each of all inputs, from the means over `rows` rows.
  std::function<std::vector<double>(std::span<const double> means, double rows)> measures;
};

/// The first of some numbers, with the percentiles of the others that are not NaN.
Estimate estimate_of(std::span<const double> replicates) {
  Estimate estimate{.value = replicates.front()};
  std::vector<double> rising(replicates.begin() + 1, replicates.end());
  std::erase_if(rising, [](double value) { return std::isnan(value); });
  if (!rising.empty()) {
    std::sort(rising.begin(), rising.end());
    const auto last = static_cast<double>(rising.size() - 1);
    estimate.from = rising[static_cast<std::size_t>(0.025 * last + 0.5)];
    estimate.to = rising[static_cast<std::size_t>(0.975 * last + 0.5)];
  }
  return estimate;
}

Sensitivity estimated(const Estimators& estimators, std::span<const double> values,
                      std::size_t inputs, std::uint64_t seed) {
  constexpr std::size_t kReplicates = 1000;
  Sensitivity found;
  std::vector<double> terms;
  for (std::uint64_t row = 0; (row + 1) * estimators.points <= values.size(); ++row) {
    const auto of_row = values.subspan(row * estimators.points, estimators.points);
    if (std::all_of(of_row.begin(), of_row.end(), [](double f) { return std::isfinite(f); })) {
      estimators.append_terms(row, of_row, terms);
      ++found.rows;
    } else {
      ++found.dropped;
    }
  }
  // Of each measure and input the estimate and its replicates.
  std::vector<std::vector<double>> replicates(estimators.names.size() * inputs, {kNaN});
  if (found.rows >= 2) {
    replicates.assign(replicates.size(), {});
    const auto count = static_cast<double>(found.rows);
    std::vector<double> means(terms.size() / found.rows);
    std::mt19937_64 random(seed);
    for (std::size_t replicate = 0; replicate <= kReplicates; ++replicate) {
      std::fill(means.begin(), means.end(), 0.0);
      for (std::uint64_t row = 0; row < found.rows; ++row) {
        const double* term =
            &terms[means.size() * (replicate == 0 ? row : below(found.rows, random))];
        for (double& mean : means) {
          mean += *term++ / count;
        }
      }
      const auto measures = estimators.measures(means, count);
      for (std::size_t i = 0; i < measures.size(); ++i) {
        replicates[i].push_back(measures[i]);
      }
    }
  }
  for (std::size_t i = 0; i < replicates.size(); ++i) {
    if (i % inputs == 0) {
      found.measures.push_back({estimators.names[i / inputs]});
    }
    found.measures.back().of_inputs.push_back(estimate_of(replicates[i]));
  }
  return found;
}

}  // namespace

double Sensitivity::half_width() const {
  double widest = 0.0;
  for (const Measure& measure : measures) {
    for (const Estimate& estimate : measure.of_inputs) {
      widest = std::fmax(widest, estimate.half_width());  // ignores NaN
    }
  }
  return widest;
}

std::vector<double> saltelli_row(std::size_t inputs, std::uint64_t seed, std::uint64_t number) {
  if (inputs > kMaxSobolInputs) {
    throw std::out_of_range("Saltelli's design has too many inputs");
  }
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
    coordinate = (static_cast<double>(below(kLevels, random)) + 0.5) / kLevels;
  }
  std::vector<std::size_t> order(inputs);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = inputs; i > 1; --i) {  // Fisher and Yates
    std::swap(order[i - 1], order[below(i, random)]);
  }
  std::vector<double> points = point;
  for (const std::size_t input : order) {
    point[input] += point[input] < 0.5 ? 0.5 : -0.5;
    points.insert(points.end(), point.begin(), point.end());
  }
  return points;
}

Sensitivity sobol_indices(std::span<const double> values, std::size_t inputs, std::uint64_t seed) {
  // Any constant may be subtracted; one near the mean keeps the digits of the variance.
  const auto finite =
      std::find_if(values.begin(), values.end(), [](double f) { return std::isfinite(f); });
  const double f0 = finite == values.end() ? 0.0 : *finite;
  const auto append_terms = [f0](std::uint64_t, std::span<const double> f,
                                 std::vector<double>& terms) {
    const double a = f[0] - f0;
    const double b = f[1] - f0;
    terms.insert(terms.end(), {a + b, a * a + b * b});
    for (const double of : {f[1], f[0]}) {
      for (const double of_ab : f.subspan(2)) {
        terms.push_back((of - of_ab) * (of - of_ab));
      }
    }
  };
  const auto measures = [inputs](std::span<const double> means, double) {
    const double V = means[1] / 2.0 - means[0] * means[0] / 4.0;
    std::vector<double> indices;
    for (std::size_t i = 0; i < 2 * inputs; ++i) {
      const double part = V > 0.0 ? means[2 + i] / (2.0 * V) : kNaN;
      indices.push_back(i < inputs ? 1.0 - part : part);
    }
    return indices;
  };
  return estimated({{"first", "total"}, inputs + 2, append_terms, measures}, values, inputs, seed);
}

Sensitivity morris_effects(std::span<const double> values, std::size_t inputs, std::uint64_t seed) {
  const auto append_terms = [inputs, seed](std::uint64_t row, std::span<const double> f,
                                           std::vector<double>& terms) {
    const auto points = morris_trajectory(inputs, seed, row);
    std::vector<double> of_row(3 * inputs);
    for (std::size_t i = 0; i < inputs * inputs; ++i) {
      const std::size_t step = i / inputs;
      const double change = points[i + inputs] - points[i];
      if (change != 0.0) {  // the one input that changes in this step
        const double effect = (f[step + 1] - f[step]) / change;
        of_row[i % inputs] = std::abs(effect);
        of_row[inputs + i % inputs] = effect * effect;
        of_row[2 * inputs + i % inputs] = effect;
      }
    }
    terms.insert(terms.end(), of_row.begin(), of_row.end());
  };
  const auto measures = [inputs](std::span<const double> means, double rows) {
    std::vector<double> of_inputs(means.begin(), means.end());
    for (std::size_t i = inputs; i < 2 * inputs; ++i) {
      const double mu = means[inputs + i];
      of_inputs[i] = std::sqrt(std::fmax((means[i] - mu * mu) * rows / (rows - 1.0), 0.0));
    }
    return of_inputs;
  };
  return estimated({{"mu_star", "sigma", "mu"}, inputs + 1, append_terms, measures}, values, inputs,
                   seed);
}

}  // namespace oblique::client
