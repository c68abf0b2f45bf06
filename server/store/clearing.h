#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <utility>

#include "server/database/sqlite.h"
#include "server/study/interval_set.h"

namespace oblique::server {

/// Numbers of models or workers that may be named by no row any more, as runs of neighbours. When
/// they are too many runs, the higher ones are left for a later round, so that memory is bounded
/// whatever the numbers are.
class DoubtfulNumbers {
 public:
  static constexpr std::size_t kMostRuns = std::size_t{1} << 17U;  // some 8 MB
  explicit DoubtfulNumbers(std::size_t most_runs = kMostRuns) : most_runs_(most_runs) {}

  /// [begin, end) are in doubt; what is left for later, later.
  void insert(std::uint64_t begin, std::uint64_t end);
  void erase(std::uint64_t number);
  void erase(const Interval& run) { runs_.erase(run.begin, run.end); }
  void clear();

  /// Nothing is to be judged in this round.
  bool empty() const { return runs_.empty(); }
  const IntervalSet& runs() const { return runs_; }
  /// Numbers from this one on are left for later.
  std::uint64_t end() const { return end_; }
  bool has_more() const { return end_ < kNoEnd; }
  /// Begins the next round, with nothing in it. From which number on all are in doubt.
  std::uint64_t next_round();

 private:
  static constexpr std::uint64_t kNoEnd = std::numeric_limits<std::int64_t>::max();

  void bound();

  std::size_t most_runs_;
  std::uint64_t end_ = kNoEnd;
  IntervalSet runs_;
};

/// Deletes studies. A study is gone in one transaction; its rows, and the models and workers that
/// no other row names, go afterwards, a few in each transaction, so that results are stored
/// meanwhile; then the pages that came free are given back to the file system. What is left stands
/// in the table `deletions` until all is done, so that another process goes on with it.
class Clearing {
 public:
  /// Of a database of the present schema, which must outlive this. So many runs of models, and as
  /// many of workers, are in doubt at most at a time. Throws StorageError.
  explicit Clearing(sqlite3* database, std::size_t most_runs = DoubtfulNumbers::kMostRuns);
  Clearing(const Clearing&) = delete;
  Clearing& operator=(const Clearing&) = delete;

  /// Deletes the study but for its rows. In a transaction of the caller, who calls `kept` or `undo`
  /// when that has ended. Throws StorageError.
  void remove(std::uint64_t study_id);
  void kept() { removed_now_.clear(); }
  /// What this did in the transaction, if anything, was rolled back.
  void undo();

  /// The study was deleted since this began: results of it are late ones.
  bool is_deleted(std::uint64_t study_id) const { return deleted_.contains(study_id); }
  /// A row that is stored now names this model and this worker (0: none).
  void note_use(std::int64_t model, std::uint64_t worker);

  /// Nothing is left to be done.
  bool is_idle() const { return phase_ == Phase::kIdle; }
  /// The next step needs no transaction.
  bool gives_back() const { return phase_ == Phase::kGivesBack; }
  /// Takes one step: at most so many rows are deleted, or what takes about as long: more are looked
  /// at, or fewer pages given back. In a
  /// transaction of the caller, who calls `failed` when it is rolled back. True when models were
  /// deleted. Throws StorageError.
  bool step(std::size_t most);
  /// What was learnt in the last step may not be so: the next one begins anew.
  void failed() { must_begin_anew_ = true; }

  std::uint64_t rows() const { return rows_; }  ///< deleted since this began

 private:
  enum class Phase { kRows, kUses, kReferences, kEntries, kGivesBack, kIdle };
  struct References {
    DoubtfulNumbers models;
    DoubtfulNumbers workers;
    bool empty() const { return models.empty() && workers.empty(); }
    void insert(const Statement& row, int model, int worker);
    void erase(const Statement& row, int model, int worker);
  };

  void delete_rows(std::size_t most);
  void look_for_uses(std::size_t most);
  bool delete_references(std::size_t most);
  void end_round();
  void begin();
  void doubt_all(std::uint64_t first_model, std::uint64_t first_worker);
  std::int64_t pages_to_give_back();

  sqlite3* database_;
  Phase phase_ = Phase::kIdle;
  bool must_begin_anew_ = false;
  std::int64_t last_worker_;         // before this began: who came later may still store results
  bool keeps_entries_ = false;       // for the next process, which can delete those workers too
  std::set<std::uint64_t> left_;     // studies of which rows may be left
  std::set<std::uint64_t> deleted_;  // since this began
  std::set<std::uint64_t> removed_now_;  // of these, in the transaction that is open
  bool doubts_all_ = false;              // which references the rows had that are gone is not known
  References doubtful_;                  // that may be named by no row any more
  std::pair<std::int64_t, std::int64_t> looked_until_{};  // study and point of a row
  std::uint64_t rows_ = 0;
};

}  // namespace oblique::server
