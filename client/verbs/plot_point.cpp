#include "client/verbs/plot_point.h"

#include <algorithm>
#include <iostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/output/work_line.h"
#include "client/plot/point_figure.h"
#include "client/service/watching.h"
#include "client/trace/stored_comparison.h"
#include "client/trace/worker_trace.h"
#include "client/verbs/solve_here.h"
#include "client/verbs/tip_reach.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

using plot::PointHistory;

/// Where the finger is when its tip has dropped a quarter, a half and three quarters of H, between
/// the two rows of the fall around each. Nothing where a worker gave none.
void take_falls(PointHistory& history) {
  const auto fall = take_fall(history.rows);
  for (const double share : {0.25, 0.5, 0.75}) {
    const double y_m = -share * history.H_m;
    const auto below = std::find_if(fall.begin(), fall.end(),
                                    [y_m](const solver::TraceRow& row) { return row.y_m <= y_m; });
    if (below == fall.begin() || below == fall.end()) {
      continue;
    }
    const auto& above = *(below - 1);
    const double part = (above.y_m - y_m) / (above.y_m - below->y_m);
    std::vector<double> nodes_m = above.nodes_m;
    for (std::size_t i = 0; i < nodes_m.size() && i < below->nodes_m.size(); ++i) {
      nodes_m[i] += part * (below->nodes_m[i] - nodes_m[i]);
    }
    history.falls.push_back({share * history.H_m, std::move(nodes_m)});
  }
}

void solve_history(PointHistory& history, bool with_errors) {
  const solver::Finger finger(history.model);
  const solver::Tracing tracing{
      [&history](const solver::TraceRow& row) { history.rows.push_back(row); }, true, true};
  history.result =
      solve_here(finger, {history.H_m, history.mu, history.e_star, with_errors}, tracing, false);
  take_falls(history);
}

PointHistory history_of(const PointSpec& point) {
  return {.name = fmt::format("Point {} of {}", point.point, point.study),
          .model = point.model,
          .H_m = point.H_m,
          .mu = point.mu,
          .e_star = point.e_star};
}

[[noreturn]] void throw_unsolved(const PointPictureFlags& flags, const std::string& reason) {
  throw std::runtime_error(
      fmt::format("point {} of {} has no answer: {}", *flags.point, flags.study, reason));
}

/// A point of a study with its histories.
struct SolvedAgain {
  PointSpec point;
  PointHistory history;
};

SolvedAgain solved_by_worker(const PointPictureFlags& flags, const SourceFlags& source,
                             Connection& connection) {
  WorkLine line(std::cerr);
  const auto waiting = line.begin(fmt::format("a worker of {} solves point {} of {}",
                                              connection.url(), *flags.point, flags.study));
  std::vector<solver::TraceRow> rows;
  const auto solved = trace_by_worker(
      connection, flags.study, static_cast<std::uint64_t>(*flags.point),
      {.with_shape = true,
       .with_fall = true,
       .every = 0,
       .time_limit_ms = source.timeout_s ? connection_settings(source).timeout_ms : 0},
      [](const solver::TraceShape&) {},
      [&rows](const solver::TraceRow& row) { rows.push_back(row); });
  if (!solved.error.empty()) {
    throw_unsolved(flags, solved.error);
  }
  PointHistory history = history_of(solved.point);
  history.rows = std::move(rows);
  history.result = solved.result;
  if (solved.every > 1) {
    history.remarks.push_back(
        fmt::format("One of {} instants is drawn; with --local all are.", solved.every));
  }
  take_falls(history);
  return {solved.point, std::move(history)};
}

SolvedAgain solved_here(const PointPictureFlags& flags, const PointSpec& point) {
  PointHistory history = history_of(point);
  try {
    solve_history(history, point.errors);
  } catch (const solver::SolveError& error) {
    throw_unsolved(flags, error.what());
  } catch (const solver::InputError& error) {  // the study was taken with it: no wrong usage here
    throw_unsolved(flags, error.what());
  }
  return {point, std::move(history)};
}

void refuse_failed_point(const PointPictureFlags& flags, const std::optional<StoredRow>& stored) {
  if (stored && stored->has_failed()) {
    throw std::runtime_error(fmt::format(
        "point {} of {} failed and has no time histories: {}. `oblique retry {}` solves it again",
        *flags.point, flags.study, stored->text("error"), flags.study));
  }
}

