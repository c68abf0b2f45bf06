#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>

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

 private:
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
  };
  struct Coming;

  Talk talk(std::uint64_t study, std::string condition, std::string narrowed, std::uint64_t request,
            std::function<AnswerPool::Job(Shared)> picture);
  Shared find(const Asked& asked);
  void keep(const Asked& asked, Shared points);

  std::list<Kept> kept_;  // that looked at last comes first
};

}  // namespace oblique::server
