#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace oblique::server {

/// Counts observed amounts by class of size. Not thread-safe.
class Histogram {
 public:
  /// `bounds` ascend. Each is the largest amount of its class; larger amounts are the last class.
  explicit Histogram(std::vector<double> bounds)
      : bounds_(std::move(bounds)), counts_(bounds_.size() + 1) {}

  void observe(double amount) {
    const auto at = std::lower_bound(bounds_.begin(), bounds_.end(), amount) - bounds_.begin();
    ++counts_[static_cast<std::size_t>(at)];
    sum_ += amount;
  }

  const std::vector<double>& bounds() const { return bounds_; }
  /// Number of amounts by class; there is one more class than bounds.
  const std::vector<std::uint64_t>& counts() const { return counts_; }
  double sum() const { return sum_; }

 private:
  std::vector<double> bounds_;
  std::vector<std::uint64_t> counts_;
  double sum_ = 0.0;
};

}  // namespace oblique::server
