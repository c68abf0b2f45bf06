#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "proto/result_message.h"
#include "server/store/store.h"
#include "tests/simulation/disk/simulated_files.h"
#include "tests/simulation/world.h"
#include "tests/support/temporary_folder.h"

namespace oblique::simulation {

using server::AddResults;
using server::AddStudy;
using server::AddWorker;
using server::Change;
using server::DeleteStudy;
using server::ForgetFailures;
using server::GrowStudy;
using server::RenameStudy;
using server::SetPriority;
using server::SetStudyState;
using server::StudyState;

template <typename Kind>
std::uint64_t study_of(const Kind& change) {
  if constexpr (requires { change.study_id; }) {
    return change.study_id;
  } else {
    return 0;
  }
}

/// Contents of the store that a starting server finds.
struct Found {
  std::vector<server::StoredStudy> studies;
  std::uint64_t last_study_id = 0;
  std::uint64_t last_worker_id = 0;
  std::uint64_t starts = 0;  ///< number of server starts, including this one
};

/// A simple model of the contents that the store must have. Throws Violation if the real contents
/// differ.
class StoreModel {
 public:
  using Rows = std::map<std::uint64_t, std::shared_ptr<const protocol::PointResult>>;

  /// Adds changes that the store has committed. Throws Violation if a point gets a second result.
  void stored(std::span<const server::Change> changes) {
    bool control = false;
    bool writes = false;
    for (const Change& change : changes) {
      control = control || (!std::holds_alternative<AddWorker>(change) &&
                            !std::holds_alternative<AddResults>(change));
      writes = apply(change, now_) || writes;
    }
    // A transaction without a change causes neither a write nor a sync.
    if (control && writes) {
      synced();
    } else if (writes) {
      entries_.push_back({{changes.begin(), changes.end()}, true});
    }
  }
  /// Adds changes whose commit failed. After a crash either all or none of them may be stored,
  /// until a later commit overwrites them.
  void refused(std::span<const server::Change> changes) {
    ++failed_commits;
    entries_.push_back({{changes.begin(), changes.end()}, false});
  }

  /// Records a full sync, which makes all stored changes durable.
  void synced() {
    synced_ = now_;
    entries_.clear();
  }

  /// Compares the contents after a restart with all stored changes. After a power failure the
  /// commits since the last full sync may be missing. The contents found become the state of the
  /// model.
  void restarted(const Found& found, bool power_was_lost) {
    // Without a power failure only failed commits after the last successful one are uncertain.
    const auto last_stored =
        std::find_if(entries_.rbegin(), entries_.rend(), [](const Entry& e) { return e.stored; });
    auto entry = power_was_lost ? entries_.begin() : last_stored.base();
    Contents state = power_was_lost ? synced_ : now_;
    std::optional<Contents> matching;
    auto came_back = entries_.end();
    std::uint64_t undone = 0;
    const auto consider = [&](const Contents& candidate, std::vector<Entry>::iterator refused_one) {
      if (candidate == found) {
        matching = candidate;
        came_back = refused_one;
        undone = 0;
      }
    };
    consider(state, entries_.end());
    for (; entry != entries_.end(); ++entry) {
      if (entry->stored) {
        apply_all(*entry, state);
        ++undone;
        consider(state, entries_.end());
      } else {
        Contents with_refused = state;
        apply_all(*entry, with_refused);
        consider(with_refused, entry);
      }
    }
    if (!matching) {
      throw Violation("after a restart the store's contents differ from what was stored");
    }
    undone_commits += undone;
    refused_kept += came_back != entries_.end() ? 1U : 0U;
    now_ = std::move(*matching);
    now_.last_worker_id = found.last_worker_id;
    if (power_was_lost) {
      synced_ = now_;
      entries_.clear();
    } else if (came_back != entries_.end()) {
      // The found change of a failed commit counts as the last stored change from now on.
      came_back->stored = true;
      std::rotate(came_back, came_back + 1, entries_.end());
    }
  }

