#include "server/database/database_in_use.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace oblique::server {

bool is_in_use(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) {
    return false;
  }
  // Shared, and for an instant: a server that takes its lock just then tries again; see
  // DatabaseFiles.
  const bool is_locked = ::flock(file, LOCK_SH | LOCK_NB) != 0;
  ::close(file);
  return is_locked;
}

}  // namespace oblique::server
