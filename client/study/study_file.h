#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "client/study/reach.h"
#include "client/study/study.h"

namespace oblique::client {

/// Reads a study file (README.md of this folder describes the format) and has all of it judged,
/// also by `check_reach`, block by block. A file without `name` is named after itself. Throws
/// solver::InputError naming file, line where it is known, key, value and what is allowed.
Study read_study_file(const std::filesystem::path& path, const ReachCheck& check_reach);

/// The same for the text of a study file; `file` is what errors call it.
Study parse_study(std::string_view text, const std::string& file, const ReachCheck& check_reach);

}  // namespace oblique::client
