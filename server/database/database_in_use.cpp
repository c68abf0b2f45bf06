#include "server/database/database_in_use.h"

#include <fcntl.h>

#include "proto/system/descriptor.h"

namespace oblique::server {
namespace {

/// A byte that SQLite does not lock.
struct flock servers_lock() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = off_t{1} << 62;
  lock.l_len = 1;
  return lock;
}

}  // namespace

bool lock_for_server(int file) {
  struct flock lock = servers_lock();
  return ::fcntl(file, F_OFD_SETLK, &lock) == 0;
}

bool is_in_use(const std::string& path) {
  const protocol::Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct flock lock = servers_lock();
  return ::fcntl(file.number(), F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

}  // namespace oblique::server
