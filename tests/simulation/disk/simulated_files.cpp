#include "tests/simulation/disk/simulated_files.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <new>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace oblique::simulation {
namespace {

// ---- SQLite's side: a VFS instead of the default one, with the same properties ------------------

struct Vfs {
  sqlite3_vfs methods{};
  sqlite3_vfs* original = nullptr;
  std::map<std::string, SimulatedFiles*> files;  // key: path of the database
  std::mt19937_64 random;

  /// Returns the files to which the database, log or journal `name` belongs, or nullptr.
  SimulatedFiles* owner_of(std::string_view name) const {
    for (const auto& [path, owner] : files) {
      if (name.starts_with(path)) {
        return owner;
      }
    }
    return nullptr;
  }
};

Vfs& vfs() {
  static Vfs the_one;
  return the_one;
}

struct Handle : sqlite3_file {
  SimulatedFiles* files = nullptr;
  std::shared_ptr<SimulatedFile> file;
  std::uint64_t life = 0;
  bool syncs_directory = false;  // a sync also makes the file name durable
  std::shared_ptr<SharedMemory> memory;
  std::array<bool, SQLITE_SHM_NLOCK> shared{};
  std::array<bool, SQLITE_SHM_NLOCK> exclusive{};

  /// Returns true if the process that opened the handle has ended.
  bool is_dead() const { return life != files->life(); }
};

Handle& handle_of(sqlite3_file* file) {
  return *static_cast<Handle*>(file);
}

int unmap(sqlite3_file* raw, int) {
  Handle& handle = handle_of(raw);
  for (std::size_t i = 0; handle.memory && i < handle.shared.size(); ++i) {
    handle.memory->shared.at(i) -= handle.shared.at(i) ? 1 : 0;
    handle.memory->exclusive.at(i) = handle.memory->exclusive.at(i) && !handle.exclusive.at(i);
  }
  handle.shared.fill(false);
  handle.exclusive.fill(false);
  handle.memory.reset();
  return SQLITE_OK;
}

int close(sqlite3_file* raw) {
  unmap(raw, 0);
  Handle& handle = handle_of(raw);
  if (!handle.is_dead()) {
    handle.files->locks.erase(&handle);
  }
  handle.~Handle();
  return SQLITE_OK;
}

int read(sqlite3_file* raw, void* to, int size, sqlite3_int64 offset) {
  Handle& handle = handle_of(raw);
  if (handle.is_dead() || handle.files->read_fails()) {
    return SQLITE_IOERR_READ;
  }
  const std::string& contents = handle.file->contents();
  const auto begin = std::min(static_cast<std::size_t>(offset), contents.size());
  const auto wanted = static_cast<std::size_t>(size);
  const std::size_t there = std::min(contents.size() - begin, wanted);
  std::memcpy(to, contents.data() + begin, there);
  std::memset(static_cast<char*>(to) + there, 0, wanted - there);
  return there == wanted ? SQLITE_OK : SQLITE_IOERR_SHORT_READ;
}

int write(sqlite3_file* raw, const void* from, int size, sqlite3_int64 offset) {
  Handle& handle = handle_of(raw);
  return handle.is_dead() ? SQLITE_IOERR_WRITE
                          : handle.files->write(
                                *handle.file, static_cast<std::size_t>(offset),
                                {static_cast<const char*>(from), static_cast<std::size_t>(size)});
}

int truncate(sqlite3_file* raw, sqlite3_int64 size) {
  Handle& handle = handle_of(raw);
  return handle.is_dead() ? SQLITE_IOERR_TRUNCATE
                          : handle.files->truncate(*handle.file, static_cast<std::size_t>(size));
}

int sync(sqlite3_file* raw, int) {
  Handle& handle = handle_of(raw);
  if (handle.is_dead()) {
    return SQLITE_IOERR_FSYNC;
  }
  const int code = handle.files->sync(*handle.file, handle.syncs_directory);
  handle.syncs_directory = handle.syncs_directory && code != SQLITE_OK;
  return code;
}

int file_size(sqlite3_file* raw, sqlite3_int64* size) {
  Handle& handle = handle_of(raw);
  *size = static_cast<sqlite3_int64>(handle.file->contents().size());
  return handle.is_dead() ? SQLITE_IOERR_FSTAT : SQLITE_OK;
}

/// Returns the highest lock level that another connection has on the database file.
int level_of_others(const Handle& handle) {
  int highest = SQLITE_LOCK_NONE;
  for (const auto& [who, level] : handle.files->locks) {
    highest = who == &handle ? highest : std::max(highest, level);
  }
  return highest;
}

int lock(sqlite3_file* raw, int level) {
  Handle& handle = handle_of(raw);
  if (handle.is_dead()) {
    return SQLITE_IOERR_LOCK;
  }
  const int others = level_of_others(handle);
  const bool free = level == SQLITE_LOCK_SHARED     ? others < SQLITE_LOCK_PENDING
                    : level == SQLITE_LOCK_RESERVED ? others < SQLITE_LOCK_RESERVED
                                                    : others == SQLITE_LOCK_NONE;
  if (!free) {
    return SQLITE_BUSY;
  }
  int& held = handle.files->locks[&handle];
  held = std::max(held, level);
  return SQLITE_OK;
}

int unlock(sqlite3_file* raw, int level) {
  Handle& handle = handle_of(raw);
  if (!handle.is_dead()) {
    handle.files->locks[&handle] = level;
  }
  return SQLITE_OK;
}

int check_reserved_lock(sqlite3_file* raw, int* reserved) {
  Handle& handle = handle_of(raw);
  *reserved = level_of_others(handle) >= SQLITE_LOCK_RESERVED ? 1 : 0;
  return handle.is_dead() ? SQLITE_IOERR_CHECKRESERVEDLOCK : SQLITE_OK;
}

int map_memory(sqlite3_file* raw, int region, int, int extend, void volatile** where) {
  Handle& handle = handle_of(raw);
  *where = nullptr;
  if (handle.is_dead()) {
    return SQLITE_IOERR_SHMMAP;
  }
  if (!handle.memory) {
    handle.memory = handle.files->memory.lock();
  }
  if (!handle.memory) {
    handle.memory = std::make_shared<SharedMemory>();
    handle.files->memory = handle.memory;
  }
  auto& regions = handle.memory->regions;
  const auto index = static_cast<std::size_t>(region);
  while (extend != 0 && regions.size() <= index) {
    regions.push_back(std::make_unique<std::array<std::byte, SharedMemory::kRegion>>());
  }
  if (index < regions.size()) {
    *where = regions.at(index)->data();
  }
  return SQLITE_OK;
}

int lock_memory(sqlite3_file* raw, int first, int count, int flags) {
  Handle& handle = handle_of(raw);
  if (handle.is_dead() || !handle.memory) {
    return SQLITE_IOERR_SHMLOCK;
  }
  SharedMemory& memory = *handle.memory;
  const bool wants_shared = (flags & SQLITE_SHM_SHARED) != 0;
  const auto begin = static_cast<std::size_t>(first);
  const auto end = begin + static_cast<std::size_t>(count);
  for (std::size_t i = begin; (flags & SQLITE_SHM_LOCK) != 0 && i < end; ++i) {
    const int others = memory.shared.at(i) - (handle.shared.at(i) ? 1 : 0);
    const bool taken = memory.exclusive.at(i) && !handle.exclusive.at(i);
    if (taken || (!wants_shared && others > 0)) {
      return SQLITE_BUSY;
    }
  }
  for (std::size_t i = begin; i < end; ++i) {
    const bool locks = (flags & SQLITE_SHM_LOCK) != 0;
    if (wants_shared) {
      memory.shared.at(i) += (locks ? 1 : 0) - (handle.shared.at(i) ? 1 : 0);
      handle.shared.at(i) = locks;
    } else {
      memory.exclusive.at(i) = locks;
      handle.exclusive.at(i) = locks;
    }
  }
  return SQLITE_OK;
}

// clang-format off
constexpr sqlite3_io_methods kMethods{
    2, close, read, write, truncate, sync, file_size, lock, unlock, check_reserved_lock,
    [](sqlite3_file*, int, void*) { return SQLITE_NOTFOUND; },
    [](sqlite3_file*) { return 4096; },
    [](sqlite3_file*) { return SQLITE_IOCAP_POWERSAFE_OVERWRITE; },
    map_memory, lock_memory, [](sqlite3_file*) {}, unmap, nullptr, nullptr};
// clang-format on

int open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* flags_out) {
  SimulatedFiles* files = name == nullptr ? nullptr : vfs().owner_of(name);
  if (files == nullptr) {
    return vfs().original->xOpen(vfs().original, name, file, flags, flags_out);
  }
  file->pMethods = nullptr;
  auto opened = files->open(name, (flags & SQLITE_OPEN_CREATE) != 0);
  if (!opened) {
    return SQLITE_CANTOPEN;
  }
  auto* handle = new (file) Handle;
  handle->pMethods = &kMethods;
  handle->files = files;
  handle->file = std::move(opened);
  handle->life = files->life();
  // In SQLite the sync of log or journal also makes the name of the database file durable.
  handle->syncs_directory = (flags & SQLITE_OPEN_CREATE) != 0 && (flags & SQLITE_OPEN_MAIN_DB) == 0;
  if (flags_out != nullptr) {
    *flags_out = flags;
  }
  return SQLITE_OK;
}

