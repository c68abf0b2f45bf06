#include "client/explore/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include <Eigen/Core>

namespace oblique::client {
namespace {

/// The 97.5 % quantile of the standard normal distribution.
constexpr double kZ = 1.959963984540054;

/// Differences from the mean, exactly 0 for constant values, whose mean may be rounded.
Eigen::ArrayXd deviations(std::span<const double> values) {
  const Eigen::Map<const Eigen::ArrayXd> x(values.data(), std::ssize(values));
  return x - ((x == x[0]).all() ? x[0] : x.mean());
}

/// The smallest k with P(B <= k) >= `share`, for B binomial of n draws with probability p.
std::size_t binomial_quantile(std::size_t n, double p, double share) {
  const auto draws = static_cast<double>(n);
  double sum = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const auto hits = static_cast<double>(k);
    sum += std::exp(std::lgamma(draws + 1.0) - std::lgamma(hits + 1.0) -
                    std::lgamma(draws - hits + 1.0) + hits * std::log(p) +
                    (draws - hits) * std::log1p(-p));
    if (sum >= share) {
      return k;
    }
  }
  return n;
}

}  // namespace

Estimate mean_of(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  const double half = kZ * deviation_of(values) / std::sqrt(n);
  return {mean, mean - half, mean + half};
}

double deviation_of(std::span<const double> values) {
  return values.size() < 2 ? kNaN
                           : std::sqrt(deviations(values).square().sum() /
                                       static_cast<double>(values.size() - 1));
}

Estimate quantile_of(std::span<const double> ascending, double p) {
  const std::size_t n = ascending.size();
  if (n == 0) {
    return {};
  }
  const double place = static_cast<double>(n - 1) * p;
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, n - 1);
  // P(B < l) <= 0.025 for the largest l with P(B <= l - 1) <= 0.025, which is the smallest k with
  // P(B <= k) > 0.025; P(B <= u - 1) >= 0.975 for u one above such a k.
  constexpr double kTail = 0.025;
  const std::size_t l = binomial_quantile(n, p, std::nextafter(kTail, 1.0));
  const std::size_t u = binomial_quantile(n, p, 1.0 - kTail) + 1;
  return {std::lerp(ascending[below], ascending[above], place - static_cast<double>(below)),
          l >= 1 ? ascending[l - 1] : kNaN, u <= n ? ascending[u - 1] : kNaN};
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

Estimate correlation_of(std::span<const double> x, std::span<const double> y) {
  if (x.size() < 4) {
    return {};
  }
  const Eigen::ArrayXd dx = deviations(x);
  const Eigen::ArrayXd dy = deviations(y);
  const double norms = std::sqrt(dx.square().sum() * dy.square().sum());
  if (!(norms > 0.0)) {
    return {};
  }
  const double r = std::clamp((dx * dy).sum() / norms, -1.0, 1.0);
  const double half = kZ / std::sqrt(static_cast<double>(x.size() - 3));
  return {r, std::tanh(std::atanh(r) - half), std::tanh(std::atanh(r) + half)};
}

}  // namespace oblique::client
