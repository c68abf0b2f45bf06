#pragma once

#include <map>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

#include "client/study/reach.h"
#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// What the flags of points and models said, as plain text until they are read together.
struct PointFlags {
  std::string preset{solver::preset_names().front()};
  std::string lengths;                      ///< "0.4,0.4,0.3"; empty: by links and length
  std::map<std::string, std::string> axes;  ///< text of each given flag, by key
  bool zip = false;
  std::string sample;  ///< "sobol:1000:1"; empty: none
  std::string where;   ///< empty: all points
};

/// Whether flags may give one value only (`solve`) or lists and ranges as well.
enum class FlagValues { kOne, kMany };

/// Adds --H, --mu, --e, --preset, --lengths and a flag for every model key, and those of single
/// lengths (--length1 ...) if wanted, and a table of presets to the footer of help. `flags` must
/// live as long as `verb`.
void add_point_flags(CLI::App& verb, PointFlags& flags, FlagValues values,
                     bool with_single_lengths);

/// The recipe of all flags together, judged as study files are, also by `check_reach`. Model keys
/// with one value shape the model; with several they are axes. Throws InputError. What only its
/// points tell, as of an expression, is not judged yet.
protocol::Recipe recipe_of_flags(const PointFlags& flags, const ReachCheck& check_reach);

/// The points of that recipe, for whoever solves them here: what only they tell is judged too, as
/// `judge_points` does. Throws InputError.
protocol::PointTable points_of_flags(const PointFlags& flags, const ReachCheck& check_reach);

/// The sentence about the points, with the flag that it speaks of before it, as that was typed.
std::string with_flag(const PointFlags& flags, const std::string& sentence);

}  // namespace oblique::client
