#include "server/web/answers/column_store.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

constexpr std::chrono::milliseconds kLookEvery{500};
/// Of small studies, that may be solved while one looks.
constexpr std::chrono::milliseconds kLookOften{50};
constexpr std::uint64_t kSmall = 65'536;
/// Reading so many rows is not waited for.
constexpr std::uint64_t kMostAtOnce = 50'000;
/// Points that failed are looked up again, for they may be solved later: the first so many.
constexpr std::int64_t kMostFailed = 10'000;

std::vector<PointRun> settled_runs(sqlite3* database, std::uint64_t study, std::uint64_t points) {
  Statement rows(database,
                 "SELECT first_point, points FROM settled_points WHERE study_id = ?1 "
                 "ORDER BY first_point");
  rows.bind(1, study);
  std::vector<PointRun> runs;
  while (rows.step()) {
    const auto first = static_cast<std::uint64_t>(rows.integer(0));
    const auto end = std::min(first + static_cast<std::uint64_t>(rows.integer(1)), points);
    if (first < end) {
      runs.push_back({first, end});
    }
  }
  return runs;
}

std::vector<std::uint64_t> failed_points(sqlite3* database, std::uint64_t study) {
  Statement rows(
      database,
      "SELECT point FROM packed_results INDEXED BY failed_points WHERE study_id = ?1 AND "
      "error IS NOT NULL "
      "ORDER BY point LIMIT ?2");
  rows.bind(1, study);
  rows.bind(2, kMostFailed);
  std::vector<std::uint64_t> points;
  while (rows.step()) {
    points.push_back(static_cast<std::uint64_t>(rows.integer(0)));
  }
  return points;
}

std::uint64_t points_in(const std::vector<PointRun>& runs) {
  std::uint64_t points = 0;
  for (const PointRun& run : runs) {
    points += run.end - run.begin;
  }
  return points;
}

}  // namespace

std::vector<PointRun> difference(const std::vector<PointRun>& of,
                                 const std::vector<PointRun>& without) {
  std::vector<PointRun> left;
  auto taken = without.begin();
  for (PointRun run : of) {
    while (taken != without.end() && taken->end <= run.begin) {
      ++taken;
    }
    for (auto next = taken; next != without.end() && next->begin < run.end; ++next) {
      if (next->begin > run.begin) {
        left.push_back({run.begin, next->begin});
      }
      run.begin = std::min(std::max(run.begin, next->end), run.end);
    }
    if (run.begin < run.end) {
      left.push_back(run);
    }
  }
  return left;
}

std::optional<std::vector<PointRun>> settled_between(sqlite3* database, std::uint64_t study,
                                                     std::uint64_t first, std::uint64_t last) {
  constexpr std::size_t kMostRuns = 20'000;
  Statement rows(database,
                 "SELECT first_point, points FROM settled_points WHERE study_id = ?1 AND "
                 "first_point <= ?3 AND first_point >= coalesce((SELECT max(first_point) FROM "
                 "settled_points WHERE study_id = ?1 AND first_point <= ?2), 0) "
                 "ORDER BY first_point LIMIT ?4");
  rows.bind(1, study);
  rows.bind(2, first);
  rows.bind(3, last);
  rows.bind(4, static_cast<std::uint64_t>(kMostRuns));
  std::vector<PointRun> runs;
  while (rows.step()) {
    const auto begin = static_cast<std::uint64_t>(rows.integer(0));
    runs.push_back({begin, begin + static_cast<std::uint64_t>(rows.integer(1))});
  }
  return runs.size() < kMostRuns ? std::optional(std::move(runs)) : std::nullopt;
}

StoredColumn::StoredColumn(std::uint64_t study, ColumnSource source, std::uint64_t points)
    : study_(study), source_(std::move(source)), points_(points) {}

bool StoredColumn::bring_up_to_date(sqlite3* database) {
  const std::unique_lock held(mutex_, std::try_to_lock);
  return held.owns_lock() && follow(database, false);
}

void StoredColumn::read(sqlite3* database, const std::function<bool()>& is_over) {
  std::unique_lock held(mutex_, std::defer_lock);
  // Until an instant of the system's clock: the thread sanitizer knows of no others.
  while (!held.try_lock_until(std::chrono::system_clock::now() + kLookOften)) {
    if (is_over()) {
      throw StorageError("a column is being read: ask again later");
    }
  }
  follow(database, true);
}

bool StoredColumn::follow(sqlite3* database, bool may_take_long) {
  const auto now = Clock::now();
  if (!values_.empty() && now - looked_ < (points_ <= kSmall ? kLookOften : kLookEvery)) {
    return true;
  }
  // One state of the database for both questions and all rows.
  execute(database, "BEGIN");
  try {
    std::vector<PointRun> settled = settled_runs(database, study_, points_);
    std::vector<std::uint64_t> failed = failed_points(database, study_);
    std::vector<PointRun> come = difference(settled, settled_);
    if (!may_take_long && points_in(come) > kMostAtOnce) {
      execute(database, "COMMIT");
      return false;
    }
    if (values_.empty() || settled_.empty()) {  // nothing is known of them
      values_.assign(points_, no_result());
    }
    for (const PointRun& run : difference(settled_, settled)) {
      std::fill(values_.begin() + static_cast<std::ptrdiff_t>(run.begin),
                values_.begin() + static_cast<std::ptrdiff_t>(run.end), no_result());
    }
    std::vector<std::uint64_t> changed;
    std::set_symmetric_difference(failed_.begin(), failed_.end(), failed.begin(), failed.end(),
                                  std::back_inserter(changed));
    for (const std::uint64_t point : changed) {
      come.push_back({point, point + 1});
    }
    settled_.clear();  // should reading end early, all of it is read anew
    read_runs(database, come);
    settled_ = std::move(settled);
    failed_ = std::move(failed);
    looked_ = now;
    execute(database, "COMMIT");
  } catch (...) {
    sqlite3_exec(database, "ROLLBACK", nullptr, nullptr, nullptr);
    throw;
  }
  return true;
}

