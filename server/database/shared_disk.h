#pragma once

#include <string>

namespace oblique::server {

/// Type of the file system that holds `path`, such as "ext4" or "nfs4". `mounts` is the text of
/// /proc/self/mountinfo. Empty when unknown.
std::string file_system_of(const std::string& path, const std::string& mounts);

/// Why a database at `path` (which need not exist) is not safe on its file system, or an empty
/// text. A network file system has neither the locks nor the shared memory that SQLite's
/// write-ahead log needs: two machines could write at once and damage the file.
std::string objection_to_shared_disk(const std::string& path);

/// Returns `path`. Throws StorageError when it is on a network disk and these are not allowed.
const std::string& path_on_own_disk(const std::string& path, bool allows_network_disk);

}  // namespace oblique::server
