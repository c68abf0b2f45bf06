#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/output/work_line.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/trace/stored_comparison.h"
#include "client/trace/trace_output.h"
#include "client/trace/worker_trace.h"
#include "client/verbs/solve_here.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

constexpr const char* kTraceExamples = R"(Examples:
  oblique trace paper 3 > point3.csv
  oblique trace paper 3 --out point3.csv --shape --fall
  oblique trace paper 3 --format json > point3.json
  oblique trace paper 3 --server tcp://127.0.0.1:7600 --on-worker --out point3.csv

The point is solved again with the model of its study, here when the database is a file and by a
worker of the server otherwise, and held against the stored row: standard error says whether they
are the same. `oblique columns --trace` says what the columns of a trace mean.)";

struct TraceFlags {
  std::string study;
  std::int64_t point = 0;
  std::string out;     // empty: standard output
  std::string format;  // empty: as the file's name ends, or CSV
  bool shape = false;
  bool fall = false;
  std::uint64_t every = 1;
  bool local = false;
  bool on_worker = false;
  SourceFlags source;
};

/// The point solved again.
struct Solved {
  PointSpec point;
  std::optional<solver::CaseResult> result;  // none: it has outputs that are unknown here
  std::string where;                         // as a sentence part
};

std::string named(const PointSpec& point) {
  return fmt::format("Point {} of {}: H = {} m, mu = {}, e* = {}", point.point, point.study,
                     solver::readable_number(point.H_m), solver::readable_number(point.mu),
                     solver::readable_number(point.e_star));
}

[[noreturn]] void throw_failure(const TraceFlags& flags, const std::string& reason) {
  throw std::runtime_error(
      fmt::format("point {} of {} has no answer: {}", flags.point, flags.study, reason));
}

Solved solve_in_this_process(const TraceFlags& flags, const PointSpec& point, TraceOutput& output) {
  const solver::Finger finger(point.model);
  output.begin(solver::trace_shape(point.model.lengths_m.size(),
                                   static_cast<std::size_t>(point.model.elements_per_link),
                                   flags.shape));
  std::optional<solver::TraceRow> last;  // that is not printed yet
  std::string state_before;
  std::uint64_t instants = 0;
  const auto take = [&](const solver::TraceRow& row) {
    const bool is_instant = row.state != solver::kFalling;
    last.reset();
    if (!is_instant || instants % flags.every == 0 || solver::ends_phase(state_before, row.state)) {
      output.add(row);
    } else {
      last = row;
    }
    instants += is_instant ? 1U : 0U;
    state_before = row.state;
  };
  try {
    const auto result = solve_here(finger, {point.H_m, point.mu, point.e_star, point.errors},
                                   {take, flags.shape, flags.fall}, output.fills_terminal());
    if (last) {
      output.add(*last);
    }
    return {point, result, "here"};
  } catch (const solver::SolveError& error) {
    throw_failure(flags, error.what());
  } catch (const solver::InputError& error) {  // the study was taken with it: no wrong usage here
    throw_failure(flags, error.what());
  }
}

Solved solve_by_worker(const TraceFlags& flags, Connection& connection, TraceOutput& output) {
  WorkLineSettings settings;
  settings.on_terminal = settings.on_terminal && !output.fills_terminal();
  WorkLine line(std::cerr, settings);
  const auto waiting = line.begin(fmt::format("a worker of {} solves point {} of {}",
                                              connection.url(), flags.point, flags.study));
  const auto solved = trace_by_worker(
      connection, flags.study, static_cast<std::uint64_t>(flags.point),
      {.with_shape = flags.shape,
       .with_fall = flags.fall,
       .every = flags.every,
       .time_limit_ms = flags.source.timeout_s ? connection_settings(flags.source).timeout_ms : 0},
      [&](const solver::TraceShape& shape) { output.begin(shape); },
      [&](const solver::TraceRow& row) { output.add(row); });
  if (!solved.error.empty()) {
    throw_failure(flags, solved.error);
  }
  return {solved.point, solved.result,
          fmt::format("by worker {} ({})", solved.worker, solved.instruction_set)};
}

