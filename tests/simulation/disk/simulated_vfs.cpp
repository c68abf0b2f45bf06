// SQLite's side of the simulated files: a VFS in the place of the default one. It says of itself
// what the default one says of a Unix file system.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <new>
#include <random>
#include <string>
#include <string_view>
#include <utility>

#include "tests/simulation/disk/simulated_files.h"

namespace oblique::simulation {
namespace {

struct Vfs {
  sqlite3_vfs methods{};
  sqlite3_vfs* original = nullptr;
  std::map<std::string, SimulatedFiles*> files;  // by the path of the database
  std::mt19937_64 random;

  /// Those that a name belongs to: a database, its log or its journal; or nullptr.
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
  bool syncs_directory = false;  // its name may be new
  std::shared_ptr<SharedMemory> memory;
  std::array<bool, SQLITE_SHM_NLOCK> shared{};
  std::array<bool, SQLITE_SHM_NLOCK> exclusive{};

  /// Its process is gone.
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

/// The highest level at which another connection holds the database file.
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
  // As the default VFS does: for a database it leaves that to its log and journal.
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

}  // namespace

void add_to_vfs(SimulatedFiles& files, std::uint64_t seed) {
  register_once();
  vfs().files[files.path()] = &files;
  vfs().random.seed(seed);
  sqlite3_randomness(0, nullptr);  // SQLite seeds its own generator again
}

void remove_from_vfs(SimulatedFiles& files) {
  vfs().files.erase(files.path());
}

}  // namespace oblique::simulation
