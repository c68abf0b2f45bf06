#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/axes.h"
#include "server/store/known/work.h"

namespace oblique::server {

/// Which of its values an axis has where. Of a range by its ends, of listed values by a table.
class AxisInverse {
 public:
  /// `axis` has listed values or is a range, and must outlive this.
  explicit AxisInverse(const protocol::Axis& axis);

  /// The number of the value with these bits; nothing when the axis does not have it.
  std::optional<std::uint64_t> find(double value) const;

 private:
  std::optional<std::uint64_t> guess(double value) const;

  const protocol::Axis* axis_;
  std::uint64_t size_;
  std::optional<protocol::RangeValues> range_;
  std::unordered_map<std::uint64_t, std::uint64_t> listed_;  // by bits
};

/// Numbers of values of two axes that have the same bits, in the order of the first axis. Costs as
/// many numbers as the shorter one has, and the listed ones. What is not looked at when the work is
/// over is not among them.
std::vector<std::pair<std::uint64_t, std::uint64_t>> shared_values(const protocol::Axis& first,
                                                                   const protocol::Axis& second,
                                                                   Work& work);

}  // namespace oblique::server
