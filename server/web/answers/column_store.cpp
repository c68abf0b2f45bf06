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
/// A small study may be solved while one looks: as often as takes a tenth of a processor, within
/// these.
constexpr std::uint64_t kSmall = 65'536;
constexpr int kPausesOfReading = 9;
constexpr std::chrono::milliseconds kLookOftenest{5};
constexpr std::chrono::milliseconds kLookOften{50};
/// Who waits for another to read it asks so often whether its time is over.
constexpr std::chrono::milliseconds kAskEvery{50};
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

std::vector<std::uint64_t> failed_points(sqlite3* database, std::uint64_t study,
                                         std::uint64_t end) {
  Statement rows(
      database,
      "SELECT point FROM packed_results INDEXED BY failed_points WHERE study_id = ?1 AND "
      "error IS NOT NULL AND point < ?2 ORDER BY point LIMIT ?3");
  rows.bind(1, study);
  rows.bind(2, end);
  rows.bind(3, kMostFailed);
  std::vector<std::uint64_t> points;
  while (rows.step()) {
    points.push_back(static_cast<std::uint64_t>(rows.integer(0)));
  }
  return points;
}

/// Points that are in one of them and not in both, a run each; both rising.
std::vector<PointRun> runs_of_either(const std::vector<std::uint64_t>& one,
                                     const std::vector<std::uint64_t>& other) {
  std::vector<std::uint64_t> points;
  std::ranges::set_symmetric_difference(one, other, std::back_inserter(points));
  std::vector<PointRun> runs;
  for (const std::uint64_t point : points) {
    runs.push_back({point, point + 1});
  }
  return runs;
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

std::vector<PointRun> united(const std::vector<PointRun>& one, const std::vector<PointRun>& other) {
  std::vector<PointRun> all;
  all.reserve(one.size() + other.size());
  std::ranges::merge(one, other, std::back_inserter(all), {}, &PointRun::begin, &PointRun::begin);
  std::vector<PointRun> joined;
  for (const PointRun& run : all) {
    if (!joined.empty() && run.begin <= joined.back().end) {
      joined.back().end = std::max(joined.back().end, run.end);
    } else {
      joined.push_back(run);
    }
  }
  return joined;
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
  while (!held.try_lock_until(std::chrono::system_clock::now() + kAskEvery)) {
    if (is_over()) {
      throw StorageError("a column is being read: ask again later");
    }
  }
  follow(database, true);
}

bool StoredColumn::follow(sqlite3* database, bool may_take_long) {
  const auto now = Clock::now();
  if (!values_.empty() && now < look_again_) {
    return true;
  }
  // One state of the database for both questions and all rows.
  execute(database, "BEGIN");
  try {
    std::vector<PointRun> settled = settled_runs(database, study_, points_);
    std::vector<std::uint64_t> failed = failed_points(database, study_, points_);
    const std::vector<PointRun> gone =
        united(difference(settled_, settled), runs_of_either(failed_, failed));
    std::vector<PointRun> come = difference(settled, difference(settled_, gone));
    if (!may_take_long && points_in(come) > kMostAtOnce) {
      execute(database, "COMMIT");
      return false;
    }
    forget_runs(gone);
    failed_ = std::move(failed);
    read_runs(database, come);
    execute(database, "COMMIT");
    const auto read_at = Clock::now();
    look_again_ = points_ > kSmall
                      ? now + kLookEvery
                      : read_at + std::clamp<Clock::duration>(kPausesOfReading * (read_at - now),
                                                              kLookOftenest, kLookOften);
  } catch (...) {
    sqlite3_exec(database, "ROLLBACK", nullptr, nullptr, nullptr);
    throw;
  }
  return true;
}

void StoredColumn::forget_runs(const std::vector<PointRun>& runs) {
  look_again_ = {};
  values_.resize(points_, no_result());
  for (const PointRun& run : runs) {
    std::fill(values_.begin() + static_cast<std::ptrdiff_t>(run.begin),
              values_.begin() + static_cast<std::ptrdiff_t>(run.end), no_result());
  }
  settled_ = difference(settled_, runs);
}

void StoredColumn::read_runs(sqlite3* database, const std::vector<PointRun>& runs) {
  std::vector<PointRun> read;
  const auto record = [&] {
    settled_ = united(settled_, read);
    points_read_ = points_in(settled_);
  };
  try {
    ColumnReader reader(database, study_, source_);
    for (const PointRun& run : runs) {
      read.push_back({run.begin, run.begin});
      reader.read(run.begin, run.end - 1, [&](std::uint64_t point, float value) {
        values_.at(point) = value;
        read.back().end = point + 1;
      });
      read.back().end = run.end;
    }
  } catch (...) {
    std::erase_if(read, [](const PointRun& run) { return run.begin == run.end; });
    record();
    throw;
  }
  record();
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

/// The column, which is among those that are kept from now on: its memory counts.
ColumnStore::Shared ColumnStore::known_or_new(const Wish& wish) {
  const std::lock_guard lock(mutex_);
  if (Shared column = known(wish.study, wish.source, wish.points)) {
    return column;
  }
  kept_.push_front(std::make_shared<StoredColumn>(wish.study, wish.source, wish.points));
  const Shared made = kept_.front();
  std::size_t bytes = 0;
  for (auto kept = kept_.begin(); kept != kept_.end();) {
    bytes += (*kept)->bytes();
    kept = bytes > kMostBytes ? kept_.erase(kept) : std::next(kept);
  }
  return made;
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
  want({study, source, points});
  return nullptr;
}

void ColumnStore::want(const Wish& wish) {
  constexpr std::size_t kMostWishes = 8;
  const std::lock_guard lock(mutex_);
  const bool is_wanted = std::ranges::any_of(wished_, [&](const Wish& known) {
    return known.study == wish.study && known.points == wish.points &&
           known.source.name == wish.source.name;
  });
  if (wished_.size() < kMostWishes && !is_wanted) {
    wished_.push_back(wish);
  }
}

ColumnStore::Shared ColumnStore::read(sqlite3* database, std::uint64_t study,
                                      const ColumnSource& source, std::uint64_t points,
                                      const std::function<bool()>& is_over) {
  if (points > kMostPoints) {
    return nullptr;
  }
  const Wish wish{study, source, points};
  Shared column = known_or_new(wish);
  try {
    column->read(database, is_over);
  } catch (const StorageError&) {
    want(wish);
    throw;
  }
  return column;
}

bool ColumnStore::has_wishes() const {
  const std::lock_guard lock(mutex_);
  return !wished_.empty();
}

void ColumnStore::fill_one(sqlite3* database, const std::function<bool()>& is_over) {
  std::optional<Wish> wish;
  {
    const std::lock_guard lock(mutex_);
    if (wished_.empty()) {
      return;
    }
    wish = std::move(wished_.front());
    wished_.pop_front();
  }
  const Shared column = known_or_new(*wish);
  const std::uint64_t before = column->points_read();
  try {
    column->read(database, is_over);
  } catch (const StorageError&) {
    if (column->points_read() > before) {
      want(*wish);
    }  // else pictures go on reading by key
  }
}

}  // namespace oblique::server
