#include "server/database/shared_disk.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>
#include <system_error>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

constexpr std::array<std::string_view, 25> kNetworkTypes{
    "nfs",          "nfs4",           "cifs",         "smb3",      "smbfs",
    "afs",          "ceph",           "glusterfs",    "lustre",    "beegfs",
    "gpfs",         "orangefs",       "pvfs2",        "davfs",     "fuse.sshfs",
    "fuse.ceph",    "fuse.glusterfs", "fuse.rclone",  "fuse.s3fs", "fuse.davfs2",
    "fuse.moosefs", "fuse.juicefs",   "fuse.gcsfuse", "panfs",     "wekafs"};

/// A path of mountinfo, where some letters are written as a backslash and three octal digits.
std::string unescaped(const std::string& text) {
  std::string path;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto digit = [&](std::size_t at) { return text[at] >= '0' && text[at] <= '7'; };
    if (text[i] == '\\' && i + 3 < text.size() && digit(i + 1) && digit(i + 2) && digit(i + 3)) {
      path += static_cast<char>(std::stoi(text.substr(i + 1, 3), nullptr, 8));
      i += 3;
    } else {
      path += text[i];
    }
  }
  return path;
}

bool holds(const std::string& mount_point, const std::string& path) {
  return mount_point == "/" || path == mount_point ||
         (path.size() > mount_point.size() &&
          path.compare(0, mount_point.size(), mount_point) == 0 && path[mount_point.size()] == '/');
}

}  // namespace

std::string file_system_of(const std::string& path, const std::string& mounts) {
  std::istringstream lines(mounts);
  std::string line;
  std::string longest;
  std::string type;
  while (std::getline(lines, line)) {
    // number parent major:minor root MOUNT_POINT options [more ...] - TYPE source options
    std::istringstream words(line);
    const std::vector<std::string> fields{std::istream_iterator<std::string>(words), {}};
    const auto dash = std::find(fields.begin(), fields.end(), "-");
    if (fields.size() < 6 || dash == fields.end() || dash + 1 == fields.end()) {
      continue;
    }
    const std::string mount_point = unescaped(fields[4]);
    // Of two mounts at one point the later one hides the other.
    if (holds(mount_point, path) && mount_point.size() >= longest.size()) {
      longest = mount_point;
      type = *(dash + 1);
    }
  }
  return type;
}

std::string objection_to_shared_disk(const std::string& path) {
  std::error_code error;
  const auto real = std::filesystem::weakly_canonical(std::filesystem::absolute(path), error);
  std::ifstream file("/proc/self/mountinfo");
  const std::string mounts(std::istreambuf_iterator<char>(file), {});
  const std::string type = error ? std::string() : file_system_of(real.string(), mounts);
  if (std::find(kNetworkTypes.begin(), kNetworkTypes.end(), type) == kNetworkTypes.end()) {
    return {};
  }
  return path + " is on a network file system (" + type +
         "), where two machines could write at once and damage the database: name a file on a "
         "local "
         "disk, or pass --allow-network-disk if no other machine uses it";
}

const std::string& path_on_own_disk(const std::string& path, bool allows_network_disk) {
  const std::string objection = objection_to_shared_disk(path);
  if (!objection.empty() && !allows_network_disk) {
    throw StorageError(objection);
  }
  return path;
}

}  // namespace oblique::server
