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

/// One file on a simulated disk: the contents for readers, and what survives a power failure.
class SimulatedFile {
 public:
  SimulatedFile() = default;
  explicit SimulatedFile(const std::string& durable) : durable_(durable), contents_(durable) {}

  const std::string& contents() const { return contents_; }
  void write(std::size_t offset, std::string_view bytes);
  void truncate(std::size_t size);
  void sync();
  /// A sync fails and the system marks the pages as clean, as Linux does: their contents can be
  /// read, but reach the disk only if they are written again.
  void forget_unsynced();

  /// Loses power. Synced contents are kept; of later writes any part is: sectors are atomic, may
  /// reach the disk in any order, and may have any of their states. The file size is kept or not in
  /// the same way. Bytes inside the file that were never written are zero.
  void lose_power(World& world);

 private:
  struct Step {
    std::size_t offset;  // offset, or the new size
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

/// The write-ahead index that connections to one database share. A crash loses it.
struct SharedMemory {
  static constexpr std::size_t kRegion = 32768;
  std::vector<std::unique_ptr<std::array<std::byte, kRegion>>> regions;
  std::array<int, SQLITE_SHM_NLOCK> shared{};
  std::array<bool, SQLITE_SHM_NLOCK> exclusive{};
};

/// The files of one database in memory, under the faults that disks have. While it lives, SQLite
/// finds them at `path` through its default VFS; what is at other paths it finds where it is. One
/// thread may use such files in a process.
class SimulatedFiles {
 public:
  /// Starts with `image` as durable database. SQLite's random numbers follow from `world` too.
  SimulatedFiles(World& world, std::string path, const std::string& image);
  ~SimulatedFiles();
  SimulatedFiles(const SimulatedFiles&) = delete;
  SimulatedFiles& operator=(const SimulatedFiles&) = delete;

  const std::string& path() const { return path_; }
  std::string contents() const { return entries_.at(path_)->contents(); }

  /// A process starts to use the files.
  void start();
  /// The process ends: its handles do nothing more; its writes are kept.
  void kill();
  bool is_used() const { return used_; }
  /// The power fails: files and names are as on the disk.
  void lose_power();
  /// The process dies in that write, sync, truncation or deletion, counted from now; 0: never.
  void plan_death(std::int64_t operations) { death_in_ = operations; }
  /// That sync, counted from now, fails once and loses its data; 0: none.
  void plan_failing_sync(std::int64_t syncs) { failing_sync_in_ = syncs; }
  /// Whether the planned failure is still to come.
  bool awaits_failing_sync() const { return failing_sync_in_ > 0; }
  /// Whether a sync has failed since the process started.
  bool sync_failed() const { return sync_failed_; }
  /// Counts processes.
  std::uint64_t life() const { return life_; }

  bool full = false;     ///< whether no file can grow
  bool failing = false;  ///< whether reads, writes and syncs fail now and then
  bool forgets = false;  ///< whether a failed sync loses its data

  // Functions for the VFS. Numbers are SQLite's result codes.
  std::shared_ptr<SimulatedFile> open(const std::string& name, bool create);
  bool exists(const std::string& name) const { return entries_.contains(name); }
  int remove(const std::string& name, bool sync_directory);
  int write(SimulatedFile& file, std::size_t offset, std::string_view bytes);
  int truncate(SimulatedFile& file, std::size_t size);
  int sync(SimulatedFile& file, bool and_directory);
  bool read_fails() { return failing && world_.chance(0.02); }

  std::map<const void*, int> locks;  ///< levels of the connections on the database file
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
