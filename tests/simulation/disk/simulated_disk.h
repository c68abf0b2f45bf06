#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "proto/result_message.h"
#include "server/store/store.h"
#include "tests/simulation/disk/simulated_files.h"
#include "tests/simulation/disk/store_model.h"
#include "tests/simulation/world.h"
#include "tests/support/temporary_folder.h"

namespace oblique::simulation {

// The store locks its database there; the contents are elsewhere.
inline const std::string& database_path() {
  static const test::TemporaryFolder kFolder;
  static const std::string kPath = kFolder.file("database");
  return kPath;
}

/// A database without studies, made once.
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

/// What the first server finds at the path of its database.
enum class DiskAtFirst { kEmptyDatabase, kEmptyFile };

/// The real store on simulated files, held against a model after each restart. Whoever commits
/// must look whether the process died on the way.
class SimulatedDisk final : public server::Storage {
 public:
  explicit SimulatedDisk(World& world, DiskAtFirst at_first = DiskAtFirst::kEmptyDatabase)
      : world_(world),
        files_(world, database_path(),
               at_first == DiskAtFirst::kEmptyFile ? std::string() : empty_database()),
        checkpoint_pages_(static_cast<int>(
            std::array{4, 16, 64, 1000}.at(static_cast<std::size_t>(world.between(0, 3))))) {}

  /// A server starts. Throws StorageError when the disk is at fault, Violation when what the store
  /// has is not what it must have.
  Found open() {
    files_.start();
    store_ = std::make_unique<server::Store>(files_.path());
    // Checkpoints come more often than in a server, for these databases are small.
    store_->checkpoint_at(checkpoint_pages_);
    Found found{store_->studies(), store_->last_study_id(), store_->last_worker_id()};
    model_.restarted(found, power_was_lost_);
    power_was_lost_ = false;
    found.starts = store_->count_start();
    if (found.starts <= std::exchange(starts_, found.starts)) {
      throw Violation("two servers began with one number: leases of both have the same numbers");
    }
    model_.synced();
    return found;
  }
  /// The server ends in an orderly way.
  void close() { store_.reset(); }
  /// The server is killed, or the machine loses power; also while no server runs.
  void crash(bool power_is_lost) {
    if (power_is_lost) {
      files_.lose_power();
      power_was_lost_ = true;
    } else {
      files_.kill();
    }
    store_.reset();
  }
  /// The process died while it wrote.
  bool died() const { return !files_.is_used(); }
  /// A store may fail.
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
  std::uint64_t cleared_rows = 0;  ///< of deleted studies

  /// Compares every row with the model's, and lets SQLite look for damage. Throws Violation.
  void check_rows() {
    using server::Statement;
    const auto database = server::open_database(files_.path(), SQLITE_OPEN_READONLY);
    Statement integrity(database.get(), "PRAGMA integrity_check");
    if (!integrity.step() || integrity.text(0) != "ok") {
      throw Violation("the database is damaged: " + integrity.text(0));
    }
    Statement references(database.get(), "PRAGMA foreign_key_check");
    if (references.step()) {
      throw Violation("a row of " + references.text(0) + " names one of " + references.text(2) +
                      " that is not there");
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
                        std::to_string(study_id) + " is not what was stored");
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
  bool power_was_lost_ = false;  // since the store was last open
  int checkpoint_pages_;
  std::uint64_t starts_ = 0;
  std::unique_ptr<server::Store> store_;
};

}  // namespace oblique::simulation
