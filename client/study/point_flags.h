#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

#include "client/study/csv_file.h"
#include "client/study/reach.h"
#include "client/study/study.h"
#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// The texts of the flags for points and models.
struct PointFlags {
  std::string preset{solver::preset_names().front()};
  std::string lengths;                      ///< "0.4,0.4,0.3"; empty: by links and length
  std::map<std::string, std::string> axes;  ///< text of each given flag, by key
  bool zip = false;
  std::string sample;  ///< "sobol:1000:1"; empty: none
  std::string where;   ///< empty: all points

  bool operator==(const PointFlags&) const = default;
};

/// Whether flags may give one value only (`solve`) or lists and ranges as well.
enum class FlagValues { kOne, kMany };

/// Adds --H, --mu, --e, --preset, --lengths, a flag for every model key and for single lengths
/// (--length1 ...), and a table of presets to the footer of help. `flags` must live as long as
/// `command`.
void add_point_flags(CLI::App& command, PointFlags& flags, FlagValues values);

/// How a key is written as a flag: `tip_mass` is --tip-mass.
std::string flag_of_key(std::string_view key);

/// The axis of a flag's text: `0.4`, `0.4,0.6,0.8`, `0.1:2.0:40` (from:to:count, both ends
/// included), `0.01:2:40:log`, `0.5:1:step=0.05`, `@measured.csv:drop`, an expression such as
/// `A^2/(4*pi)`; in a sample also `0.3:1.1` and `normal(0.4,0.05)`. Throws InputError for the key.
protocol::Axis axis_of_flag(const solver::ParameterKey& key, std::string_view text,
                            protocol::BlockKind kind, CsvFiles& files);

/// The recipe of the flags, checked like that of a file, `check_reach` included. Model keys with
/// one value belong to the model; with several they are axes. Throws InputError with the flag as
/// its place. Values that only points show are not checked yet.
protocol::Recipe recipe_of_flags(const PointFlags& flags, const ReachCheck& check_reach);

/// The points of that recipe for a caller that solves them here: all values are checked. Throws
/// InputError.
protocol::PointTable points_of_flags(const PointFlags& flags, const ReachCheck& check_reach);

/// The flags as they were typed.
Places places_of(const PointFlags& flags);

/// Where a study comes from: a file, or the point flags.
struct StudyFlags {
  std::filesystem::path file;  ///< empty: by the point flags
  std::string name;            ///< empty: the file's name, or one made from the recipe
  PointFlags points;
  bool errors = false;  ///< estimated errors, also where the file does not ask for them
};

/// Adds the STUDY.toml argument, --name, --errors and the point flags. `flags` must live as long as
/// `command`.
void add_study_flags(CLI::App& command, StudyFlags& flags);

/// Throws InputError when both a file and flags say what the points are, or none, and for what
/// either says wrong, `check_reach` included. What only its points tell is left to `check_points`.
Study study_of_flags(const StudyFlags& flags, const ReachCheck& check_reach);

/// "sweep-" and the first eight digits of the recipe's digest (proto/recipe/model_message.h), so
/// that the same points name the same study again.
std::string name_of_recipe(const protocol::Recipe& recipe);

}  // namespace oblique::client