int remove(sqlite3_vfs*, const char* name, int sync_directory) {
  SimulatedFiles* files = vfs().owner_of(name);
  return files == nullptr ? vfs().original->xDelete(vfs().original, name, sync_directory)
                          : files->remove(name, sync_directory != 0);
}

int access(sqlite3_vfs*, const char* name, int flags, int* result) {
  const SimulatedFiles* files = vfs().owner_of(name);
  if (files == nullptr) {
    return vfs().original->xAccess(vfs().original, name, flags, result);
  }
  *result = files->exists(name) ? 1 : 0;
  return SQLITE_OK;
}

int randomness(sqlite3_vfs*, int size, char* bytes) {
  std::generate_n(bytes, size, [] { return static_cast<char>(vfs().random() & 0xffU); });
  return size;
}

void register_once() {
  if (vfs().original != nullptr) {
    return;
  }
  sqlite3_initialize();
  vfs().original = sqlite3_vfs_find(nullptr);
  sqlite3_vfs& methods = vfs().methods;
  methods = *vfs().original;
  methods.pNext = nullptr;
  methods.zName = "simulated";
  methods.szOsFile = std::max(methods.szOsFile, static_cast<int>(sizeof(Handle)));
  methods.xOpen = open;
  methods.xDelete = remove;
  methods.xAccess = access;
  methods.xRandomness = randomness;
  methods.xSleep = [](sqlite3_vfs*, int duration_us) { return duration_us; };
  sqlite3_vfs_register(&methods, 1);
}

