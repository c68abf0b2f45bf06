#include "client/explore/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace oblique::client {
namespace {

/// The 97.5 % quantile of the standard normal distribution.
constexpr double kZ = 1.959963984540054;

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// The smallest k with P(B <= k) >= `share`, for B binomial of n draws with probability p. Sums
/// the probabilities from so far below the mean that what is left out is below 1e-15.
std::size_t binomial_quantile(std::size_t n, double p, double share) {
  const auto draws = static_cast<double>(n);
  const double far = 9.0 * std::sqrt(draws * p * (1.0 - p)) + 40.0;
  auto k = static_cast<std::size_t>(std::max(0.0, std::floor(draws * p - far)));
  const auto at = static_cast<double>(k);
  double probability =
      std::exp(std::lgamma(draws + 1.0) - std::lgamma(at + 1.0) - std::lgamma(draws - at + 1.0) +
               at * std::log(p) + (draws - at) * std::log1p(-p));
  double sum = probability;
  while (sum < share && k < n) {
    ++k;
    probability *= (draws - static_cast<double>(k) + 1.0) / static_cast<double>(k) * p / (1.0 - p);
    sum += probability;
  }
  return k;
}

/// A correlation with the interval by Fisher's transformation, whose variance is scale/(n - 3).
Estimate correlation(std::span<const double> x, std::span<const double> y, double scale) {
  const std::size_t n = x.size();
  if (n < 4) {
    return {};
  }
  const double x_mean = mean_of(x);
  const double y_mean = mean_of(y);
  double xx = 0.0;
  double yy = 0.0;
  double xy = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    xx += (x[i] - x_mean) * (x[i] - x_mean);
    yy += (y[i] - y_mean) * (y[i] - y_mean);
    xy += (x[i] - x_mean) * (y[i] - y_mean);
  }
  if (!(xx > 0.0 && yy > 0.0)) {
    return {};
  }
  const double r = std::clamp(xy / std::sqrt(xx * yy), -1.0, 1.0);
  const double half = kZ * std::sqrt(scale / static_cast<double>(n - 3));
  return {r, std::tanh(std::atanh(r) - half), std::tanh(std::atanh(r) + half)};
}

}  // namespace

Moments moments_of(std::span<const double> values) {
  Moments moments{.sd = kNaN};
  if (values.empty()) {
    return moments;
  }
  const double mean = mean_of(values);
  moments.mean.value = mean;
  if (values.size() < 2) {
    return moments;
  }
  double squares = 0.0;
  for (const double value : values) {
    squares += (value - mean) * (value - mean);
  }
  const auto n = static_cast<double>(values.size());
  moments.sd = std::sqrt(squares / (n - 1.0));
  const double half = kZ * moments.sd / std::sqrt(n);
  moments.mean = {mean, mean - half, mean + half};
  return moments;
}

Estimate quantile_of(std::span<const double> rising, double p) {
  const std::size_t n = rising.size();
  if (n == 0) {
    return {};
  }
  const double place = static_cast<double>(n - 1) * p;
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, n - 1);
  const double part = place - static_cast<double>(below);
  Estimate quantile{.value = rising[below] + part * (rising[above] - rising[below])};
  // P(B < l) <= 0.025 for the largest l with P(B <= l - 1) <= 0.025, which is the smallest k with
  // P(B <= k) > 0.025; P(B <= u - 1) >= 0.975 for u one above such a k.
  constexpr double kTail = 0.025;
  const std::size_t l = binomial_quantile(n, p, std::nextafter(kTail, 1.0));
  const std::size_t u = binomial_quantile(n, p, 1.0 - kTail) + 1;
  quantile.from = l >= 1 ? rising[l - 1] : kNaN;
  quantile.to = u <= n ? rising[u - 1] : kNaN;
  return quantile;
}

Estimate probability_of(std::uint64_t hits, std::uint64_t n) {
  if (n == 0) {
    return {};
  }
  const auto draws = static_cast<double>(n);
  const double q = static_cast<double>(hits) / draws;
  const double middle = q + kZ * kZ / (2.0 * draws);
  const double half = kZ * std::sqrt(q * (1.0 - q) / draws + kZ * kZ / (4.0 * draws * draws));
  const double scale = 1.0 + kZ * kZ / draws;
  return {q, std::max(0.0, (middle - half) / scale), std::min(1.0, (middle + half) / scale)};
}

Estimate pearson(std::span<const double> x, std::span<const double> y) {
  return correlation(x, y, 1.0);
}

Estimate spearman(std::span<const double> x, std::span<const double> y) {
  return correlation(ranks_of(x), ranks_of(y), 1.06);
}

std::vector<double> ranks_of(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin + 1;
    while (end < order.size() && values[order[end]] == values[order[begin]]) {
      ++end;
    }
    for (std::size_t i = begin; i < end; ++i) {
      ranks[order[i]] = static_cast<double>(begin + 1 + end) / 2.0;
    }
    begin = end;
  }
  return ranks;
}

std::vector<std::size_t> growing_parts(std::size_t n, std::size_t least) {
  std::vector<std::size_t> parts;
  for (const std::size_t share : {8U, 4U, 2U}) {
    if (n / share >= least) {
      parts.push_back(n / share);
    }
  }
  parts.push_back(n);
  return parts;
}

}  // namespace oblique::client
