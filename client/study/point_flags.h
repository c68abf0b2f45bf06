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

/// Texts of the flags that define points and models.
struct PointFlags {
  std::string preset{solver::preset_names().front()};
  std::string lengths;                      ///< "0.4,0.4,0.3"; empty: from links and length
  std::map<std::string, std::string> axes;  ///< text of each given flag, by key
  bool zip = false;
  std::string sample;  ///< "sobol:1000:1"; empty: no sample
  std::string where;   ///< empty: all points

  bool operator==(const PointFlags&) const = default;
};

/// Whether each flag takes one value (`solve`), or also lists and ranges.
enum class FlagValues { kOne, kMany };

/// Adds --H, --mu, --e, --preset, --lengths, and a flag for every model key and single length
/// (--length1 ...). Adds a table of presets below the help text. `flags` must live as long as
/// `command`.
void add_point_flags(CLI::App& command, PointFlags& flags, FlagValues values);

/// Returns the flag of a key: --tip-mass for `tip_mass`.
std::string flag_of_key(std::string_view key);

/// Parses the text of a flag into an axis: `0.4`, `0.4,0.6,0.8`, `0.1:2.0:40` (from:to:count, both
/// ends included), `0.01:2:40:log`, `0.5:1:step=0.05`, `@measured.csv:drop`, an expression such as
/// `A^2/(4*pi)`; in a sample also `0.3:1.1` and `normal(0.4,0.05)`. Throws InputError that names
/// the key.
protocol::Axis axis_of_flag(const solver::ParameterKey& key, std::string_view text,
                            protocol::BlockKind kind, CsvFiles& files);

/// Returns the recipe of the flags after the same checks as for a file, including `check_reach`. A
/// model key with one value belongs to the model; with several values it is an axis. Throws
/// InputError that names the flag. Does not check values that depend on the point.
protocol::Recipe recipe_of_flags(const PointFlags& flags, const ReachCheck& check_reach);

/// Returns the points of the flags' recipe, with all values checked. Throws InputError.
protocol::PointTable points_of_flags(const PointFlags& flags, const ReachCheck& check_reach);

/// Returns the flags as typed, as places for error messages.
Places places_of(const PointFlags& flags);

/// Defines a study by a file or by point flags.
struct StudyFlags {
  std::filesystem::path file;  ///< if empty, the point flags define the study
  std::string name;            ///< default: the file's name, or a name made from the recipe
  PointFlags points;
  bool errors = false;  ///< estimates errors even if the file does not request it
};

/// Adds the argument STUDY.toml, --name, --errors and the point flags. `flags` must live as long as
/// `command`.
void add_study_flags(CLI::App& command, StudyFlags& flags);

/// Returns the study that the flags define. Throws InputError if both a file and flags define
/// points, or neither does, and for errors in either, including `check_reach`. Values that depend
/// on the point are checked by `check_points`.
Study study_of_flags(const StudyFlags& flags, const ReachCheck& check_reach);

/// Returns "sweep-" and the first eight digits of the recipe's digest
/// (proto/recipe/model_message.h), so that the same points always get the same name.
std::string name_of_recipe(const protocol::Recipe& recipe);

}  // namespace oblique::client
