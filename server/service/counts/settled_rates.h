#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>

namespace oblique::server {

/// How fast studies are settled, over the last seconds. Only studies of which something was settled
/// lately are kept, so that resting ones cost nothing.
class SettledRates {
 public:
  using StudyId = std::uint64_t;

  /// A point of the study was settled. Before, `settled` points were, as at all times since
  /// `since_ms`.
  void note(StudyId study, std::uint64_t settled, std::int64_t since_ms, std::int64_t now_ms);
  /// To be called several times a second; `settled` tells how many points of a study are settled.
  void sample(const std::function<std::uint64_t(StudyId)>& settled, std::int64_t now_ms);
  /// Whether something of the study was settled lately.
  bool knows(StudyId study) const { return samples_.contains(study); }
  /// What was noted of the study does not count any more.
  void forget(StudyId study) { samples_.erase(study); }

  /// Points of the study settled a second; `settled` are now.
  double points_per_s(StudyId study, std::uint64_t settled, std::int64_t now_ms) const;
  /// The same of all studies together; `settled` tells how many points of each are settled.
  double points_per_s(const std::function<std::uint64_t(StudyId)>& settled,
                      std::int64_t now_ms) const;
  /// Of so many studies points were settled lately.
  std::size_t studies() const { return samples_.size(); }

 private:
  struct Sample {
    std::int64_t at_ms;
    std::uint64_t settled;
  };
  std::map<StudyId, std::deque<Sample>>
      samples_;  // the first one of before the span, or at its start
};

}  // namespace oblique::server
