#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/convergence/convergence.h"
#include "client/io/console.h"
#include "client/io/progress.h"
#include "client/io/row_output.h"
#include "client/study/point_flags.h"
#include "client/trace/solve_again.h"
#include "proto/program/usage.h"
#include "proto/recipe/blocks.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

constexpr const char* kConvergeExamples = R"(Examples:
  oblique converge --H 1 --mu 0.4 --e 1
  oblique converge --H 1 --mu 0.6 --e 0.8 --finest 16 --json
  oblique converge --H 1 --mu 0.4 --e 1 --integrator generalized-alpha

Takes some seconds with the default --finest 32. With the explicit integrator the time of a contact
grows with the cube of the number of elements, the time of a fall linearly.)";

constexpr int kCoarsest = 4;
// Upper limit of --finest. The range of elements_per_link is checked later.
constexpr int kMaxElements = 1024;

struct ConvergeFlags {
  PointFlags points;
  bool json = false;
  int coarsest = kCoarsest;
  int finest = 0;  // 0 if not given
  int halvings = 2;
};

void note_levels(Console& console, const char* what, const std::vector<Level>& levels) {
  console.notes() << fmt::format("{}: {} levels, {} to {}\n", what, levels.size(),
                                 levels.front().name, levels.back().name);
}

/// Results of the mesh refinement and the step refinement, which are solved together.
struct BothRefinements {
  Refinement mesh;
  Refinement step;
  std::optional<SolvedLevel> exact_fall;  ///< nothing if the fall has a fixed step
};

BothRefinements refined(Console& console, const std::vector<Level>& meshes,
                        const std::vector<Level>& steps, const ContactPoint& point) {
  note_levels(console, "mesh", meshes);
  note_levels(console, "step", steps);
  StatusLine line(console);
  auto levels = meshes;
  levels.insert(levels.end(), steps.begin(), steps.end());
  const auto exact_fall = exact_fall_level(steps.front());
  if (exact_fall) {
    levels.push_back(*exact_fall);
  }
  const auto all = solve_levels(levels, point, line, [&line](const SolvedLevel& level) {
    line.print(fmt::format("{}: fall and contact took {}", level.level.name,
                           format_duration(level.wall_s)));
  });
  const auto end_of_meshes = all.begin() + static_cast<std::ptrdiff_t>(meshes.size());
  const auto end_of_steps = end_of_meshes + static_cast<std::ptrdiff_t>(steps.size());
  return {.mesh = refinement_of("mesh", {all.begin(), end_of_meshes}),
          .step = refinement_of("step", {end_of_meshes, end_of_steps}),
          .exact_fall = exact_fall ? std::optional(all.back()) : std::nullopt};
}

int converge(const ConvergeFlags& flags, Console& console) {
  const auto table = points_of_flags(flags.points, tip_reach(console));
  std::uint64_t points = 0;
  for (std::uint64_t i = 0; (i = table.first_passing(i, table.size())) < table.size(); ++i) {
    ++points;
  }
  if (points != 1) {
    throw solver::InputError(fmt::format(
        "the flags define {} points, but converge takes one: give one value per flag", points));
  }
  constexpr int kMaxHalvings = 8;
  if (flags.halvings < 2 || flags.halvings > kMaxHalvings) {
    throw solver::InputError(fmt::format(
        "--halvings {} is not allowed: it must be from 2 to {}, because an order needs three steps",
        flags.halvings, kMaxHalvings));
  }
  constexpr int kFinest = 32;
  const auto given = table.point(table.first_passing(0, table.size()));
  const auto model = table.model(given.model);
  const ContactPoint point{given.H_m, given.mu, given.e_star};
  const int finest = flags.finest == 0 ? std::max(kFinest, 4 * flags.coarsest) : flags.finest;
  const auto meshes = mesh_levels(model, flags.coarsest, finest);
  const auto steps = step_levels(model, point.e_star, flags.halvings);
  const auto [mesh, step, exact_fall] = refined(console, meshes, steps, point);
  if (flags.json) {
    nlohmann::ordered_json json{{"H", point.H_m}, {"mu", point.mu}, {"e", point.e_star}};
    json["mesh"] = json_of(mesh);
    json["step"] = json_of(step);
    if (exact_fall) {
      json["fall"] = json_of_fall(step, *exact_fall);
    }
    console.out() << json.dump(2) << '\n';
    return kDone;
  }
  console.out() << fmt::format(
      "H = {} m, mu = {}, e* = {}\n\nMesh: n elements a link, doubled from level to level\n\n",
      solver::exact_number(point.H_m), solver::exact_number(point.mu),
      solver::exact_number(point.e_star));
  print_refinement(console.out(), mesh);
  console.out() << fmt::format(
      "\nStep: steps of contact{}, halved from level to level, on n = {}\n\n",
      steps.back().model.dt_fall_s > 0.0 ? " and fall" : "", model.elements_per_link);
  print_refinement(console.out(), step);
  if (exact_fall) {
    console.out() << fall_sentence(step, *exact_fall);
  } else if (steps.back().model.dt_fall_s == 0.0) {
    console.out()
        << "The error of the fall is not estimated: no tolerance is smaller than its own.\n";
  }
  return kDone;
}

}  // namespace

void add_converge(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "converge",
                  "Refine mesh and step of one point and estimate the error of each output",
                  kConvergeExamples, converge);
  command.add_flag("--json", flags.json, "print one JSON object (SI units)");
  command.add_option("--coarsest", flags.coarsest, "elements per link of the coarsest mesh")
      ->check(CLI::Range(1, kMaxElements))
      ->type_name("N")
      ->capture_default_str();
  command
      .add_option("--finest", flags.finest,
                  "elements per link of the finest mesh, at least 4 times --coarsest; default: 32")
      ->check(CLI::Range(1, kMaxElements))
      ->type_name("N");
  command.add_option("--halvings", flags.halvings, "number of times the step is halved")
      ->type_name("N")
      ->capture_default_str();
  add_point_flags(command, flags.points, FlagValues::kMany);
}

}  // namespace oblique::client
