#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace oblique::protocol {

/// The contents of a regular file of at most `most_bytes`, or nothing for /dev/null. Never waits
/// for a pipe. Throws solver::InputError for other files; the message begins with `what`, as "the
/// key file", and `path`.
std::string read_small_file(const std::string& path, std::string_view what, std::size_t most_bytes);

}  // namespace oblique::protocol
