#include "client/explore/uncertainty.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

#include <Eigen/Core>

namespace oblique::client {
namespace {

/// The 97.5 % quantile of the standard normal distribution.
constexpr double kZ = 1.959963984540054;

/// Differences from the mean, exactly 0 for values that differ only by rounding errors.
Eigen::ArrayXd deviations(std::span<const double> values) {
  const Eigen::Map<const Eigen::ArrayXd> x(values.data(), std::ssize(values));
  const bool varies = x.maxCoeff() - x.minCoeff() > kRounding * x.abs().maxCoeff();
  return varies ? Eigen::ArrayXd(x - x.mean()) : Eigen::ArrayXd::Zero(x.size());
}

/// The probability of k hits in n draws that hit with probability p.
double binomial_probability(double n, double k, double p) {
  return std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) +
                  k * std::log(p) + (n - k) * std::log1p(-p));
}

}  // namespace

// From five degrees of freedom on, the expansion z + g_1/n + ... + g_4/n^4 with its coefficients at
// z = 1.96: M. Abramowitz and I. A. Stegun, Handbook of Mathematical Functions (1964), 26.7.5. Its
// relative error is below 1.1e-4.
double t_quantile(std::uint64_t degrees) {
  constexpr std::array kFew{12.7062047, 4.3026527, 3.1824463, 2.7764451};
  const auto n = static_cast<double>(degrees);
  return degrees <= kFew.size()
             ? kFew.at(degrees - 1)
             : kZ + (2.3722712 + (2.8224986 + (2.5558497 + 1.5895341 / n) / n) / n) / n;
}

Estimate mean_of(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  const double half = values.size() < 2
                          ? kNaN
                          : t_quantile(values.size() - 1) * deviation_of(values) / std::sqrt(n);
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
  std::size_t l = 0;
  std::size_t u = 1;
  double sum = 0.0;  // P(B <= k)
  for (std::size_t k = 0; k < n && sum < 0.975; ++k) {
    sum += binomial_probability(static_cast<double>(n), static_cast<double>(k), p);
    l += sum <= 0.025 ? 1 : 0;
    u += sum < 0.975 ? 1 : 0;
  }
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
