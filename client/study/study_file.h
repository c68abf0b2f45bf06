#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "client/study/reach.h"
#include "client/study/study.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// Reads a study file (README.md of this folder describes the format) and has all of it judged,
/// also by `check_reach`, block by block. A file without `name` is named after itself. Throws
/// solver::InputError naming file, line where it is known, key, value and what is allowed.
Study read_study_file(const std::filesystem::path& path, const ReachCheck& check_reach);

/// The same for the text of a study file; `file` is what errors call it.
Study parse_study(std::string_view text, const std::string& file, const ReachCheck& check_reach);

/// A study file of that name and recipe: read again it gives a recipe of the same digest.
/// The recipe is one that was judged. What came from CSV files stands in it as lists.
std::string study_toml(const std::string& name, const protocol::Recipe& recipe);

}  // namespace oblique::client
