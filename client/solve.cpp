#include <fstream>
#include <iostream>
#include <memory>
#include <string>

#include "client/case_report.h"
#include "client/point_flags.h"
#include "client/verbs.h"
#include "proto/recipe.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

constexpr const char* kExamples = R"(Examples:
  oblique solve --H 1 --mu 0.4 --e 1
  oblique solve --H 1 --mu 1.2 --e 0.8 --json
  oblique solve --H 1 --mu 0.4 --e 1 --trace impact.csv
  oblique solve --H 0.6 --mu 0.4 --e 1 --preset converged --lengths 0.4,0.4,0.2)";

struct SolveFlags {
  PointFlags points;
  bool json = false;
  std::string trace;  // empty: no trace
};

void check_one_point(const protocol::PointTable& table) {
  if (table.size() == 1) {
    return;
  }
  throw solver::InputError("the flags make " + std::to_string(table.size()) +
                           " points, and solve takes one: give one value each, or use `oblique "
                           "run` for all of them");
}

int solve(const SolveFlags& flags) {
  const protocol::PointTable table(recipe_of_flags(flags.points));
  check_one_point(table);
  const auto point = table.point(0);
  const solver::Finger finger(table.model(0));
  std::ofstream trace;
  solver::Finger::Extras extras;
  extras.reaction_peaks = true;
  if (flags.trace == "-") {
    throw solver::InputError("--trace - is not allowed: the trace goes to a file, name one");
  }
  if (!flags.trace.empty()) {
    trace.open(flags.trace);
    print_trace_header(trace, finger.model().lengths_m.size());
    extras.trace = [&trace](const solver::TraceRow& row) { print_trace_row(trace, row); };
    if (!trace) {
      throw solver::InputError("cannot write the trace to " + flags.trace);
    }
  }
  const auto result = finger.solve(point.H_m, point.mu, point.e_star, extras);
  if (flags.json) {
    std::cout << json_of(result).dump(2) << '\n';
  } else {
    print_summary(std::cout, result);
  }
  if (!flags.trace.empty() && !trace.flush()) {
    throw std::runtime_error("the trace could not be written whole to " + flags.trace);
  }
  return kDone;
}

}  // namespace

void add_solve(CLI::App& app, Command& command) {
  auto flags = std::make_shared<SolveFlags>();
  auto* verb = app.add_subcommand("solve", "Solve one point, here and now");
  verb->footer(kExamples);
  verb->add_flag("--json", flags->json, "print the result as one JSON object (SI units)");
  verb->add_option("--trace", flags->trace, "write the time histories of the contact to FILE (CSV)")
      ->type_name("FILE");
  add_point_flags(*verb, flags->points, FlagValues::kOne);
  verb->callback([flags, &command] { command = [flags] { return solve(*flags); }; });
}

}  // namespace oblique::client
