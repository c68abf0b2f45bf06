#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/web/answers/answer_pool.h"
#include "server/web/answers/point_set.h"
#include "server/web/http/http_message.h"
#include "server/web/page/talks.h"

namespace oblique::server {

/// A picture of the points that meet a condition.
struct FilteredPicture {
  AnswerPool::Job first;       ///< judges what is asked
  std::function<Talk()> then;  ///< finds the points, and makes the picture
};

/// Which points meet a condition: asked of the service as `oblique query` would, so that a reader
/// process evaluates what people wrote, and kept for the next picture while the study has the same
/// results. Of the HTTP server's thread.
class PointFilters {
 public:
  FilteredPicture begin(std::uint64_t study, const HttpQuestion& question, bool is_slice);

  /// What nobody has asked for so long ends.
  static constexpr std::chrono::seconds kWaitedFor{10};

 private:
  using Clock = std::chrono::steady_clock;
  using Shared = std::shared_ptr<const PointSet>;
  /// Of which state of a study.
  struct Asked {
    std::uint64_t study;
    std::string condition;
    std::uint64_t solved = 0;
    std::uint64_t failed = 0;

    bool operator==(const Asked&) const = default;
  };
  struct Kept {
    Asked asked;
    Shared points;
    Clock::time_point until;  ///< also when the study has other results: it took so long
  };
  struct Coming;

  Talk talk(std::uint64_t study, std::string condition, std::string narrowed, std::uint64_t request,
            std::function<AnswerPool::Job(Shared)> picture);
  Shared find(const Asked& asked);
  std::shared_ptr<Coming> under_way(const Asked& asked);
  void keep(const Coming& coming);

  /// Why a condition that takes long has no answer.
  struct Fault {
    Asked asked;
    HttpAnswer answer;
    Clock::time_point until;
  };
  std::optional<HttpAnswer> fault_of(const Asked& asked);

  std::vector<Fault> faults_;
  std::list<Kept> kept_;                        // that looked at last comes first
  std::vector<std::weak_ptr<Coming>> comings_;  // those whose talks have ended are gone
};

}  // namespace oblique::server