/// Says, in the picture too, where what is drawn is other than what the study has.
void compare(SolvedAgain& solved, const std::optional<StoredRow>& stored) {
  if (!stored) {
    return;
  }
  if (!solved.history.result) {
    tell_line(
        "The worker's outputs are others than this program knows: not held against the stored "
        "row.");
    return;
  }
  const auto others = differences_in_words(*stored, *solved.history.result);
  if (!others.empty()) {
    solved.history.remarks.push_back(
        fmt::format("Solved again, it is other than stored in {}.", others));
    tell_line(solved.history.remarks.back());
  }
}

PointHistory history_of_study(const PointPictureFlags& flags, const SourceFlags& source_flags) {
  const std::string database = database_meant(source_flags);
  const bool is_file = !database.empty();
  if (is_file && flags.on_worker) {
    throw solver::InputError(
        "--on-worker needs a server, and a database file is read here: name one with --server URL");
  }
  const auto source = open_source(source_flags);
  const auto number = static_cast<std::uint64_t>(*flags.point);
  std::optional<Connection> connection;
  if (!is_file) {
    connection.emplace(connection_settings(source_flags));
  }
  const auto stored = stored_row(*source, flags.study, number);
  refuse_failed_point(flags, stored);
  auto solved =
      !is_file && !flags.local
          ? solved_by_worker(flags, source_flags, *connection)
          : solved_here(flags, is_file
                                   ? point_in(database, study_named(*source, flags.study), number)
                                   : point_at(*connection, flags.study, number));
  compare(solved, stored);
  return std::move(solved.history);
}

PointHistory history_of_values(const PointPictureFlags& flags) {
  const protocol::PointTable table(recipe_of_flags(flags.values, tip_reach()));
  if (table.size() != 1) {
    throw solver::InputError(fmt::format(
        "the flags make {} points, and the time histories of one are drawn: give one value each",
        table.size()));
  }
  const auto point = table.point(0);
  PointHistory history{.name = {},
                       .model = table.model(0),
                       .H_m = point.H_m,
                       .mu = point.mu,
                       .e_star = point.e_star};
  solve_history(history, false);
  return history;
}

}  // namespace

void add_point_picture_flags(CLI::App& verb, PointPictureFlags& flags, bool with_single_lengths) {
  const std::string group = "One point";
  verb.add_option("--point", flags.point,
                  "draw the time histories of that point of the study, solved again")
      ->check(protocol::whole_number_from(0))
      ->type_name("N")
      ->group(group);
  auto* panel = verb.add_option("--panel", flags.panel,
                                "of a point one panel alone: forces, loop, deformation, "
                                "velocities, energies or shape")
                    ->type_name("NAME")
                    ->group(group);
  protocol::note_choices(panel, plot::kPointPanels);
  auto* local = verb.add_flag("--local", flags.local, "solve the point in this process");
  local->group(group);
  verb.add_flag("--on-worker", flags.on_worker, "have a worker of the server solve the point")
      ->excludes(local)
      ->group(group);
  add_point_flags(verb, flags.values, FlagValues::kOne, with_single_lengths);
}

bool is_point_meant(const PointPictureFlags& flags) {
  const bool has_values = !flags.values.axes.empty() || !flags.values.lengths.empty();
  if (flags.study.empty() && flags.point) {
    throw solver::InputError("--point is a number in a study: name the study");
  }
  if (flags.study.empty() && !has_values) {
    throw solver::InputError(
        "plot needs the name of a study, or the values of a point as --H 1 --mu 0.4 --e 1");
  }
  if (!flags.study.empty() && has_values) {
    throw solver::InputError(fmt::format(
        "{} is a study, and its points have their values: draw one of them with --point N, or "
        "leave the study out",
        flags.study));
  }
  static_cast<void>(plot::point_panel_named(flags.panel));
  const bool is_point = has_values || flags.point;
  if (!is_point && (!flags.panel.empty() || flags.local || flags.on_worker)) {
    throw solver::InputError(
        "--panel, --local and --on-worker are of one point: name it with --point N");
  }
  return is_point;
}

int plot_point(const PointPictureFlags& flags, const PictureFlags& picture,
               const SourceFlags& source) {
  const auto panel = plot::point_panel_named(flags.panel);
  const auto history =
      flags.study.empty() ? history_of_values(flags) : history_of_study(flags, source);
  put_out(picture, plot::point_figure(history, panel));
  return kDone;
}

}  // namespace oblique::client
