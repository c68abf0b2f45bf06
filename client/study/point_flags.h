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

/// Texts of the flags for points and models.
struct PointFlags {
  std::string preset{solver::preset_names().front()};
  std::string lengths;                      ///< "0.4,0.4,0.3"; empty: from links and length
  std::map<std::string, std::string> axes;  ///< text of each given flag by key
  bool zip = false;
  std::string sample;  ///< "sobol:1000:1"; empty: none
  std::string where;   ///< empty: all points

  bool operator==(const PointFlags&) const = default;
};

/// Whether flags take one value (`solve`) or also lists and ranges.
enum class FlagValues { kOne, kMany };

/// Adds --H, --mu, --e, --preset, --lengths, a flag for every model key and single length
/// (--length1 ...), and a table of presets in the footer of help. `flags` must live as long as
/// `command`.
void add_point_flags(CLI::App& command, PointFlags& flags, FlagValues values);

/// The flag of a key: --tip-mass for `tip_mass`.
std::string flag_of_key(std::string_view key);

/// Parses the text of a flag to an axis: `0.4`, `0.4,0.6,0.8`, `0.1:2.0:40` (from:to:count, both
/// ends included), `0.01:2:40:log`, `0.5:1:step=0.05`, `@measured.csv:drop`, an expression such as
/// `A^2/(4*pi)`; in a sample also `0.3:1.1` and `normal(0.4,0.05)`. Throws InputError for the key.
protocol::Axis axis_of_flag(const solver::ParameterKey& key, std::string_view text,
                            protocol::BlockKind kind, CsvFiles& files);

/// The recipe of the flags, checked like that of a file, including `check_reach`. Model keys with
/// one value belong to the model; with several they are axes. Throws InputError with the flag as
/// its place. Values that depend on the point are not checked yet.
protocol::Recipe recipe_of_flags(const PointFlags& flags, const ReachCheck& check_reach);

/// The points of that recipe, with all values checked. Throws InputError.
protocol::PointTable points_of_flags(const PointFlags& flags, const ReachCheck& check_reach);

/// The flags as typed.
Places places_of(const PointFlags& flags);

/// The source of a study: a file or point flags.
struct StudyFlags {
  std::filesystem::path file;  ///< empty: point flags
  std::string name;            ///< empty: the name of the file, or one made from the recipe
  PointFlags points;
  bool errors = false;  ///< estimate errors, also if the file does not request it
};

/// Adds the argument STUDY.toml, --name, --errors and the point flags. `flags` must live as long as
/// `command`.
void add_study_flags(CLI::App& command, StudyFlags& flags);

/// Throws InputError if both a file and flags define points, or neither, and for errors in either,
/// including `check_reach`. Values that depend on the point are left to `check_points`.
Study study_of_flags(const StudyFlags& flags, const ReachCheck& check_reach);

/// "sweep-" and the first eight digits of the recipe's digest (proto/recipe/model_message.h), so
/// that the same points get the same name.
std::string name_of_recipe(const protocol::Recipe& recipe);

}  // namespace oblique::client
