#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <sqlite3.h>

#include "tests/simulation/world.h"

namespace oblique::simulation {

/// One file on a simulated disk: its present contents, and the part that survives a power failure.
class SimulatedFile {
 public:
  SimulatedFile() = default;
  explicit SimulatedFile(const std::string& durable) : durable_(durable), contents_(durable) {}

  const std::string& contents() const { return contents_; }
  void write(std::size_t offset, std::string_view bytes);
  void truncate(std::size_t size);
  void sync();
  /// Simulates a failed sync after which the system marks the pages as written, as Linux does.
  /// Reads return the new contents, but the disk gets them only if the pages are written again.
  void forget_unsynced();

  /// Simulates a power failure. Synced contents survive. Of later writes a random part survives:
  /// each sector and the file size may have the state before or after any of these writes. Bytes
  /// that were never written are zero.
  void lose_power(World& world);

 private:
  struct Step {
    std::size_t offset;  // position of `bytes` in the file; the new file size if `truncates`
    std::string bytes;
    bool truncates;
  };
  class Losses;
  static void apply(const Step& step, std::string& contents);

  std::string durable_;
  std::string contents_;
  std::vector<Step> unsynced_;
  std::set<std::size_t> forgotten_pages_;
};

/// The index of the write-ahead log, which all connections to a database share. A crash loses it.
struct SharedMemory {
  static constexpr std::size_t kRegion = 32768;
  std::vector<std::unique_ptr<std::array<std::byte, kRegion>>> regions;
  std::array<int, SQLITE_SHM_NLOCK> shared{};
  std::array<bool, SQLITE_SHM_NLOCK> exclusive{};
};

/// The files of one database, in memory, with simulated faults of the disk. While this object
/// exists, the default VFS of SQLite finds these files at `path`, and all other paths in the real
/// file system. Only one thread of a process may use such files.
class SimulatedFiles {
 public:
  /// `image` is the initial, durable database. `world` draws faults and seeds SQLite's generator.
  SimulatedFiles(World& world, std::string path, const std::string& image);
  ~SimulatedFiles();
  SimulatedFiles(const SimulatedFiles&) = delete;
  SimulatedFiles& operator=(const SimulatedFiles&) = delete;

  const std::string& path() const { return path_; }
  std::string contents() const { return entries_.at(path_)->contents(); }

  /// Starts a process that uses the files.
  void start();
  /// Ends the process. Its writes survive. Its open handles have no effect any more.
  void kill();
  bool is_used() const { return used_; }
  /// Simulates a power failure: only the files and file names on the disk survive.
  void lose_power();
  /// Lets the process die during the `operations`-th write, sync, truncation or deletion from now,
  /// or never if `operations` is 0.
  void plan_death(std::int64_t operations) { death_in_ = operations; }
  /// Lets the `syncs`-th sync from now fail and lose its data, or no sync if `syncs` is 0.
  void plan_failing_sync(std::int64_t syncs) { failing_sync_in_ = syncs; }
  /// Returns true if a failing sync is planned and has not happened yet.
  bool awaits_failing_sync() const { return failing_sync_in_ > 0; }
  /// Returns true if a sync has failed since the process started.
  bool sync_failed() const { return sync_failed_; }
  /// Number of processes so far.
  std::uint64_t life() const { return life_; }

  bool full = false;     ///< the disk is full: no file can grow
  bool failing = false;  ///< reads, writes and syncs fail sometimes
  bool forgets = false;  ///< a failed sync loses its data

  // Functions for the VFS. An int result is a result code of SQLite.
  std::shared_ptr<SimulatedFile> open(const std::string& name, bool create);
  bool exists(const std::string& name) const { return entries_.contains(name); }
  int remove(const std::string& name, bool sync_directory);
  int write(SimulatedFile& file, std::size_t offset, std::string_view bytes);
  int truncate(SimulatedFile& file, std::size_t size);
  int sync(SimulatedFile& file, bool and_directory);
  bool read_fails() { return failing && world_.chance(0.02); }

  std::map<const void*, int> locks;  ///< lock level of each connection to the database file
  std::weak_ptr<SharedMemory> memory;

 private:
  using Entries = std::map<std::string, std::shared_ptr<SimulatedFile>>;
  bool dies_now() { return death_in_ > 0 && --death_in_ == 0; }
  bool fails_now() { return failing && world_.chance(0.2); }

  World& world_;
  std::string path_;
  Entries entries_;
  Entries durable_entries_;
  std::int64_t death_in_ = 0;
  std::int64_t failing_sync_in_ = 0;
  std::uint64_t life_ = 0;
  bool used_ = false;
  bool sync_failed_ = false;
};

}  // namespace oblique::simulation
