#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "client/axis.h"

namespace oblique::client {

/// Reads a study file (README.md of this folder describes the format) and checks all of it, the
/// reach of the tip included. A file without `name` is named after itself. Throws
/// solver::InputError naming file, line where it is known, key, value and what is allowed.
Study read_study_file(const std::filesystem::path& path);

/// The same for the text of a study file; `file` is what errors call it.
Study parse_study(std::string_view text, const std::string& file);

}  // namespace oblique::client
