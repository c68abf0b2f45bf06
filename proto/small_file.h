#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <sys/stat.h>

#include "proto/system/descriptor.h"

namespace oblique::protocol {

/// Reads a regular file of at most `most_bytes`; /dev/null counts as empty. Does not block on a
/// pipe. Throws solver::InputError for other files; its message begins with `what`, such as "the
/// key file", and `path`.
std::string read_small_file(const std::string& path, std::string_view what, std::size_t most_bytes);

/// Opens the folder of `path`, for a lock or a sync: a new name survives a power failure once its
/// folder is synced. Throws std::runtime_error.
Descriptor open_folder_of(const std::string& path);

/// Returns the kind of a file with this `st_mode`, such as "a pipe".
inline const char* kind_of_file(mode_t mode) {
  return S_ISREG(mode)    ? "a regular file"
         : S_ISDIR(mode)  ? "a directory"
         : S_ISFIFO(mode) ? "a pipe"
         : S_ISSOCK(mode) ? "a socket"
                          : "a device";
}

}  // namespace oblique::protocol
