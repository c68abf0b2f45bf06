#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/web/answers/answer_pool.h"
#include "server/web/answers/column_source.h"
#include "server/web/answers/column_store.h"

namespace oblique::server {

/// Results of a study that is too large for its columns to be held: all, or so many of them.
struct ResultSample {
  std::vector<std::uint64_t> points = {};        ///< rising
  std::vector<std::vector<float>> columns = {};  ///< a value a point, of each source
  std::uint64_t of = 0;                          ///< so many results there are

  /// 16 MiB for three columns and the points.
  static constexpr std::uint64_t kMost = std::uint64_t{1} << 20U;
};

/// Reads it. Throws StorageError when it is over, std::invalid_argument when results lie in more
/// runs than can be held.
ResultSample sample_results(const AnswerDesk& desk, std::uint64_t study,
                            std::span<const ColumnSource> sources);

/// Runs of about `most` points of these, both rising and apart: short ones that lie evenly among
/// them, but with no step that axes of a grid could have too. All where they are no more.
std::vector<PointRun> sampled_runs(const std::vector<PointRun>& runs, std::uint64_t most);

}  // namespace oblique::server
