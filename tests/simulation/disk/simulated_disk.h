#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/store/store.h"
#include "tests/simulation/disk/simulated_files.h"
#include "tests/simulation/disk/store_model.h"

namespace oblique::simulation {

/// What the first server finds at the path of its database.
enum class DiskAtFirst { kEmptyDatabase, kEmptyFile };

/// The real store on simulated files, held against a model after each restart. Whoever commits
/// must look whether the process died on the way.
class SimulatedDisk final : public server::Storage {
 public:
  explicit SimulatedDisk(World& world, DiskAtFirst at_first = DiskAtFirst::kEmptyDatabase);

  /// A server starts. Throws StorageError when the disk is at fault, Violation when what the store
  /// has is not what it must have.
  Found open();
  /// The server ends in an orderly way.
  void close() { store_.reset(); }
  /// The server is killed, or the machine loses power; also while no server runs.
  void crash(bool power_is_lost);
  /// The process died while it wrote.
  bool died() const { return !files_.is_used(); }
  /// A store may fail.
  bool is_at_fault() const {
    return died() || files_.full || files_.failing || files_.sync_failed();
  }

  void commit(std::span<const server::Change> changes) override;
  void check() override { store_->check(); }
  bool merge_log() override { return store_->merge_log(); }
  server::ClearedAway clear_away(std::size_t most) override;
  std::uint64_t cleared_rows = 0;  ///< of deleted studies

  /// Compares every row with the model's, and lets SQLite look for damage. Throws Violation.
  void check_rows();

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