void add_to_vfs(SimulatedFiles& files, std::uint64_t seed) {
  register_once();
  vfs().files[files.path()] = &files;
  vfs().random.seed(seed);
  sqlite3_randomness(0, nullptr);  // SQLite reseeds its own generator from the VFS
}

void remove_from_vfs(SimulatedFiles& files) {
  vfs().files.erase(files.path());
}

// ---- The disk's side: which bytes survive -------------------------------------------------------

/// Number of bytes that a disk writes atomically.
constexpr std::size_t kSector = 512;
/// Size of the pages that an operating system caches and writes [bytes].
constexpr std::size_t kPage = 4096;

/// Returns a random prefix of `bytes`: the part that a failing write writes.
std::string_view some_of(World& world, std::string_view bytes) {
  return bytes.substr(
      0, static_cast<std::size_t>(world.between(0, static_cast<std::int64_t>(bytes.size()))));
}

}  // namespace

// ---- One file -----------------------------------------------------------------------------------

/// Draws which writes survive a power failure: either the first writes and a part of the next one,
/// or, separately for each sector, any number of its first writes.
class SimulatedFile::Losses {
 public:
  Losses(World& world, const std::vector<Step>& steps)
      : world_(world),
        steps_(static_cast<std::int64_t>(steps.size())),
        reordered_(world.chance(0.25)),
        kept_(world.chance(0.5)   ? world.between(0, steps_)
              : world.chance(0.5) ? steps_
                                  : 0) {
    if (kept_ < steps_) {
      const Step& torn = steps[static_cast<std::size_t>(kept_)];
      const std::size_t sectors = torn.bytes.size() / kSector + 1;
      torn_before_ = torn.offset / kSector +
                     static_cast<std::size_t>(world.between(0, static_cast<std::int64_t>(sectors)));
    }
  }

