#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/convergence/convergence.h"
#include "client/convergence/convergence_report.h"
#include "client/convergence/levels.h"
#include "client/convergence/mesh_study.h"
#include "client/convergence/step_study.h"
#include "client/output/human_units.h"
#include "client/output/printer.h"
#include "client/output/work_line.h"
#include "client/study/point_flags.h"
#include "client/verbs/tip_reach.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"
#include "proto/recipe/blocks.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

constexpr const char* kConvergeExamples = R"(Examples:
  oblique converge --H 1 --mu 0.4 --e 1
  oblique converge --H 1 --mu 0.6 --e 0.8 --finest 16 --json
  oblique converge --H 1 --mu 0.4 --e 1 --integrator generalized-alpha
  oblique converge --mesh-study                     the study that the preset `converged` rests on
  oblique converge --step-study --preset paper      the study that chosen steps rest on

A finest mesh of 32 takes some seconds. The work of a contact grows with the cube of the mesh for the
explicit integrator, that of a fall with the mesh.)";

constexpr int kCoarsest = 4;
constexpr int kStudyCoarsest = 6;
constexpr int kStudyFinest = 96;
// The check of the mesh itself says what a model may have.
constexpr int kMostElements = 1024;

struct ConvergeFlags {
  PointFlags points;
  bool mesh_study = false;
  bool step_study = false;
  bool json = false;
  int coarsest = 0;  // 0: not given
  int finest = 0;
  int halvings = 2;
  double within_percent = 0.5;
};

std::vector<ContactPoint> points_of(const protocol::PointTable& table) {
  std::vector<ContactPoint> points;
  for (std::uint64_t i = table.first_left_in(0, table.size()); i < table.size();
       i = table.first_left_in(i + 1, table.size())) {
    const auto point = table.point(i);
    points.push_back({point.H_m, point.mu, point.e_star});
  }
  return points;
}

/// That of the first point that is left in.
solver::ModelParameters first_model(const protocol::PointTable& table) {
  return table.model(table.point(table.first_left_in(0, table.size())).model);
}

void tell_levels(const char* what, const std::vector<Level>& levels) {
  std::cerr << fmt::format("{}: {} levels, {} to {}\n", what, levels.size(), levels.front().name,
                           levels.back().name);
}

std::vector<SolvedLevel> solved(const std::vector<Level>& levels,
                                const std::vector<ContactPoint>& points, WorkLine& line) {
  return solve_levels(levels, points, line, [&line](const SolvedLevel& level) {
    line.tell(fmt::format("{} solved in {}", level.level.name, shown_duration(level.wall_s)));
  });
}

/// One point refined in both ways, all levels side by side.
struct BothRefinements {
  Refinement mesh;
  Refinement step;
  std::optional<SolvedLevel> exact_fall;  ///< where the fall has no step to halve
};

BothRefinements refined(const std::vector<Level>& meshes, const std::vector<Level>& steps,
                        const std::vector<ContactPoint>& points, WorkLine& line) {
  tell_levels("mesh", meshes);
  tell_levels("step", steps);
  auto levels = meshes;
  levels.insert(levels.end(), steps.begin(), steps.end());
  const auto exact_fall = exact_fall_level(steps.front());
  if (exact_fall) {
    levels.push_back(*exact_fall);
  }
  const auto all = solved(levels, points, line);
  const auto end_of_meshes = all.begin() + static_cast<std::ptrdiff_t>(meshes.size());
  const auto end_of_steps = end_of_meshes + static_cast<std::ptrdiff_t>(steps.size());
  return {.mesh = refinement_of("mesh", {all.begin(), end_of_meshes}, 0),
          .step = refinement_of("step", {end_of_meshes, end_of_steps}, 0),
          .exact_fall = exact_fall ? std::optional(all.back()) : std::nullopt};
}

std::string shown(const ContactPoint& point) {
  return fmt::format("H = {} m, mu = {}, e* = {}", solver::exact_number(point.H_m),
                     solver::exact_number(point.mu), solver::exact_number(point.e_star));
}

nlohmann::ordered_json json_of_point(const ContactPoint& point) {
  return {{"H", point.H_m}, {"mu", point.mu}, {"e", point.e_star}};
}

int converge(const ConvergeFlags& flags, const protocol::PointTable& table, WorkLine& line) {
  const auto points = points_of(table);
  if (points.size() != 1) {
    throw solver::InputError(fmt::format(
        "the flags make {} points, and converge takes one: give one value each", points.size()));
  }
  constexpr int kMostHalvings = 8;
  if (flags.halvings < 2 || flags.halvings > kMostHalvings) {
    throw solver::InputError(fmt::format(
        "--halvings {} is not allowed: it must be from 2 to {}, for an order needs three "
        "steps",
        flags.halvings, kMostHalvings));
  }
  constexpr int kFinest = 32;
  const auto model = first_model(table);
  const int coarsest = flags.coarsest == 0 ? kCoarsest : flags.coarsest;
  const int finest = flags.finest == 0 ? std::max(kFinest, 4 * coarsest) : flags.finest;
  const auto meshes = mesh_levels(model, coarsest, finest);
  const auto steps = step_levels(model, points[0].e_star, flags.halvings);
  const auto [mesh, step, exact_fall] = refined(meshes, steps, points, line);
  if (flags.json) {
    auto json = json_of_point(points[0]);
    json["mesh"] = json_of(mesh);
    json["step"] = json_of(step);
    if (exact_fall) {
      json["fall"] = json_of_fall(step, *exact_fall);
    }
    std::cout << json.dump(2) << '\n';
    return kDone;
  }
  std::cout << shown(points[0]) << "\n\nMesh: n elements a link, doubled\n\n";
  print_refinement(std::cout, mesh);
  std::cout << fmt::format("\nStep: steps of contact{}, halved, on n = {}\n\n",
                           exact_fall ? "" : " and fall", model.elements_per_link);
  print_refinement(std::cout, step);
  if (exact_fall) {
    std::cout << fall_sentence(step, *exact_fall);
  }
  return kDone;
}

