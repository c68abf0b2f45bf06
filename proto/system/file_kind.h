#pragma once

#include <sys/stat.h>

namespace oblique::protocol {

/// What a file is by its `st_mode`, as "a pipe".
inline const char* kind_of_file(mode_t mode) {
  return S_ISREG(mode)    ? "a regular file"
         : S_ISDIR(mode)  ? "a directory"
         : S_ISFIFO(mode) ? "a pipe"
         : S_ISSOCK(mode) ? "a socket"
                          : "a device";
}

}  // namespace oblique::protocol