  /// Returns the study called `name`, or nullptr.
  const server::StoredStudy* study(const std::string& name) const {
    for (const auto& [id, study] : now_.studies) {
      if (study.name == name) {
        return &study;
      }
    }
    return nullptr;
  }
  const server::StoredStudy* study(std::uint64_t study_id) const {
    const auto found = now_.studies.find(study_id);
    return found == now_.studies.end() ? nullptr : &found->second;
  }
  const Rows& rows(std::uint64_t study_id) const {
    static const Rows kNone;
    const auto found = now_.rows.find(study_id);
    return found == now_.rows.end() ? kNone : found->second;
  }

  std::uint64_t failed_commits = 0;
  std::uint64_t undone_commits = 0;  ///< commits that power failures undid
  std::uint64_t refused_kept = 0;    ///< changes of failed commits, found after a crash

 private:
  struct Contents {
    std::map<std::uint64_t, server::StoredStudy> studies;
    std::map<std::uint64_t, Rows> rows;
    std::uint64_t last_study_id = 0;  ///< including deleted studies
    std::uint64_t last_worker_id = 0;
    bool has_deleted = false;  ///< a study was deleted; rows of table `workers` may be missing

    bool operator==(const Found& found) const {
      return last_study_id == found.last_study_id &&
             (last_worker_id == found.last_worker_id ||
              (has_deleted && found.last_worker_id < last_worker_id)) &&
             std::equal(studies.begin(), studies.end(), found.studies.begin(), found.studies.end(),
                        [](const auto& entry, const server::StoredStudy& there) {
                          const server::StoredStudy& here = entry.second;
                          return here.study_id == there.study_id && here.name == there.name &&
                                 here.state == there.state && here.created_at == there.created_at &&
                                 here.priority == there.priority &&
                                 here.completed == there.completed &&
                                 here.failures == there.failures &&
                                 here.left_out == there.left_out &&
                                 here.table->recipe().SerializeAsString() ==
                                     there.table->recipe().SerializeAsString();
                        });
    }
  };
  struct Entry {
    std::vector<server::Change> changes;
    bool stored;
  };
  /// Applies a change. Returns true if the store must write the change.
  static bool apply(const server::Change& change, Contents& contents) {
    if (const auto* study = std::get_if<AddStudy>(&change)) {
      contents.last_study_id = std::max(contents.last_study_id, study->study_id);
      server::StoredStudy& added = contents.studies[study->study_id];
      added.study_id = study->study_id;
      added.name = study->name;
      added.table = study->table;
      added.created_at = study->created_at;
      added.priority = study->priority;
      return true;
    }
    if (const auto* worker = std::get_if<AddWorker>(&change)) {
      contents.last_worker_id = std::max(contents.last_worker_id, worker->worker_id);
      return true;
    }
    const std::uint64_t id = std::visit([](const auto& of) { return study_of(of); }, change);
    const auto known = contents.studies.find(id);
    if (known == contents.studies.end()) {
      return false;  // the store drops results of a deleted study
    }
    server::StoredStudy& study = known->second;
    if (const auto* state = std::get_if<SetStudyState>(&change)) {
      study.state = state->state;
    } else if (const auto* priority = std::get_if<SetPriority>(&change)) {
      return std::exchange(study.priority, priority->priority) != priority->priority;
    } else if (const auto* name = std::get_if<RenameStudy>(&change)) {
      study.name = name->name;
    } else if (const auto* growth = std::get_if<GrowStudy>(&change)) {
      study.table = growth->table;
      study.priority = growth->priority;
      study.state = StudyState::kRunning;
    } else if (std::holds_alternative<DeleteStudy>(change)) {
      contents.studies.erase(known);
      contents.rows.erase(id);
      contents.has_deleted = true;
    } else if (const auto* forget = std::get_if<ForgetFailures>(&change)) {
      return apply(*forget, study, contents.rows[id]);
    } else {
      return apply(std::get<AddResults>(change), study, contents.rows[id]);
    }
    return true;
  }
  static bool apply(const server::AddResults& change, server::StoredStudy& study, Rows& rows) {
    for (const auto& result : change.results) {
      auto row = std::make_shared<const protocol::PointResult>(result);
      if (!rows.emplace(result.point(), std::move(row)).second) {
        throw Violation("point " + std::to_string(result.point()) + " was stored twice");
      }
      study.completed.insert(result.point());
      if (!result.error().empty()) {
        study.failures.insert(result.point());
      }
    }
    change.left_out.for_each([&](const server::Interval& points) {
      if (!study.completed.within(points.begin, points.end).empty()) {
        throw Violation("a filter leaves out points that were completed before");
      }
      study.completed.insert(points.begin, points.end);
      study.left_out += points.end - points.begin;
    });
    return !change.results.empty() || !change.left_out.empty();
  }
  static bool apply(const server::ForgetFailures& change, server::StoredStudy& study, Rows& rows) {
    bool changes = study.state == StudyState::kDone;
    study.state = changes ? StudyState::kRunning : study.state;
    change.points.for_each([&](const server::Interval& interval) {
      for (std::uint64_t point = interval.begin; point < interval.end; ++point) {
        if (study.failures.contains(point)) {
          rows.erase(point);
          study.failures.erase(point);
          study.completed.erase(point);
          changes = true;
        }
      }
    });
    return changes;
  }
  static void apply_all(const Entry& entry, Contents& contents) {
    for (const Change& change : entry.changes) {
      apply(change, contents);
    }
  }

