#include "tests/simulation/disk/simulated_disk.h"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "proto/result_message.h"
#include "tests/simulation/world.h"
#include "tests/support/temporary_folder.h"

namespace oblique::simulation {
namespace {

// The store locks its database there; the contents are elsewhere.
const std::string& database_path() {
  static const test::TemporaryFolder kFolder;
  static const std::string kPath = kFolder.file("database");
  return kPath;
}

/// A database without studies, made once.
const std::string& empty_database() {
  static const std::string kImage = [] {
    World world(0);
    SimulatedFiles files(world, database_path(), {});
    files.start();
    { const server::Store store(files.path()); }
    return files.contents();
  }();
  return kImage;
}

}  // namespace

SimulatedDisk::SimulatedDisk(World& world, DiskAtFirst at_first)
    : world_(world),
      files_(world, database_path(),
             at_first == DiskAtFirst::kEmptyFile ? std::string() : empty_database()),
      checkpoint_pages_(static_cast<int>(
          std::array{4, 16, 64, 1000}.at(static_cast<std::size_t>(world.between(0, 3))))) {}

Found SimulatedDisk::open() {
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

void SimulatedDisk::crash(bool power_is_lost) {
  if (power_is_lost) {
    files_.lose_power();
    power_was_lost_ = true;
  } else {
    files_.kill();
  }
  store_.reset();
}

void SimulatedDisk::commit(std::span<const server::Change> changes) {
  try {
    store_->commit(changes);
  } catch (const server::StorageError&) {
    model_.refused(changes);
    throw;
  }
  model_.stored(changes);
}

server::ClearedAway SimulatedDisk::clear_away(std::size_t most) {
  const std::uint64_t before = store_->cleared_rows();
  const auto cleared = store_->clear_away(most);
  cleared_rows += store_->cleared_rows() - before;
  return cleared;
}

void SimulatedDisk::check_rows() {
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

}  // namespace oblique::simulation
