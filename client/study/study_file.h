#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "client/study/axis.h"
#include "client/study/reach.h"

namespace oblique::client {

/// Reads a study file (README.md of this folder describes the format) and checks all of it, the
/// reach of the tip included. A file without `name` is named after itself. Throws
/// solver::InputError naming file, line where it is known, key, value and what is allowed.
Study read_study_file(const std::filesystem::path& path);

/// Looks whether the tip reaches every H of a block, and throws solver::InputError where not.
using ReachCheck = std::function<void(const protocol::PointTable& table, int block)>;

/// The same for the text of a study file; `file` is what errors call it. `check` may be cheaper
/// than a ReachChecker, which solves falls.
Study parse_study(std::string_view text, const std::string& file,
                  const ReachCheck& check = ReachChecker());

}  // namespace oblique::client