  Contents now_;
  Contents synced_;             // contents at the last commit with a full sync
  std::vector<Entry> entries_;  // changes after that commit, in order
};

// Path of a lock file that the store creates; the contents of the database are in memory.
inline const std::string& database_path() {
  static const test::TemporaryFolder kFolder;
  static const std::string kPath = kFolder.file("database");
  return kPath;
}

/// Returns the contents of a database file without studies. Makes the file on the first call.
inline const std::string& empty_database() {
  static const std::string kImage = [] {
    World world(0);
    SimulatedFiles files(world, database_path(), {});
    files.start();
    { const server::Store store(files.path()); }
    return files.contents();
  }();
  return kImage;
}

/// Content of the database file that the first server finds.
enum class DiskAtFirst { kEmptyDatabase, kEmptyFile };

/// The real store on simulated files. Each restart compares the store with a model. After each
/// commit the caller must check whether the process died during the commit.
class SimulatedDisk final : public server::Storage {
 public:
  explicit SimulatedDisk(World& world, DiskAtFirst at_first = DiskAtFirst::kEmptyDatabase)
      : world_(world),
        files_(world, database_path(),
               at_first == DiskAtFirst::kEmptyFile ? std::string() : empty_database()),
        checkpoint_pages_(static_cast<int>(
            std::array{4, 16, 64, 1000}.at(static_cast<std::size_t>(world.between(0, 3))))) {}

  /// Starts a server. Throws StorageError after a fault of the disk, and Violation if the contents
  /// of the store are wrong.
  Found open() {
    files_.start();
    store_ = std::make_unique<server::Store>(files_.path());
    // Checkpoints are more frequent than in a server, because these databases are small.
    store_->checkpoint_at(checkpoint_pages_);
    Found found{store_->studies(), store_->last_study_id(), store_->last_worker_id()};
    model_.restarted(found, power_was_lost_);
    power_was_lost_ = false;
    found.starts = store_->count_start();
    if (found.starts <= std::exchange(starts_, found.starts)) {
      throw Violation(
          "two servers have the same start number, so leases of both have the same numbers");
    }
    model_.synced();
    return found;
  }
  /// Closes the store, as a server does when it ends normally.
  void close() { store_.reset(); }
  /// Kills the server or cuts the power. Allowed without a running server.
  void crash(bool power_is_lost) {
    if (power_is_lost) {
      files_.lose_power();
      power_was_lost_ = true;
    } else {
      files_.kill();
    }
    store_.reset();
  }
  /// Returns true if the process died during a write.
  bool died() const { return !files_.is_used(); }
  /// Returns true if operations of the store may fail.
  bool is_at_fault() const {
    return died() || files_.full || files_.failing || files_.sync_failed();
  }

