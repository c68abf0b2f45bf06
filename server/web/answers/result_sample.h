#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "server/web/answers/column_source.h"
#include "server/web/answers/column_store.h"

namespace oblique::server {

struct AnswerDesk;

/// Results of a study that is too large for its columns to be held: all, or so many of them.
struct ResultSample {
  std::vector<std::uint64_t> points = {};        ///< rising
  std::vector<std::vector<float>> columns = {};  ///< a value a point, of each source
  std::uint64_t of = 0;                          ///< so many results there are

  /// 16 MiB for three columns and the points.
  static constexpr std::uint64_t kMost = std::uint64_t{1} << 20U;
};

/// Samples that were read last, for who asks again: a picture of a study that runs is asked for
/// anew all the time. Used by several threads.
class SampleBook {
 public:
  using Shared = std::shared_ptr<const ResultSample>;

  /// As the study is, or was a moment ago: samples are read in a tenth of all time at most, and
  /// used for a minute at most when there are other results. Throws StorageError when it is over,
  /// std::invalid_argument when results lie in more runs than can be held.
  Shared sample(const AnswerDesk& desk, std::uint64_t study, std::span<const ColumnSource> sources);

 private:
  using Clock = std::chrono::steady_clock;
  struct Kept {
    std::uint64_t study;
    std::vector<std::string> columns;
    std::uint64_t failed;  ///< the results of which so many failed, or more than can be counted
    Clock::time_point until;
    Shared sample;
  };

  std::mutex mutex_;
  std::list<Kept> kept_;  // guarded by mutex_; the one read last comes first
};

/// Runs of about `most` points of these, both rising and apart: short ones that lie evenly among
/// them, but with no step that axes of a grid could have too. All where they are no more.
std::vector<PointRun> sampled_runs(const std::vector<PointRun>& runs, std::uint64_t most);

}  // namespace oblique::server