  bool keeps_size(std::int64_t step) const { return step < kept_; }
  /// If step `step` is the torn write, which would have ended at `end`, returns the end of the part
  /// that survives; else 0.
  std::size_t torn_end(std::int64_t step, std::size_t end) const {
    return step == kept_ && !reordered_ ? std::min(end, torn_before_ * kSector) : 0;
  }
  bool keeps(std::int64_t step, std::size_t sector) {
    if (!reordered_) {
      return step < kept_ || (step == kept_ && sector < torn_before_);
    }
    const auto [found, is_new] = kept_of_sector_.try_emplace(sector, 0);
    if (is_new) {
      found->second = world_.between(0, steps_);
    }
    return step < found->second;
  }

 private:
  World& world_;
  std::int64_t steps_;
  bool reordered_;
  std::int64_t kept_;
  std::size_t torn_before_ = 0;  // first sector that the torn write `kept_` loses
  std::map<std::size_t, std::int64_t> kept_of_sector_;
};

void SimulatedFile::apply(const Step& step, std::string& contents) {
  if (step.truncates) {
    contents.resize(step.offset);
    return;
  }
  contents.resize(std::max(contents.size(), step.offset + step.bytes.size()));
  contents.replace(step.offset, step.bytes.size(), step.bytes);
}

void SimulatedFile::write(std::size_t offset, std::string_view bytes) {
  if (!bytes.empty()) {
    unsynced_.push_back({offset, std::string(bytes), false});
    apply(unsynced_.back(), contents_);
    for (std::size_t page = offset / kPage; page <= (offset + bytes.size() - 1) / kPage; ++page) {
      if (forgotten_pages_.erase(page) > 0) {
        unsynced_.push_back({page * kPage, contents_.substr(page * kPage, kPage), false});
      }
    }
  }
}

void SimulatedFile::forget_unsynced() {
  for (const Step& step : unsynced_) {
    const std::size_t end = step.offset + step.bytes.size();
    for (std::size_t page = step.offset / kPage; page * kPage < end; ++page) {
      forgotten_pages_.insert(page);
    }
  }
  unsynced_.clear();
  durable_.resize(contents_.size());
}

void SimulatedFile::truncate(std::size_t size) {
  if (size != contents_.size()) {
    unsynced_.push_back({size, {}, true});
    apply(unsynced_.back(), contents_);
  }
}

void SimulatedFile::sync() {
  for (const Step& step : unsynced_) {
    apply(step, durable_);
  }
  unsynced_.clear();
}

void SimulatedFile::lose_power(World& world) {
  Losses losses(world, unsynced_);
  std::size_t size = durable_.size();
  std::int64_t number = 0;
  for (const Step& step : unsynced_) {
    if (step.truncates) {
      if (losses.keeps_size(number)) {
        size = step.offset;
        durable_.resize(std::min(durable_.size(), size));
      }
      ++number;
      continue;
    }
    const std::size_t end = step.offset + step.bytes.size();
    durable_.resize(std::max(durable_.size(), end));
    size = std::max(size, losses.keeps_size(number) ? end : losses.torn_end(number, end));
    for (std::size_t at = step.offset; at < end;) {
      const std::size_t next = std::min(end, (at / kSector + 1) * kSector);
      if (losses.keeps(number, at / kSector)) {
        durable_.replace(at, next - at, step.bytes, at - step.offset, next - at);
      }
      at = next;
    }
    ++number;
  }
  durable_.resize(size);
  contents_ = durable_;
  unsynced_.clear();
  forgotten_pages_.clear();
}

