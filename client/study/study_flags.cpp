#include "client/study/study_flags.h"

#include <cstddef>

#include <spdlog/fmt/fmt.h>

#include "client/study/study_file.h"
#include "proto/recipe/model_message.h"

namespace oblique::client {

using solver::InputError;

std::string name_of_recipe(const protocol::Recipe& recipe) {
  constexpr std::size_t kDigits = 8;
  return fmt::format("sweep-{}", protocol::recipe_digest(recipe).substr(0, kDigits));
}

void add_study_flags(CLI::App& verb, StudyFlags& flags, bool with_single_lengths) {
  verb.add_option(
          "STUDY.toml", flags.file,
          "study file; or say the points by the flags below, whose VALUES are 0.4, 0.4,0.6, "
          "FROM:TO:COUNT, FROM:TO:COUNT:log, FROM:TO:step=STEP, @FILE.csv:COLUMN or an "
          "expression of other keys, as \"A^2/(4*pi)\"")
      ->type_name("");
  verb.add_option("--name", flags.name,
                  "name of the study; by default the file's, or `sweep-` and a hash of the flags")
      ->type_name("NAME");
  verb.add_flag("--errors", flags.errors,
                "estimate errors: solve each point also on half the mesh and at twice the step, at "
                "a quarter more cost")
      ->group("Points");
  add_point_flags(verb, flags.points, FlagValues::kMany, with_single_lengths);
}

Study study_of_flags(const StudyFlags& flags, const ReachCheck& check_reach) {
  const bool by_flags = flags.points != PointFlags();
  if (flags.file.empty() && !by_flags) {
    throw InputError("no points: give a study file, or --H, --mu and --e");
  }
  if (!flags.file.empty() && by_flags) {
    throw InputError("both the study file " + flags.file.string() +
                     " and flags for points or model are given: use one of them (the file has a "
                     "[model] of its own)");
  }
  Study study;
  if (flags.file.empty()) {
    study.recipe = recipe_of_flags(flags.points, check_reach);
    study.places = places_of(flags.points);
  } else {
    study = read_study_file(flags.file, check_reach);
  }
  study.recipe.set_errors(study.recipe.errors() || flags.errors);
  if (flags.file.empty()) {
    study.name = name_of_recipe(study.recipe);
  }
  if (!flags.name.empty()) {
    if (const auto objection = protocol::objection_to_study_name(flags.name); !objection.empty()) {
      throw InputError({.text = objection, .key = "name", .place = "--name"});
    }
    study.name = flags.name;
  }
  return study;
}

}  // namespace oblique::client