  void commit(std::span<const server::Change> changes) override {
    try {
      store_->commit(changes);
    } catch (const server::StorageError&) {
      model_.refused(changes);
      throw;
    }
    model_.stored(changes);
  }
  void check() override { store_->check(); }
  bool merge_log() override { return store_->merge_log(); }
  server::ClearedAway clear_away(std::size_t most) override {
    const std::uint64_t before = store_->cleared_rows();
    const auto cleared = store_->clear_away(most);
    cleared_rows += store_->cleared_rows() - before;
    return cleared;
  }
  std::uint64_t cleared_rows = 0;  ///< number of rows removed because their study was deleted

  /// Compares every row with the model and runs SQLite's checks. Throws Violation on a difference.
  void check_rows() {
    using server::Statement;
    const auto database = server::open_database(files_.path(), SQLITE_OPEN_READONLY);
    Statement integrity(database.get(), "PRAGMA integrity_check");
    if (!integrity.step() || integrity.text(0) != "ok") {
      throw Violation("the database is damaged: " + integrity.text(0));
    }
    Statement references(database.get(), "PRAGMA foreign_key_check");
    if (references.step()) {
      throw Violation("a row of " + references.text(0) + " references a missing row of " +
                      references.text(2));
    }
    Statement rows(database.get(),
                   "SELECT study_id, point, mu, coalesce(error, ''), duration_s, fn_peak_N, k"
                   " FROM results JOIN models USING (model_id) ORDER BY study_id, point");
    std::map<std::uint64_t, std::size_t> counts;
    while (rows.step()) {
      const auto study_id = static_cast<std::uint64_t>(rows.integer(0));
      const auto point = static_cast<std::uint64_t>(rows.integer(1));
      const auto& expected = model_.rows(study_id);
      const auto row = expected.find(point);
      const auto agrees = [&](const protocol::PointResult& result) {
        const auto outputs =
            result.error().empty() ? protocol::from_message(result) : solver::CaseResult{};
        return result.error() == rows.text(3) && rows.real(4) == outputs.duration_s &&
               rows.real(5) == outputs.fn_peak_N;
      };
      const auto& table = *model_.study(study_id)->table.get();
      if (row == expected.end() || !agrees(*row->second) || table.point(point).mu != rows.real(2) ||
          table.model(table.point(point).model).k_N_m != rows.real(6)) {
        throw Violation("the row of point " + std::to_string(point) + " of study " +
                        std::to_string(study_id) + " differs from the stored result");
      }
      ++counts[study_id];
    }
    Statement versions(database.get(),
                       "SELECT study_id FROM results JOIN workers USING (worker_id)"
                       " GROUP BY study_id HAVING count(DISTINCT solver_version) > 1");
    if (versions.step()) {
      throw Violation("study " + versions.text(0) + " has results of two solver versions");
    }
    for (const auto& study : store_->studies()) {
      if (counts[study.study_id] != model_.rows(study.study_id).size()) {
        throw Violation("rows of study " + study.name + " are missing");
      }
    }
  }

  const StoreModel& model() const { return model_; }
  SimulatedFiles& files() { return files_; }

 private:
  World& world_;
  SimulatedFiles files_;
  StoreModel model_;
  bool power_was_lost_ = false;  // the power has failed since the last open()
  int checkpoint_pages_;
  std::uint64_t starts_ = 0;
  std::unique_ptr<server::Store> store_;
};

}  // namespace oblique::simulation
