#pragma once

#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

#include "client/study/point_flags.h"
#include "client/study/reach.h"
#include "client/study/study.h"

namespace oblique::client {

/// Where a study comes from: a file, or the point flags.
struct StudyFlags {
  std::filesystem::path file;  ///< empty: by the point flags
  std::string name;            ///< empty: the file's name, or one made from the recipe
  PointFlags points;
  bool errors = false;  ///< estimated errors, also where the file does not ask for them
};

/// Adds the STUDY.toml argument, --name, --errors and the point flags. `flags` must live as long as
/// `verb`.
void add_study_flags(CLI::App& verb, StudyFlags& flags, bool with_single_lengths);

/// Throws InputError when both a file and flags say what the points are, or none, and for what
/// either says wrong, `check_reach` included. What only its points tell is left to `judge_points`.
Study study_of_flags(const StudyFlags& flags, const ReachCheck& check_reach);

/// "sweep-" and the first eight digits of the recipe's digest (proto/recipe/model_message.h), so
/// that the same points name the same study again.
std::string name_of_recipe(const protocol::Recipe& recipe);

}  // namespace oblique::client
