#include "server/web/answers/result_sample.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "server/database/sqlite.h"
#include "server/web/answers/answer_pool.h"

namespace oblique::server {
namespace {

std::vector<PointRun> settled_runs_of(sqlite3* database, std::uint64_t study) {
  constexpr std::uint64_t kMostRuns = 4'000'000;
  Statement rows(database,
                 "SELECT first_point, points FROM settled_points WHERE study_id = ?1 "
                 "ORDER BY first_point LIMIT ?2");
  rows.bind(1, study);
  rows.bind(2, kMostRuns + 1);
  std::vector<PointRun> runs;
  while (rows.step()) {
    const auto first = static_cast<std::uint64_t>(rows.integer(0));
    runs.push_back({first, first + static_cast<std::uint64_t>(rows.integer(1))});
  }
  if (runs.size() > kMostRuns) {
    throw std::invalid_argument(fmt::format(
        "results of the study lie too far apart for bins: in more than {} runs", kMostRuns));
  }
  return runs;
}

/// Mixes the bits of a number (D. Lehmer's and G. Steele's splitmix64).
std::uint64_t mixed(std::uint64_t number) {
  number += 0x9e3779b97f4a7c15U;
  number = (number ^ (number >> 30U)) * 0xbf58476d1ce4e5b9U;
  number = (number ^ (number >> 27U)) * 0x94d049bb133111ebU;
  return number ^ (number >> 31U);
}

std::uint64_t points_of(const std::vector<PointRun>& runs) {
  std::uint64_t points = 0;
  for (const PointRun& run : runs) {
    points += run.end - run.begin;
  }
  return points;
}

Statement rows_of(sqlite3* database, std::span<const ColumnSource> sources) {
  std::string columns;
  bool has_models = false;
  for (const ColumnSource& source : sources) {
    columns += ", " + source.sql;
    has_models = has_models || source.is_of_model;
  }
  return {database,
          fmt::format("SELECT p.point, p.error IS NOT NULL{} FROM packed_results AS p{} "
                      "WHERE p.study_id = ?1 AND p.point BETWEEN ?2 AND ?3",
                      columns, has_models ? " JOIN models AS m ON m.model_id = p.model_id" : "")};
}

/// Points that failed: so many, or that many and more.
std::uint64_t failed_of(sqlite3* database, std::uint64_t study) {
  Statement count(database,
                  "SELECT count(*) FROM (SELECT 1 FROM packed_results INDEXED BY failed_points "
                  "WHERE study_id = ?1 AND error IS NOT NULL LIMIT 10000)");
  count.bind(1, study);
  count.step();
  return static_cast<std::uint64_t>(count.integer(0));
}

ResultSample sample_results(const AnswerDesk& desk, std::uint64_t study,
                            std::span<const ColumnSource> sources,
                            const std::vector<PointRun>& settled) {
  ResultSample sample;
  sample.of = points_of(settled);
  sample.columns.resize(sources.size());
  Statement rows = rows_of(desk.database, sources);
  for (const PointRun& run : sampled_runs(settled, ResultSample::kMost)) {
    rows.reset();
    rows.bind(1, study);
    rows.bind(2, run.begin);
    rows.bind(3, run.end - 1);
    while (rows.step()) {
      desk.end_in_time(sample.points.size());
      sample.points.push_back(static_cast<std::uint64_t>(rows.integer(0)));
      const bool has_failed = rows.integer(1) != 0;
      for (std::size_t i = 0; i < sources.size(); ++i) {
        const int column = static_cast<int>(i) + 2;
        sample.columns[i].push_back(
            has_failed             ? failed_point()
            : rows.is_null(column) ? no_value()
                                   : static_cast<float>(rows.real(column) / sources[i].per_unit));
      }
    }
  }
  return sample;
}

}  // namespace

std::vector<PointRun> sampled_runs(const std::vector<PointRun>& runs, std::uint64_t most) {
  constexpr std::uint64_t kLong = 1024;  // one place in the file a run
  const std::uint64_t all = points_of(runs);
  if (all <= most) {
    return runs;
  }
  const std::uint64_t parts = std::max<std::uint64_t>(most / kLong, 1);
  const std::uint64_t each = all / parts;
  const std::uint64_t length = std::min(kLong, each);
  std::vector<PointRun> taken;
  auto run = runs.begin();
  std::uint64_t before = 0;  // points in front of `run`
  for (std::uint64_t part = 0; part < parts; ++part) {
    std::uint64_t from = part * each + mixed(part) % (each - length + 1);
    for (std::uint64_t left = length; left > 0;) {
      while (from - before >= run->end - run->begin) {
        before += run->end - run->begin;
        ++run;
      }
      const std::uint64_t begin = run->begin + (from - before);
      const std::uint64_t here = std::min(left, run->end - begin);
      taken.push_back({begin, begin + here});
      from += here;
      left -= here;
    }
  }
  return taken;
}

SampleBook::Shared SampleBook::sample(const AnswerDesk& desk, std::uint64_t study,
                                      std::span<const ColumnSource> sources) {
  constexpr std::size_t kMostSamples = 4;
  constexpr int kTimes = 9;
  constexpr Clock::duration kLongestUse = std::chrono::minutes(1);
  const auto begun = Clock::now();
  Kept now{study, {}, 0, {}, nullptr};
  for (const ColumnSource& source : sources) {
    now.columns.push_back(source.name);
  }
  const auto is_it = [&now](const Kept& kept) {
    return kept.study == now.study && kept.columns == now.columns;
  };
  std::optional<Kept> last;
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(kept_.begin(), kept_.end(), is_it);
    last = found == kept_.end() ? std::nullopt : std::optional(*found);
  }
  if (last && begun < last->until) {
    return last->sample;
  }
  const std::vector<PointRun> settled = settled_runs_of(desk.database, study);
  now.failed = failed_of(desk.database, study);
  const bool is_same = last && last->sample->of == points_of(settled) && last->failed == now.failed;
  now.sample =
      is_same ? last->sample
              : std::make_shared<const ResultSample>(sample_results(desk, study, sources, settled));
  const auto read = Clock::now();
  now.until = read + std::min<Clock::duration>(kTimes * (read - begun), kLongestUse);
  const std::lock_guard lock(mutex_);
  kept_.remove_if(is_it);
  kept_.push_front(now);
  kept_.resize(std::min(kept_.size(), kMostSamples));
  return now.sample;
}

}  // namespace oblique::server
