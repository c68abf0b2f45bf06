#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace oblique::server {

/// How often amounts of which size came. Not thread-safe.
class Histogram {
 public:
  /// `bounds` ascend; each is the largest amount of its class, and what is above them all is a
  /// class of its own.
  explicit Histogram(std::vector<double> bounds)
      : bounds_(std::move(bounds)), counts_(bounds_.size() + 1) {}

  void observe(double amount) {
    const auto at = std::lower_bound(bounds_.begin(), bounds_.end(), amount) - bounds_.begin();
    ++counts_[static_cast<std::size_t>(at)];
    sum_ += amount;
  }

  const std::vector<double>& bounds() const { return bounds_; }
  /// By class, one more than there are bounds.
  const std::vector<std::uint64_t>& counts() const { return counts_; }
  double sum() const { return sum_; }

 private:
  std::vector<double> bounds_;
  std::vector<std::uint64_t> counts_;
  double sum_ = 0.0;
};

}  // namespace oblique::server
