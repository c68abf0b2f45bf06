#include "server/database/database_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <mntent.h>
#include <unistd.h>

#include <spdlog/fmt/fmt.h>

#include "proto/small_file.h"
#include "proto/system/descriptor.h"

namespace oblique::server {
namespace {

namespace fs = std::filesystem;

constexpr mode_t kOwnerOnly = 0600;
constexpr int kBusyTimeout_ms = 5000;

/// Returns a server's lock on a database. It covers one byte, which SQLite does not lock.
struct flock servers_lock() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = off_t{1} << 62;
  lock.l_len = 1;
  return lock;
}

/// Formats the path as a URI for SQLite. Escapes the characters that have a special meaning in a
/// URI.
std::string as_uri(const std::string& path) {
  std::string uri = "file:";
  for (const char letter : fs::absolute(path).string()) {
    uri += letter == '%'   ? "%25"
           : letter == '?' ? "%3f"
           : letter == '#' ? "%23"
                           : std::string(1, letter);
  }
  return uri;
}

/// Opens a database without creating files beside it.
DatabaseHandle open_alone(const std::string& path) {
  std::error_code none;
  const bool has_log = fs::file_size(path + "-wal", none) > 0 && !none;
  // SQLite ignores the log of an immutable database. So a database with a log is opened without
  // locks and in exclusive mode: SQLite then keeps the index of the log in memory.
  DatabaseHandle database =
      open_database(as_uri(path) + (has_log ? "?vfs=unix-none" : "?immutable=1"),
                    SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
  if (has_log) {
    execute(database.get(), "PRAGMA locking_mode = EXCLUSIVE");
    sqlite3_db_config(database.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  }
  return database;
}

}  // namespace

void check_path(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) == 0 && !S_ISREG(about.st_mode)) {
    throw StorageError(path + " is " + protocol::kind_of_file(about.st_mode) +
                       ": a database must be a regular file");
  }
}

DatabaseHandle open_for_reading(const std::string& path) {
  check_path(path);
  if (!fs::exists(path)) {
    throw StorageError("there is no database " + path);
  }
  DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
  sqlite3_busy_timeout(database.get(), kBusyTimeout_ms);
  const int code = sqlite3_exec(database.get(), "PRAGMA schema_version", nullptr, nullptr, nullptr);
  const unsigned kind = static_cast<unsigned>(code) & 0xffU;
  const bool lacks_files = kind == SQLITE_CANTOPEN || kind == SQLITE_READONLY;
  if (lacks_files && ::access(fs::absolute(path).parent_path().c_str(), W_OK) != 0) {
    return open_alone(path);
  }
  return database;
}

DatabaseHandle open_stored(const std::string& path) {
  DatabaseHandle database = open_for_reading(path);
  if (identify(database.get(), path) == DatabaseKind::kEmpty) {
    throw StorageError(path + " is empty: it contains no study");
  }
  return database;
}

std::string file_system_of(const std::string& path) {
  constexpr std::size_t kLongestLine = 16 * 1024;
  std::error_code error;
  const std::string place = fs::weakly_canonical(fs::absolute(path), error).string() + '/';
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> mounts(
      ::setmntent("/proc/self/mounts", "re"), &::endmntent);
  std::vector<char> line(kLongestLine);
  mntent mount{};
  std::string type = "unknown";
  std::string nearest;
  while (mounts != nullptr && ::getmntent_r(mounts.get(), &mount, line.data(),
                                            static_cast<int>(line.size())) != nullptr) {
    const std::string_view folder(mount.mnt_dir);
    const std::string prefix = std::string(folder) + (folder.ends_with('/') ? "" : "/");
    // A later mount at the same path hides the earlier one.
    if (place.starts_with(prefix) && prefix.size() >= nearest.size()) {
      nearest = prefix;
      type = mount.mnt_type;
    }
  }
  return type;
}

