// A library that a test loads into a program with LD_PRELOAD. File syncs of the program fail while
// the file named by OBLIQUE_FAIL_SYNC exists.
#include <dlfcn.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

namespace {

using Sync = int (*)(int);

int sync_unless_failing(const char* name, int file) {
  const char* const mark = std::getenv("OBLIQUE_FAIL_SYNC");
  if (mark != nullptr && ::access(mark, F_OK) == 0) {
    errno = EIO;
    return -1;
  }
  return reinterpret_cast<Sync>(::dlsym(RTLD_NEXT, name))(file);
}

}  // namespace

extern "C" {
int fsync(int file) {
  return sync_unless_failing("fsync", file);
}
int fdatasync(int file) {
  return sync_unless_failing("fdatasync", file);
}
}