// ---- All files of a database --------------------------------------------------------------------

SimulatedFiles::SimulatedFiles(World& world, std::string path, const std::string& image)
    : world_(world), path_(std::move(path)) {
  entries_[path_] = std::make_shared<SimulatedFile>(image);
  durable_entries_ = entries_;
  add_to_vfs(*this, static_cast<std::uint64_t>(world.between(0, INT64_MAX - 1)));
}

SimulatedFiles::~SimulatedFiles() {
  remove_from_vfs(*this);
}

void SimulatedFiles::start() {
  ++life_;
  used_ = true;
  sync_failed_ = false;
}

void SimulatedFiles::kill() {
  ++life_;
  used_ = false;
  death_in_ = 0;
  locks.clear();
  memory.reset();
}

void SimulatedFiles::lose_power() {
  kill();
  std::set<std::string> names;
  for (const auto* entries : {&entries_, &durable_entries_}) {
    for (const auto& [name, file] : *entries) {
      names.insert(name);
    }
  }
  Entries left;
  for (const std::string& name : names) {
    const Entries& source = world_.chance(0.5) ? entries_ : durable_entries_;
    if (const auto found = source.find(name); found != source.end()) {
      found->second->lose_power(world_);
      left.insert(*found);
    }
  }
  entries_ = left;
  durable_entries_ = std::move(left);
}

std::shared_ptr<SimulatedFile> SimulatedFiles::open(const std::string& name, bool create) {
  if (!used_) {
    return nullptr;
  }
  const auto found = entries_.find(name);
  if (found != entries_.end() || !create) {
    return found == entries_.end() ? nullptr : found->second;
  }
  return entries_.emplace(name, std::make_shared<SimulatedFile>()).first->second;
}

int SimulatedFiles::remove(const std::string& name, bool sync_directory) {
  if (!used_) {
    return SQLITE_IOERR_DELETE;
  }
  if (dies_now()) {
    kill();
    return SQLITE_IOERR_DELETE;
  }
  if (entries_.erase(name) == 0) {
    return SQLITE_IOERR_DELETE_NOENT;
  }
  if (sync_directory) {
    durable_entries_ = entries_;
  }
  return SQLITE_OK;
}

int SimulatedFiles::write(SimulatedFile& file, std::size_t offset, std::string_view bytes) {
  if (dies_now()) {
    file.write(offset, some_of(world_, bytes));
    kill();
    return SQLITE_IOERR_WRITE;
  }
  if (fails_now()) {
    file.write(offset, some_of(world_, bytes));
    return SQLITE_IOERR_WRITE;
  }
  const std::size_t size = file.contents().size();
  if (full && offset + bytes.size() > size) {
    file.write(offset, bytes.substr(0, offset < size ? size - offset : 0));
    return SQLITE_FULL;
  }
  file.write(offset, bytes);
  return SQLITE_OK;
}

int SimulatedFiles::truncate(SimulatedFile& file, std::size_t size) {
  if (dies_now()) {
    kill();
    return SQLITE_IOERR_TRUNCATE;
  }
  if (fails_now()) {
    return SQLITE_IOERR_TRUNCATE;
  }
  file.truncate(size);
  return SQLITE_OK;
}

int SimulatedFiles::sync(SimulatedFile& file, bool and_directory) {
  if (failing_sync_in_ > 0 && --failing_sync_in_ == 0) {
    file.forget_unsynced();
    sync_failed_ = true;
    return SQLITE_IOERR_FSYNC;
  }
  const bool dies = dies_now();
  if ((dies && world_.chance(0.5)) || fails_now()) {
    if (dies) {
      kill();
    } else if (forgets) {
      file.forget_unsynced();
    }
    return SQLITE_IOERR_FSYNC;
  }
  file.sync();
  if (and_directory) {
    durable_entries_ = entries_;
  }
  if (dies) {
    kill();
    return SQLITE_IOERR_FSYNC;
  }
  return SQLITE_OK;
}

}  // namespace oblique::simulation