bool is_network_file_system(std::string_view type) {
  constexpr std::array<std::string_view, 8> kNetwork{"nfs",    "cifs", "smb",  "ceph",
                                                     "lustre", "afs",  "gpfs", "beegfs"};
  // The type of a FUSE file system contains the name of its program. Most of these programs access
  // other machines; the following do not.
  constexpr std::array<std::string_view, 6> kLocalFuse{
      "fuse.mergerfs", "fuse.ntfs", "fuse.exfat", "fuse.overlay", "fuse.fuse-", "fuse.gocrypt"};
  const auto begins_type = [type](std::string_view name) { return type.starts_with(name); };
  return std::ranges::any_of(kNetwork, begins_type) ||
         (type.starts_with("fuse.") && std::ranges::none_of(kLocalFuse, begins_type));
}

std::string network_disk_error(const std::string& path) {
  const std::string type = file_system_of(path);
  if (!is_network_file_system(type)) {
    return {};
  }
  return fmt::format(
      "{} is on a network file system ({}), on which two machines could damage the "
      "database: use a file on a local disk, or --allow-network-disk if no other machine "
      "writes to it",
      path, type);
}

const std::string& path_on_own_disk(const std::string& path, bool allows_network_disk) {
  const std::string error = network_disk_error(path);
  if (!error.empty() && !allows_network_disk) {
    throw StorageError(error);
  }
  return path;
}

bool is_in_use(const std::string& path) {
  const protocol::Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct flock lock = servers_lock();
  return ::fcntl(file.number(), F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

ServerFile::ServerFile(const std::string& path) : path_(fs::absolute(path).string()) {
  check_path(path);
  const std::string folder = fs::path(path_).parent_path().string();
  if (::access(folder.c_str(), W_OK) != 0 && (errno == EACCES || errno == EROFS)) {
    throw StorageError(fmt::format(
        "the folder {} is read-only for this user ({}), and a server needs files beside its "
        "database {}",
        folder, std::strerror(errno), path));
  }
  file_ = protocol::Descriptor(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  if (!file_.is_open() && errno == ENOENT) {
    file_ = protocol::Descriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kOwnerOnly));
    is_new_ = file_.is_open();
  }
  if (!file_.is_open() || ::fstat(file_.number(), &opened_) != 0) {
    throw StorageError("cannot open the database " + path +
                       " for writing: " + std::strerror(errno));
  }
  struct flock lock = servers_lock();
  if (::fcntl(file_.number(), F_OFD_SETLK, &lock) != 0) {
    throw StorageError(
        "another server, `oblique run` or `oblique view` already uses the database " + path +
        ": wait until it ends, or use another database");
  }
}

void ServerFile::check() const {
  struct stat found {};
  const bool exists = ::stat(path_.c_str(), &found) == 0;
  if (exists && found.st_dev == opened_.st_dev && found.st_ino == opened_.st_ino) {
    return;
  }
  // Other errors, such as a folder without search permission, do not mean that the file is gone.
  if (exists || errno == ENOENT || errno == ENOTDIR || errno == ESTALE) {
    throw StorageGone(fmt::format(
        "the file {} was {} while the server used it. Nothing more is stored, and the server "
        "ends. Restore the file or a copy and start the server again; running workers "
        "have kept all results that are not stored",
        path_, exists ? "replaced" : "deleted or renamed"));
  }
}

DraftFile::DraftFile(std::string path) : path_(std::move(path)) {
  remove();
  const protocol::Descriptor file(
      ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kOwnerOnly));
  if (file.number() < 0) {
    throw StorageError("cannot write " + path_ + ": " + std::strerror(errno));
  }
}

void DraftFile::keep_as(const std::string& name) const {
  const protocol::Descriptor file(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
  std::error_code error;
  if (file.number() >= 0 && ::fsync(file.number()) == 0) {
    fs::rename(path_, name, error);
  } else {
    error = std::error_code(errno, std::generic_category());
  }
  // EINVAL: the file system cannot sync folders
  if (!error && ::fsync(protocol::open_folder_of(name).number()) != 0 && errno != EINVAL) {
    error = std::error_code(errno, std::generic_category());
  }
  if (error) {
    throw StorageError("cannot write " + name + ": " + error.message());
  }
}

void DraftFile::remove() const {
  std::error_code ignored;
  for (const char* suffix : {"", "-journal", "-wal", "-shm"}) {
    fs::remove(path_ + suffix, ignored);
  }
}

}  // namespace oblique::server
