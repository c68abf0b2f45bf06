#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "client/study/reach.h"
#include "client/study/study.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// Reads a study file (format: README.md of this folder) and checks it block by block, including
/// `check_reach`. A study without `name` gets the name of its file. Throws solver::InputError with
/// file, line if known, key, value and the allowed values.
Study read_study_file(const std::filesystem::path& path, const ReachCheck& check_reach);

/// Parses the text of a study file with the same checks; errors call it `file`.
Study parse_study(std::string_view text, const std::string& file, const ReachCheck& check_reach);

/// Writes a valid recipe as a study file with the name `name`. Reading it back gives a recipe with
/// the same digest. Values from CSV files become lists.
std::string study_toml(const std::string& name, const protocol::Recipe& recipe);

}  // namespace oblique::client
