#include "client/trace/solve_again.h"

#include <cstddef>
#include <exception>
#include <stdexcept>

#include <spdlog/fmt/fmt.h>

#include "client/service/connection.h"
#include "client/service/source.h"
#include "client/service/watching.h"
#include "client/trace/stored_comparison.h"
#include "worker/solver/estimate.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

solver::CaseResult solve_with_status(Console& console, const solver::Finger& finger,
                                     const PointToSolve& point, const solver::Tracing& tracing,
                                     bool shows_status) {
  StatusLine line(console, {.is_shown = shows_status});
  static_cast<void>(largest_drop_m(finger, line));
  const auto contact =
      line.begin(fmt::format("on {} elements a link: contact", finger.model().elements_per_link));
  return finger.solve(point.H_m, point.mu, point.e_star, tracing);
}

/// Empty, with a note, if there is no coarser mesh or the point has no answer on it.
solver::ErrorEstimate estimate_errors(Console& console, const solver::ModelParameters& model,
                                      const PointToSolve& point, const solver::CaseResult& result,
                                      bool shows_status) {
  const solver::ModelParameters coarse = solver::companion_model(model);
  if (coarse.elements_per_link >= model.elements_per_link) {
    console.note("Errors cannot be estimated: there is no coarser mesh than one element a link.");
    return {};
  }
  try {
    return solver::estimated_errors(
        model, result, solve_with_status(console, solver::Finger(coarse), point, {}, shows_status));
  } catch (const std::exception& error) {
    console.note(fmt::format("Errors cannot be estimated: on half the mesh, {}", error.what()));
    return {};
  }
}

[[noreturn]] void throw_unsolved(const std::string& study, std::uint64_t point,
                                 const std::string& reason) {
  throw std::runtime_error(fmt::format("point {} of {} has no answer: {}", point, study, reason));
}

/// Passes on each K-th instant of the contact, all ends of phases, the fall and the last instant.
class EveryKth {
 public:
  EveryKth(std::uint64_t every, const solver::Tracing::Sink& row) : every_(every), row_(row) {}

  void add(const solver::TraceRow& row) {
    const bool is_instant = row.state != solver::kFalling;
    last_.reset();
    if (!is_instant || every_ < 2 || instants_ % every_ == 0 ||
        solver::ends_phase(state_before_, row.state)) {
      row_(row);
    } else {
      last_ = row;
    }
    instants_ += is_instant ? 1U : 0U;
    state_before_ = row.state;
  }
  void finish() {
    if (last_) {
      row_(*last_);
    }
  }

 private:
  std::uint64_t every_;
  const solver::Tracing::Sink& row_;
  std::optional<solver::TraceRow> last_;  // not passed on yet
  std::string state_before_;
  std::uint64_t instants_ = 0;
};

SolvedAgain solve_in_this_process(Console& console, const PointSpec& point,
                                  const TraceOptions& options,
                                  const std::function<void(const solver::TraceShape&)>& begin,
                                  const solver::Tracing::Sink& row, bool shows_status) {
  const solver::Finger finger(point.model);
  begin(solver::trace_shape(point.model.lengths_m.size(),
                            static_cast<std::size_t>(point.model.elements_per_link),
                            options.with_shape));
  EveryKth rows(options.every, row);
  const solver::Tracing tracing{[&rows](const solver::TraceRow& each) { rows.add(each); },
                                options.with_shape, options.with_fall};
  try {
    const auto result = solve_here(
        console, finger, {point.H_m, point.mu, point.e_star, point.errors}, tracing, shows_status);
    rows.finish();
    return {.point = point, .result = result, .solver = "here"};
  } catch (const solver::SolveError& error) {
    throw_unsolved(point.study, point.point, error.what());
  } catch (const solver::InputError& error) {  // the study was accepted with it: no wrong usage
    throw_unsolved(point.study, point.point, error.what());
  }
}