/// Of a study that refines one model.
solver::ModelParameters only_model(const protocol::PointTable& table, const char* study) {
  if (table.models() != 1) {
    throw solver::InputError(
        fmt::format("the flags make {} models, and {} takes one: give each key of the model one "
                    "value",
                    table.models(), study));
  }
  return first_model(table);
}

/// Points that would be of no effect are refused.
void refuse_points(const PointFlags& flags) {
  std::string given = !flags.sample.empty() ? "--sample" : !flags.where.empty() ? "--where" : "";
  for (const auto key : protocol::kPointKeyOrder) {
    if (flags.axes.contains(std::string(key))) {
      given = fmt::format("--{}", key);
    }
  }
  if (!given.empty() || flags.zip) {
    throw solver::InputError(
        fmt::format("{} is not allowed with --step-study, which has its own points over all drops, "
                    "frictions and restitutions: give keys of the model alone",
                    given.empty() ? "--zip" : given));
  }
}

int mesh_study(const ConvergeFlags& flags, const protocol::PointTable& table, WorkLine& line) {
  const auto model = only_model(table, "a mesh study");
  const auto points = points_of(table);
  const int coarsest = flags.coarsest == 0 ? kStudyCoarsest : flags.coarsest;
  const int finest = flags.finest == 0 ? std::max(kStudyFinest, 4 * coarsest) : flags.finest;
  const auto meshes = mesh_levels(model, coarsest, finest);
  tell_levels("mesh", meshes);
  const auto levels = solved(meshes, points, line);
  std::vector<Refinement> refinements;
  for (std::size_t i = 0; i < points.size(); ++i) {
    refinements.push_back(refinement_of("mesh", levels, i));
  }
  const auto study = study_of(refinements, flags.within_percent / 100.0);
  if (flags.json) {
    auto json = json_of(study);
    for (std::size_t i = 0; i < points.size(); ++i) {
      auto point = json_of_point(points[i]);
      point["mesh"] = json_of(refinements[i]);
      json["points"].push_back(point);
    }
    std::cout << json.dump(2) << '\n';
    return kDone;
  }
  constexpr std::size_t kFew = 4;  // points that are shown one by one
  for (std::size_t i = 0; i < points.size() && points.size() <= kFew; ++i) {
    std::cout << shown(points[i]) << ": difference from the limit\n\n";
    print_errors(std::cout, refinements[i]);
    print_modes(std::cout, refinements[i]);
    std::cout << '\n';
  }
  print_study(std::cout, study, points);
  return kDone;
}

int step_study_around(const solver::ModelParameters& model, Format format, WorkLine& line) {
  const auto results = step_study(step_study_cases(model), [&line](const StepStudyResult& result) {
    line.tell(fmt::format("steps: {} done", result.name));
  });
  print_step_study(std::cout, results, format);
  return kDone;
}

int converge_of_flags(ConvergeFlags flags) {
  if (flags.step_study) {
    refuse_points(flags.points);
  }
  if (flags.mesh_study || flags.step_study) {
    flags.points.axes.try_emplace("H", "0.4,0.7,1");
    flags.points.axes.try_emplace("mu", "0.1,0.4,0.8,1.2,1.6");
    flags.points.axes.try_emplace("e", "1,0.6");
  }
  const auto table = points_of_flags(flags.points, tip_reach());
  WorkLine line;
  if (flags.step_study) {
    return step_study_around(only_model(table, "a step study"),
                             flags.json ? Format::kJson : Format::kTable, line);
  }
  return flags.mesh_study ? mesh_study(flags, table, line) : converge(flags, table, line);
}

}  // namespace

void add_converge(CLI::App& app, Command& command) {
  auto flags = std::make_shared<ConvergeFlags>();
  auto* verb = app.add_subcommand(
      "converge", "Refine mesh and step of one point and estimate the error of every output");
  verb->footer(kConvergeExamples);
  verb->add_flag("--json", flags->json, "print one JSON object (SI units)");
  verb->add_option("--coarsest", flags->coarsest,
                   "elements a link of the coarsest mesh; default 4, for the mesh study 6")
      ->check(CLI::Range(1, kMostElements))
      ->type_name("N");
  verb->add_option("--finest", flags->finest,
                   "elements a link of the finest mesh, at least 4 times the coarsest; default 32, "
                   "for the mesh study 96")
      ->check(CLI::Range(1, kMostElements))
      ->type_name("N");
  verb->add_option("--halvings", flags->halvings, "how often the step is halved")
      ->type_name("N")
      ->capture_default_str();
  auto* study =
      verb->add_flag("--mesh-study", flags->mesh_study,
                     "mesh alone, at thirty points unless said otherwise: errors of every mesh");
  verb->add_flag("--step-study", flags->step_study,
                 "steps alone, over many points and models around the one given: what they leave "
                 "against far shorter ones on the same mesh (half a minute)")
      ->excludes(study);
  verb->add_option("--within", flags->within_percent,
                   "of the mesh study: largest difference of a mesh that is good enough [%]")
      ->type_name("PERCENT")
      ->check(protocol::number_between(1e-9, 100.0))
      ->needs(study)
      ->capture_default_str();
  add_point_flags(*verb, flags->points, FlagValues::kMany, command.names_single_lengths);
  verb->callback([flags, &command] { command = [flags] { return converge_of_flags(*flags); }; });
}

}  // namespace oblique::client