void StoredColumn::read_runs(sqlite3* database, const std::vector<PointRun>& runs) {
  ColumnReader reader(database, study_, source_);
  for (const PointRun& run : runs) {
    reader.read(run.begin, run.end - 1,
                [this](std::uint64_t point, float value) { values_.at(point) = value; });
  }
}

void StoredColumn::gather(std::span<const std::uint64_t> points, std::vector<float>& into) {
  const std::lock_guard lock(mutex_);
  into.resize(points.size());
  std::transform(points.begin(), points.end(), into.begin(),
                 [this](std::uint64_t point) { return values_.at(point); });
}

std::vector<float> StoredColumn::part(std::uint64_t first, std::size_t count) {
  const std::lock_guard lock(mutex_);
  const std::size_t begin = std::min<std::size_t>(first, values_.size());
  const std::size_t end = std::min(begin + count, values_.size());
  return {values_.begin() + static_cast<std::ptrdiff_t>(begin),
          values_.begin() + static_cast<std::ptrdiff_t>(end)};
}

ColumnStore::Shared ColumnStore::known(std::uint64_t study, const ColumnSource& source,
                                       std::uint64_t points) {
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Shared& column) {
    return column->study() == study && column->points() == points &&
           column->source().name == source.name;
  });
  if (found == kept_.end()) {
    return nullptr;
  }
  kept_.splice(kept_.begin(), kept_, found);
  return kept_.front();
}

void ColumnStore::keep(const Shared& column) {
  const std::lock_guard lock(mutex_);
  if (known(column->study(), column->source(), column->points())) {
    return;
  }
  kept_.push_front(column);
  std::size_t bytes = 0;
  for (auto kept = kept_.begin(); kept != kept_.end();) {
    bytes += (*kept)->bytes();
    kept = bytes > kMostBytes ? kept_.erase(kept) : std::next(kept);
  }
}

ColumnStore::Shared ColumnStore::find(sqlite3* database, std::uint64_t study,
                                      const ColumnSource& source, std::uint64_t points) {
  if (points > kMostPoints) {
    return nullptr;
  }
  Shared column;
  {
    const std::lock_guard lock(mutex_);
    column = known(study, source, points);
  }
  if (column && column->bring_up_to_date(database)) {
    return column;
  }
  want(column ? column : std::make_shared<StoredColumn>(study, source, points));
  return nullptr;
}

ColumnStore::Shared ColumnStore::wanted(std::uint64_t study, const ColumnSource& source,
                                        std::uint64_t points) const {
  const auto is_it = [&](const Shared& wished) {
    return wished && wished->study() == study && wished->points() == points &&
           wished->source().name == source.name;
  };
  const auto found = std::find_if(wished_.begin(), wished_.end(), is_it);
  return is_it(under_way_) ? under_way_ : found != wished_.end() ? *found : nullptr;
}

void ColumnStore::want(const Shared& column) {
  constexpr std::size_t kMostWishes = 8;
  const std::lock_guard lock(mutex_);
  if (wished_.size() < kMostWishes &&
      !wanted(column->study(), column->source(), column->points())) {
    wished_.push_back(column);
  }
}

ColumnStore::Shared ColumnStore::read(sqlite3* database, std::uint64_t study,
                                      const ColumnSource& source, std::uint64_t points,
                                      const std::function<bool()>& is_over) {
  if (points > kMostPoints) {
    return nullptr;
  }
  Shared column;
  {
    const std::lock_guard lock(mutex_);
    column = known(study, source, points);
    column = column ? column : wanted(study, source, points);
  }
  if (!column) {
    column = std::make_shared<StoredColumn>(study, source, points);
  }
  try {
    column->read(database, is_over);
  } catch (const StorageError&) {
    want(column);
    throw;
  }
  keep(column);
  return column;
}

bool ColumnStore::has_wishes() const {
  const std::lock_guard lock(mutex_);
  return !wished_.empty();
}

void ColumnStore::fill_one(sqlite3* database, const std::function<bool()>& is_over) {
  Shared column;
  {
    const std::lock_guard lock(mutex_);
    if (wished_.empty()) {
      return;
    }
    column = std::move(wished_.front());
    wished_.pop_front();
    under_way_ = column;
  }
  try {
    column->read(database, is_over);
    keep(column);
  } catch (const StorageError&) {
    // It took too long, or the server ends: pictures go on reading by key.
  }
  const std::lock_guard lock(mutex_);
  under_way_.reset();
}

}  // namespace oblique::server
