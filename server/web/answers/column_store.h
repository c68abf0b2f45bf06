#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <sqlite3.h>

#include "server/web/answers/column_source.h"

namespace oblique::server {

/// Points that follow each other, the end out.
struct PointRun {
  std::uint64_t begin;
  std::uint64_t end;

  bool operator==(const PointRun&) const = default;
};

/// A column of a study, whole: a float32 a point.
class StoredColumn {
 public:
  StoredColumn(std::uint64_t study, ColumnSource source, std::uint64_t points);

  std::uint64_t study() const { return study_; }
  std::uint64_t points() const { return points_; }
  const ColumnSource& source() const { return source_; }
  std::size_t bytes() const { return points_ * sizeof(float); }

  /// Makes it what the database holds now, by which points have come and gone since the last time,
  /// not oftener than twice a second, of a small study 20 times, or as often as takes a tenth of a
  /// processor. False: it has too much to do to be waited for.
  bool bring_up_to_date(sqlite3* database);
  /// How many points were read when reading ended the last time.
  std::uint64_t points_read() const { return points_read_; }
  /// The same, however long it takes. Throws StorageError when `is_over` while another reads it;
  /// while it is read here, SQLite looks at that. What was read until then is not read again.
  void read(sqlite3* database, const std::function<bool()>& is_over);
  /// What it has of these points, in their order.
  void gather(std::span<const std::uint64_t> points, std::vector<float>& into);
  /// The values of so many points from `first` on, as far as there are any.
  std::vector<float> part(std::uint64_t first, std::size_t count);

 private:
  using Clock = std::chrono::steady_clock;
  bool follow(sqlite3* database, bool may_take_long);
  void read_runs(sqlite3* database, const std::vector<PointRun>& runs);
  void forget_runs(const std::vector<PointRun>& runs);

  const std::uint64_t study_;
  const ColumnSource source_;
  const std::uint64_t points_;
  std::atomic<std::uint64_t> points_read_ = 0;
  std::timed_mutex mutex_;
  std::vector<float> values_;          // guarded by mutex_
  std::vector<PointRun> settled_;      // guarded by mutex_: what was read; the rest is no_result()
  std::vector<std::uint64_t> failed_;  // guarded by mutex_: of these, the first so many that failed
  Clock::time_point look_again_{};     // guarded by mutex_: it was whole, and holds until then
};

/// Runs of points that are in `of` and not in `without`; both rising and apart.
std::vector<PointRun> difference(const std::vector<PointRun>& of,
                                 const std::vector<PointRun>& without);

/// Runs of points that are in one of them, or in both; all rising and apart.
std::vector<PointRun> united(const std::vector<PointRun>& one, const std::vector<PointRun>& other);

/// Runs of settled points, rising, that have points from `first` to `last`, both in. Nothing: there
/// are so many that finding them helps nobody.
std::optional<std::vector<PointRun>> settled_between(sqlite3* database, std::uint64_t study,
                                                     std::uint64_t first, std::uint64_t last);

/// Columns that were looked at last, as far as a bound on memory goes. One that is wanted is read
/// when nobody waits; meanwhile pictures read their rows by key.
class ColumnStore {
 public:
  using Shared = std::shared_ptr<StoredColumn>;

  /// The column, whole and as the database has it now. Null: not yet, or never, because the study
  /// is too large.
  Shared find(sqlite3* database, std::uint64_t study, const ColumnSource& source,
              std::uint64_t points);
  /// The same at once, however long it takes; null: the study is too large. What is interrupted,
  /// which throws StorageError, is wanted and read on, so that who asks again later has it.
  Shared read(sqlite3* database, std::uint64_t study, const ColumnSource& source,
              std::uint64_t points, const std::function<bool()>& is_over);

  bool has_wishes() const;
  /// Reads a column that is wanted. What is interrupted is wanted still, as long as each time
  /// brings it further.
  void fill_one(sqlite3* database, const std::function<bool()>& is_over);

  /// Studies with more points are never read whole.
  static constexpr std::uint64_t kMostPoints = 32'000'000;

 private:
  /// A picture is of three columns at most.
  static constexpr std::size_t kMostBytes = 3 * kMostPoints * sizeof(float);

  /// Whose column is kept as far as there is room, so that a wish itself holds nothing.
  struct Wish {
    std::uint64_t study;
    ColumnSource source;
    std::uint64_t points;
  };

  Shared known(std::uint64_t study, const ColumnSource& source, std::uint64_t points);
  Shared known_or_new(const Wish& wish);
  void want(const Wish& wish);

  mutable std::mutex mutex_;
  // Guarded by mutex_; the one looked at last comes first. Those too that are being read.
  std::list<Shared> kept_;
  std::deque<Wish> wished_;  // guarded by mutex_
};

}  // namespace oblique::server
