#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/database/sqlite.h"
#include "server/store/known/known_points.h"
#include "server/study/study_table.h"

namespace oblique::server {

struct KnownFinderSettings {
  std::string database;                   ///< file
  std::string solver_version;             ///< of the results that may be taken
  std::uint64_t most_work = 100'000'000;  ///< numbers a study, about
  std::uint64_t chunk_points = 4096;      ///< in a report, about
  /// How long one study is sought for while others wait, at first; each further turn is twice as
  /// long, for it begins the search again with what was not found.
  std::chrono::milliseconds turn{100};
  unsigned most_turns = 4;  ///< that a search may take while others wait; then it is cut short
};

/// A study of which points are sought, those without a row.
struct KnownQuestion {
  std::uint64_t study_id;
  StudyTable table;
  std::int32_t priority = 0;
  bool is_unwanted = false;  ///< nothing is to be found any more, but its end
};

/// Points of a study that are known from another, ...
struct KnownReport {
  std::uint64_t study_id;
  std::uint64_t source_id;
  std::vector<SharedRun> runs;
  bool is_end = false;        ///< ... or that no more are sought,
  bool is_cut_short = false;  ///< for it took too long
};

/// Where points that are known are sought. This one finds none and is never asked.
class KnownSeeker {
 public:
  virtual ~KnownSeeker() = default;

  /// Whether anything can be found here.
  virtual bool can_seek() const { return false; }
  /// The study has results; with another table from now on, if it was known.
  virtual void note_source(std::uint64_t /*study_id*/, const StudyTable& /*table*/) {}
  /// It is deleted.
  virtual void drop_source(std::uint64_t /*study_id*/) {}
  /// Reports follow, the last of which is an end.
  virtual void seek(KnownQuestion /*question*/) {}
  /// A report, no end, was dealt with.
  virtual void go_on() {}
  /// The study has another priority from now on.
  virtual void set_priority(std::uint64_t /*study_id*/, std::int32_t /*priority*/) {}
  /// Nobody wants points of that study any more: its end follows soon.
  virtual void stop_seeking(std::uint64_t /*study_id*/) {}
};

/// Seeks points that other studies of the database have solved, on a thread of its own. Studies of
/// a higher priority come first, those of one priority in turns: by turns the one that had fewest,
/// the smallest first, and the one that waits the longest. Who takes reports says for each that it
/// is done with: only two are out at a time. Not thread-safe but for `note_source` and what
/// follows.
class KnownFinder final : public KnownSeeker {
 public:
  using Report = std::function<void(KnownReport)>;

  /// `report` is called on the finder's thread.
  KnownFinder(KnownFinderSettings settings, Report report);
  /// Ends what is sought; nothing is reported of it.
  ~KnownFinder() override;
  KnownFinder(const KnownFinder&) = delete;
  KnownFinder& operator=(const KnownFinder&) = delete;

  bool can_seek() const override { return true; }
  void note_source(std::uint64_t study_id, const StudyTable& table) override;
  void drop_source(std::uint64_t study_id) override;
  void seek(KnownQuestion question) override;
  void go_on() override;
  void set_priority(std::uint64_t study_id, std::int32_t priority) override;
  void stop_seeking(std::uint64_t study_id) override;

 private:
  class Chunks;
  using Clock = std::chrono::steady_clock;

  /// A study that waits or is at turn, and how far it came.
  struct Waiting {
    KnownQuestion question;
    IntervalSet found = {};        // was handed over
    std::uint64_t turns = 0;       // that it had
    unsigned long_turns = 0;       // those that ended before its search did
    std::uint64_t waits_from = 0;  // rises with each that begins to wait
  };
  struct Turn {
    Clock::time_point began;
    Clock::duration waited{};  // for others to take what was found
    bool is_over = false;
    bool is_cut_short = false;
  };

  void run();
  Waiting next();
  void answer();
  bool is_turn_over();
  void end_or_wait(KnownReport end);
  void seek_in_all(const protocol::PointTable& table, Work& work);
  static void add_sound(const protocol::PointTable& table, const SharedRun& run, Work& work,
                        Chunks& chunks);
  bool hand_over(KnownReport report);
  sqlite3* database();

  KnownFinderSettings settings_;
  Report report_;
  DatabaseHandle database_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Waiting> waiting_;                                    // guarded by mutex_
  std::uint64_t last_wait_ = 0;                                    // guarded by mutex_
  std::uint64_t turns_ = 0;                                        // guarded by mutex_
  std::map<std::uint64_t, std::shared_ptr<KnownSource>> sources_;  // guarded by mutex_, the map
  Waiting current_{};  // guarded by mutex_ where others look: its study, priority; 0: none
  Turn turn_{};        // of the thread alone
  std::size_t reports_out_ = 0;  // guarded by mutex_
  bool stopping_ = false;        // guarded by mutex_
  std::atomic<bool> is_unwanted_ = false;
  std::thread thread_;  // last: it uses all the others
};

}  // namespace oblique::server
