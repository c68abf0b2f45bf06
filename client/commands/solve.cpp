#include <optional>
#include <ostream>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/io/case_report.h"
#include "client/study/point_flags.h"
#include "client/study/study.h"
#include "client/trace/solve_again.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

constexpr const char* kSolveExamples = R"(Examples:
  oblique solve --H 1 --mu 0.4 --e 1
  oblique solve --H 1 --mu 1.2 --e 0.8 --json
  oblique solve --H 1 --mu 1.2 --e 0.8 --errors
  oblique solve --H 1 --mu 0.4 --e 1 --trace impact.csv --trace-shape
  oblique solve --H 1 --mu 0.4 --e 1 --trace - > impact.csv
  oblique solve --H 0.6 --mu 0.4 --e 1 --preset converged --lengths 0.4,0.4,0.2)";

constexpr const char* kStandardOutput = "-";

struct SolveFlags {
  PointFlags points;
  bool json = false;
  std::optional<std::string> trace;  // file for the time histories; "-": standard output
  bool trace_shape = false;
  bool errors = false;
};

/// Opens the output for the trace. Throws InputError if `where` cannot be written, or if `where` is
/// standard output although `json` is set.
TraceOutput trace_output(const std::string& where, bool json) {
  if (where == kStandardOutput && json) {
    throw solver::InputError(
        "--trace - and --json both write to standard output: name a file for the trace");
  }
  return {where == kStandardOutput ? "" : where, Format::kCsv, "--trace"};
}

/// Rejects lists and ranges. Must come before the check of values, whose error would name only the
/// largest value of a list.
void check_one_value_each(const PointFlags& flags) {
  for (const auto& [key, text] : flags.axes) {
    const bool is_list = text.find(',') != std::string::npos && text.find('(') == std::string::npos;
    if (is_list || text.find(':') != std::string::npos || text.starts_with('@')) {
      throw solver::InputError(
          fmt::format("{} {}: solve takes one value per flag; `oblique run` takes lists and ranges",
                      flag_of_key(key), text));
    }
  }
}

int solve(const SolveFlags& flags, Console& console) {
  check_one_value_each(flags.points);
  const auto table = points_of_flags(flags.points, tip_reach(console));
  if (table.size() != 1) {
    throw solver::InputError(
        fmt::format("the flags define {} points, but solve takes one: give one value per flag, or "
                    "use `oblique run`",
                    table.size()));
  }
  note_unusual_values(console.notes(), table.recipe());
  const auto point = table.point(0);
  const solver::Finger finger(table.model(0));
  std::optional<TraceOutput> trace;
  solver::Tracing tracing;
  if (flags.trace) {
    trace.emplace(trace_output(*flags.trace, flags.json));
    const auto& model = finger.model();
    trace->begin(solver::trace_shape(model.lengths_m.size(),
                                     static_cast<std::size_t>(model.elements_per_link),
                                     flags.trace_shape));
    tracing.sink = [&trace](const solver::TraceRow& row) { trace->add(row); };
    tracing.with_shape = flags.trace_shape;
  }
  const bool shows_status = !trace || !trace->fills_terminal();
  const auto result = solve_here(console, finger, {point.H_m, point.mu, point.e_star, flags.errors},
                                 tracing, shows_status);
  if (flags.json) {
    console.out() << json_of(result).dump(2) << '\n';
  } else {
    print_summary(flags.trace == kStandardOutput ? console.notes() : console.out(), result);
  }
  if (trace) {
    trace->finish({}, result);
  }
  note_coarse_mesh(console.notes(), table.recipe());
  return kDone;
}

}  // namespace

void add_solve(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "solve", "Solve one point in this process", kSolveExamples, solve);
  command.add_flag("--json", flags.json, "print the result as one JSON object (SI units)");
  auto* trace = command
                    .add_option("--trace", flags.trace,
                                "write the time histories of the contact to FILE (CSV, SI units); "
                                "- is standard output")
                    ->type_name("FILE");
  command
      .add_flag("--trace-shape", flags.trace_shape,
                "add the positions of the chain's nodes to the trace")
      ->needs(trace);
  command.add_flag("--errors", flags.errors,
                   "estimate errors: also solve the point on half the mesh and at twice the step");
  add_point_flags(command, flags.points, FlagValues::kOne);
}

}  // namespace oblique::client