/// Says whether the stored row is that of the point solved again.
void tell_comparison(const std::optional<StoredRow>& stored, const Solved& solved) {
  const std::string again = fmt::format("{}; solved {}", named(solved.point), solved.where);
  if (!stored) {
    tell_line(again + ", not stored yet.");
    return;
  }
  if (!solved.result) {
    tell_line(again + ". Its outputs are others than this program knows: not compared.");
    return;
  }
  const auto others = differences_in_words(*stored, *solved.result);
  tell_line(others.empty() ? again + ", same as stored."
                           : fmt::format("{}, other than stored in {}.", again, others));
}

/// A failed point is not solved again: where solving kills, it may kill again.
void refuse_failed(const TraceFlags& flags, const std::optional<StoredRow>& stored) {
  if (stored && stored->has_failed()) {
    throw std::runtime_error(fmt::format(
        "point {} of {} failed and has no trace: {}. `oblique retry {}` solves it again, "
        "`oblique solve --trace` with its values shows how far it comes",
        flags.point, flags.study, stored->text("error"), flags.study));
  }
}

int trace(const TraceFlags& flags) {
  const Format format = format_of_output(flags.format, flags.out, kTraceFormats, Format::kCsv);
  const std::string database = database_meant(flags.source);
  const bool is_file = !database.empty();
  if (is_file && flags.on_worker) {
    throw solver::InputError(
        "--on-worker needs a server, and a database file is read here: name one with --server URL");
  }
  const auto source = open_source(flags.source);
  const auto number = static_cast<std::uint64_t>(flags.point);
  std::optional<Connection> connection;
  if (!is_file) {
    connection.emplace(connection_settings(flags.source));
  }
  const bool is_here = is_file || flags.local;
  std::optional<PointSpec> point;
  if (is_here) {
    point = is_file ? point_in(database, study_named(*source, flags.study), number)
                    : point_at(*connection, flags.study, number);
  }
  const auto stored = stored_row(*source, flags.study, number);
  refuse_failed(flags, stored);
  TraceOutput output(flags.out, format);
  const Solved solved = is_here ? solve_in_this_process(flags, *point, output)
                                : solve_by_worker(flags, *connection, output);
  output.finish(solved.point, solved.result);
  tell_comparison(stored, solved);
  return kDone;
}

}  // namespace

void add_trace(CLI::App& app, Command& command) {
  auto flags = std::make_shared<TraceFlags>();
  auto* verb = app.add_subcommand("trace", "Time histories of one point of a study, solved again");
  verb->footer(kTraceExamples);
  verb->add_option("STUDY", flags->study, "name of the study")->required()->type_name("");
  verb->add_option("POINT", flags->point, "number of the point, from 0")
      ->required()
      ->check(protocol::whole_number_from(0))
      ->type_name("");
  verb->add_option("--out", flags->out, "file that is written; standard output when left out")
      ->type_name("FILE");
  auto* format = verb->add_option("--format", flags->format,
                                  "csv or json; as the file's name ends when left out, else "
                                  "csv; the Python module returns NumPy arrays")
                     ->type_name("FORMAT");
  protocol::note_choices(format, kTraceFormats);
  verb->add_flag("--shape", flags->shape, "add the positions of the chain's nodes");
  verb->add_flag(
      "--fall", flags->fall,
      "begin with 121 rows of the fall, from release to touch: times are negative there, "
      "the state is falling");
  verb->add_option("--every", flags->every,
                   "give each K-th instant of the contact and all ends of phases")
      ->check(protocol::whole_number_from(1))
      ->type_name("K");
  auto* local = verb->add_flag("--local", flags->local, "solve it in this process");
  verb->add_flag("--on-worker", flags->on_worker, "have a worker of the server solve it")
      ->excludes(local);
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return trace(*flags); }; });
}

}  // namespace oblique::client
