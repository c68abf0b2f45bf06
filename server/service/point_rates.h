#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>

namespace oblique::server {

/// Points per second over the last seconds, by study or worker. Only those whose count changed
/// lately are kept, so that the others cost nothing.
class PointRates {
 public:
  using Id = std::uint64_t;
  /// Returns how many points of a study are completed, or a worker has solved.
  using Count = std::function<std::uint64_t(Id)>;

  /// The count will change. It was `count` at all times since `since_ms`.
  void begin(Id id, std::uint64_t count, std::int64_t since_ms, std::int64_t now_ms);
  /// To be called several times a second.
  void sample(const Count& count, std::int64_t now_ms);
  void forget(Id id) { samples_.erase(id); }

  double points_per_s(Id id, std::uint64_t count, std::int64_t now_ms) const;
  /// The sum of all.
  double points_per_s(const Count& count, std::int64_t now_ms) const;

 private:
  struct Sample {
    std::int64_t at_ms;
    std::uint64_t count;
  };
  /// The first sample is the last one before the time span, or at its start.
  std::map<Id, std::deque<Sample>> samples_;
};

}  // namespace oblique::server
