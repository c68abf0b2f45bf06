#include <cstdint>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/trace/solve_again.h"
#include "proto/program/usage.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

constexpr const char* kTraceExamples = R"(Examples:
  oblique trace paper 3 > point3.csv
  oblique trace paper 3 --out point3.csv --shape --fall
  oblique trace paper 3 --format json > point3.json
  oblique trace paper 3 --server tcp://127.0.0.1:7600 --on-worker --out point3.csv

The point is solved again: in this process if the database is a file, else by a worker of the
server. The result is compared with the stored row; standard error shows whether they are equal.
`oblique columns --trace` describes the columns.)";

struct TraceFlags {
  std::string study;
  std::int64_t point = 0;
  std::string out;     // empty: standard output
  std::string format;  // empty: given by the ending of the file, else CSV
  TraceOptions options;
  PointSource source;
};

int trace(const TraceFlags& flags, Console& console) {
  using solver::readable_number;
  TraceOutput output(flags.out,
                     format_of_output(flags.format, flags.out, kTraceFormats, Format::kCsv));
  const auto solved = solve_again(
      console, flags.source, flags.study, static_cast<std::uint64_t>(flags.point), flags.options,
      [&](const solver::TraceShape& shape) { output.begin(shape); },
      [&](const solver::TraceRow& row) { output.add(row); }, !output.fills_terminal());
  const auto& point = solved.point;
  output.finish(point, solved.result);
  console.note(fmt::format("Point {} of {}: H = {} m, mu = {}, e* = {}; solved {}, {}.",
                           point.point, point.study, readable_number(point.H_m),
                           readable_number(point.mu), readable_number(point.e_star), solved.solver,
                           solved.comparison));
  return kDone;
}

}  // namespace

void add_trace(CLI::App& app, Action& parsed) {
  auto [command, flags] = new_command(
      app, parsed, "trace", "Write the time histories of one point of a study, solved again",
      kTraceExamples, trace);
  add_study_argument(command, flags.study);
  command.add_option("POINT", flags.point, "number of the point, from 0")
      ->required()
      ->check(protocol::whole_number_from(0))
      ->type_name("");
  command
      .add_option("--out", flags.out, "output file, written atomically; default: standard output")
      ->type_name("FILE");
  auto* format = command
                     .add_option("--format", flags.format,
                                 "csv or json; default: from the name of --out, else csv; the "
                                 "Python module returns NumPy arrays")
                     ->type_name("FORMAT");
  protocol::note_choices(format, kTraceFormats);
  command.add_flag("--shape", flags.options.with_shape, "add the positions of the chain's nodes");
  command.add_flag("--fall", flags.options.with_fall,
                   "begin with 121 rows of the fall, from release to touch; their times are "
                   "negative, their state is falling");
  command
      .add_option("--every", flags.options.every,
                  "write each K-th instant of the contact and all ends of phases")
      ->check(protocol::whole_number_from(1))
      ->type_name("K");
  add_point_source(command, flags.source);
}

}  // namespace oblique::client
