#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "client/study/reach.h"
#include "client/study/study.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// Reads a study file (format: README.md of this folder) and checks it, including `check_reach`,
/// block by block. A file without `name` is named after itself. Throws solver::InputError with
/// file, line if known, key, value and what is allowed.
Study read_study_file(const std::filesystem::path& path, const ReachCheck& check_reach);

/// The same for the text of a study file; errors call it `file`.
Study parse_study(std::string_view text, const std::string& file, const ReachCheck& check_reach);

/// Writes a valid recipe as a study file of that name. Reading it gives a recipe of the same
/// digest. Values from CSV files become lists.
std::string study_toml(const std::string& name, const protocol::Recipe& recipe);

}  // namespace oblique::client