SolvedAgain solve_by_worker(Console& console, Connection& connection, const std::string& study,
                            std::uint64_t point, const TraceOptions& options,
                            const std::function<void(const solver::TraceShape&)>& begin,
                            const solver::Tracing::Sink& row, bool shows_status) {
  StatusLine line(console, {.is_shown = shows_status});
  const auto waiting = line.begin(
      fmt::format("a worker of {} solves point {} of {}", connection.url(), point, study));
  const auto solved = trace_by_worker(connection, study, point, options, begin, row);
  if (!solved.error.empty()) {
    throw_unsolved(study, point, solved.error);
  }
  return {.point = solved.point,
          .result = solved.result,
          .solver = fmt::format("by worker {} ({})", solved.worker, solved.instruction_set),
          .every = solved.every};
}

void compare(const std::optional<StoredRow>& stored, SolvedAgain& solved) {
  if (!stored) {
    solved.comparison = "not stored yet";
    return;
  }
  const auto differing = solved.result ? differences_in_words(*stored, *solved.result) : "";
  solved.is_confirmed = solved.result && differing.empty();
  solved.comparison =
      solved.is_confirmed ? "same as stored"
      : solved.result
          ? "other than stored in " + differing
          : "not compared with the stored row: the worker has outputs unknown to this program";
}

}  // namespace

ReachCheck tip_reach(Console& console) {
  return ReachChecker([&console](const solver::ModelParameters& model) {
    const solver::Finger finger(model);
    StatusLine line(console);
    return largest_drop_m(finger, line);
  });
}

double largest_drop_m(const solver::Finger& finger, StatusLine& line) {
  const auto falling = line.begin([&finger] {
    const auto& model = finger.model();
    double length_m = 0.0;  // of the chain: the tip turns back near it
    for (const double each_m : model.lengths_m) {
      length_m += each_m;
    }
    return fmt::format("on {} elements a link: fall {} of {} m", model.elements_per_link,
                       solver::readable_number(finger.drop_so_far_m(), 3),
                       solver::readable_number(length_m, 3));
  });
  return finger.largest_drop_m();
}

solver::CaseResult solve_here(Console& console, const solver::Finger& finger,
                              const PointToSolve& point, const solver::Tracing& tracing,
                              bool shows_status) {
  auto result = solve_with_status(console, finger, point, tracing, shows_status);
  if (point.errors) {
    result.errors = estimate_errors(console, finger.model(), point, result, shows_status);
  }
  return result;
}

void add_point_source(CLI::App& command, PointSource& flags) {
  auto* local = command.add_flag("--local", flags.is_local, "solve the point in this process");
  command
      .add_flag("--on-worker", flags.is_on_worker, "have a worker of the server solve the point")
      ->excludes(local);
  add_source_flags(command, flags.source);
}

SolvedAgain solve_again(Console& console, const PointSource& from, const std::string& study,
                        std::uint64_t point, const TraceOptions& options,
                        const std::function<void(const solver::TraceShape&)>& begin,
                        const solver::Tracing::Sink& row, bool shows_status) {
  const std::string database = database_meant(from.source);
  if (!database.empty() && from.is_on_worker) {
    throw solver::InputError(
        "--on-worker needs a server, and a database file is read here: name one with --server URL");
  }
  const auto source = open_source(console, from.source);
  std::optional<Connection> connection;
  std::optional<PointSpec> local;
  if (!database.empty()) {
    local = point_in(database, study_named(*source, study), point);
  } else {
    connection.emplace(connection_settings(console, from.source));
    if (from.is_local) {
      local = point_at(*connection, study, point);
    }
  }
  const auto stored = stored_row(*source, study, point);
  if (stored && stored->has_failed()) {  // what killed its workers may kill this process too
    throw std::runtime_error(fmt::format(
        "point {} of {} failed and has no trace: {}. `oblique retry {}` solves it again, "
        "`oblique solve --trace` with its values shows how far it comes",
        point, study, stored->text("error"), study));
  }
  TraceOptions limited = options;
  if (connection && from.source.timeout_s) {
    limited.time_limit_ms = connection_settings(console, from.source).timeout_ms;
  }
  auto solved = local ? solve_in_this_process(console, *local, options, begin, row, shows_status)
                      : solve_by_worker(console, *connection, study, point, limited, begin, row,
                                        shows_status);
  compare(stored, solved);
  return solved;
}

}  // namespace oblique::client
