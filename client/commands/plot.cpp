#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/io/row_output.h"
#include "client/plot/figure.h"
#include "client/plot/picture_file.h"
#include "client/plot/plot_request.h"
#include "client/plot/point_figure.h"
#include "client/service/connection.h"
#include "client/study/point_flags.h"
#include "client/trace/solve_again.h"
#include "proto/program/usage.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

constexpr const char* kPlotExamples = R"(Examples:
  oblique plot friction                                 what suits the study, on the terminal
  oblique plot friction --map fn_peak_N --x mu --y H --at e=1 --out peak.svg
  oblique plot friction --map major_mode --out modes.svg
  oblique plot friction --lines duration_s --x mu --by e --log-x --out duration.png
  oblique plot friction --scatter slide_m,friction_J --colour mu --out slide.svg
  oblique plot friction --histogram margin --log-x --show
  oblique plot friction --point 7 --out impact.svg      time histories of one point
  oblique plot friction --point 7 --panel loop --show
  oblique plot --H 1 --mu 1.2 --e 1 --out impact.svg    of a point of no study

OUTPUT and COL are columns of `oblique query`, or SQL expressions over them, as ft_peak_N/fn_peak_N;
KEY is an axis of the study. Axes without --at are held at their first value, and a message says
which. Of several blocks a map and lines show one, and say so. Maps of texts, as of modes, name those
that most points have. Cells without a result are hatched, failed ones crossed. Where points lie
scattered, or are too many to draw each, cells gather them, and the picture says so. Pictures are
drawn by gnuplot (Debian: gnuplot-nox); --out FILE.gp writes its script, and needs none. Without
--out the picture is drawn on the terminal. --range and --at are in SI units.
A point is solved again for its time histories, here when the database is a file or the point is of
no study, and by a worker of the server otherwise.)";

/// Where a picture goes, and how large it is.
struct PictureFlags {
  std::string size;  ///< empty: its own
  std::string out;
  std::string format;
  bool show = false;
};

struct PlotFlags {
  plot::PlotRequest request;
  std::optional<std::int64_t> point;  ///< of the study
  PointFlags values;                  ///< of a point of no study
  std::string panel;                  ///< of a point; empty: all
  PictureFlags picture;
  PointSource source;
};

/// What the flags of a picture say together.
struct PictureChoice {
  plot::PictureFormat format;
  std::optional<plot::Size> size;
  bool is_shown;    ///< on standard output, as text
  bool is_written;  ///< to a file or to standard output
};

/// Throws solver::InputError, naming the flag, for flags that contradict each other, and if they
/// leave open where the picture goes and standard output is no terminal.
PictureChoice picture_choice(const PictureFlags& flags) {
  const auto format = plot::picture_format(flags.format, flags.out);
  if (flags.show && flags.out.empty() && !flags.format.empty()) {
    throw solver::InputError(
        "--show draws on standard output: give the file for --format as --out FILE");
  }
  const auto size = flags.size.empty() ? std::nullopt : std::optional(plot::size_of(flags.size));
  const bool is_open = flags.out.empty() && flags.format.empty();
  const bool is_shown = flags.show || is_open;
  return {format, size, is_shown, !is_shown || !flags.out.empty()};
}

void refuse_pipe(const PictureFlags& flags) {
  if (flags.out.empty() && flags.format.empty() && !flags.show &&
      terminal_size(STDOUT_FILENO).lines == 0) {
    throw solver::InputError(
        "standard output is no terminal: name a file for the picture with --out FILE.svg (or .pdf, "
        ".png, .gp, .csv), or draw it in characters with --show");
  }
}

/// Shows the figure on the terminal, writes the picture, or both.
int put_out(Console& console, const PictureFlags& flags, const plot::Figure& figure) {
  const PictureChoice choice = picture_choice(flags);
  if (choice.is_shown) {
    console.out().flush();
    write_all(STDOUT_FILENO, plot::text_of(figure), "standard output");
  }
  if (choice.is_written) {
    plot::write_picture(plot::picture_of(figure, choice.format, choice.size), choice.format,
                        flags.out);
  }
  return kDone;
}

/// Takes the rows of the fall and keeps the finger's shape when its tip has dropped a quarter, a
/// half and three quarters of H, interpolated between two rows. No shapes if a worker sent no such
/// rows.
void take_falls(plot::PointHistory& history) {
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

plot::PointHistory history_of_study(Console& console, const PlotFlags& flags) {
  const std::string& study = flags.request.study;
  const auto number = static_cast<std::uint64_t>(*flags.point);
  plot::PointHistory history;
  const auto solved = solve_again(
      console, flags.source, study, number, {.with_shape = true, .with_fall = true, .every = 0},
      [](const solver::TraceShape&) {},
      [&history](const solver::TraceRow& row) { history.rows.push_back(row); });
  history.name = fmt::format("Point {} of {}", number, study);
  history.model = solved.point.model;
  history.H_m = solved.point.H_m;
  history.mu = solved.point.mu;
  history.e_star = solved.point.e_star;
  history.result = solved.result;
  if (solved.every > 1) {
    history.remarks.push_back(
        fmt::format("One of {} instants is drawn; with --local all are.", solved.every));
  }
  if (!solved.is_confirmed) {
    history.remarks.push_back(fmt::format("Solved again, it is {}.", solved.comparison));
    console.note(history.remarks.back());
  }
  return history;
}

plot::PointHistory history_of_values(Console& console, const PlotFlags& flags) {
  const auto table = points_of_flags(flags.values, tip_reach(console));
  if (table.size() != 1) {
    throw solver::InputError(fmt::format(
        "the flags make {} points, and the time histories of one are drawn: give one value each",
        table.size()));
  }
  const auto point = table.point(0);
  plot::PointHistory history{.name = {},
                             .model = table.model(0),
                             .H_m = point.H_m,
                             .mu = point.mu,
                             .e_star = point.e_star};
  const solver::Tracing tracing{
      [&history](const solver::TraceRow& row) { history.rows.push_back(row); }, true, true};
  history.result = solve_here(console, solver::Finger(history.model),
                              {point.H_m, point.mu, point.e_star}, tracing);
  return history;
}

int plot_point(Console& console, const PlotFlags& flags) {
  const auto panel = plot::point_panel_named(flags.panel);
  auto history = flags.request.study.empty() ? history_of_values(console, flags)
                                             : history_of_study(console, flags);
  take_falls(history);
  return put_out(console, flags.picture, plot::point_figure(history, panel));
}

int plot_study(Console& console, const PlotFlags& flags) {
  const auto& request = flags.request;
  const auto source = open_source(console, flags.source.source);
  const auto shape =
      plot::shape_for(stored_recipe(console, flags.source.source, request.study), request);
  return put_out(console, flags.picture,
                 plot::figure_of(*source, shape, plot::completed(request, shape),
                                 [&console](const std::string& note) { console.note(note); }));
}

/// Whether the flags name a point. Throws solver::InputError if they contradict each other.
bool is_point_meant(const PlotFlags& flags) {
  const std::string& study = flags.request.study;
  const bool has_values = !flags.values.axes.empty() || !flags.values.lengths.empty();
  if (study.empty() && flags.point) {
    throw solver::InputError("--point is a number in a study: name the study");
  }
  if (study.empty() && !has_values) {
    throw solver::InputError(
        "plot needs the name of a study, or the values of a point as --H 1 --mu 0.4 --e 1");
  }
  if (!study.empty() && has_values) {
    throw solver::InputError(fmt::format(
        "{} is a study, and its points have their values: draw one of them with --point N, or "
        "leave the study out",
        study));
  }
  static_cast<void>(plot::point_panel_named(flags.panel));
  const bool is_point = has_values || flags.point;
  if (!is_point && (!flags.panel.empty() || flags.source.is_local || flags.source.is_on_worker)) {
    throw solver::InputError(
        "--panel, --local and --on-worker are of one point: name it with --point N");
  }
  return is_point;
}

int plot_results(const PlotFlags& flags, Console& console) {
  static_cast<void>(picture_choice(flags.picture));
  plot::check(flags.request);
  refuse_pipe(flags.picture);
  return is_point_meant(flags) ? plot_point(console, flags) : plot_study(console, flags);
}

CLI::Option* add_text(CLI::App& command, const std::string& flag, std::string& value,
                      const std::string& help, const std::string& type) {
  return command.add_option(flag, value, help)->type_name(type);
}

/// Refuses flags that would have no effect beside the others.
void exclude(CLI::Option* option, const std::vector<CLI::Option*>& others) {
  for (auto* other : others) {
    if (other != option) {
      option->excludes(other);
    }
  }
}

/// The kinds of pictures, and the axes that each has.
void add_kinds_of_pictures(CLI::App& command, plot::PlotRequest& request) {
  auto* map = add_text(command, "--map", request.map,
                       "an output over two axes, in colours; of modes a map of them", "OUTPUT");
  auto* lines = add_text(command, "--lines", request.lines,
                         "an output over one axis, a line a value of another", "OUTPUT");
  auto* scatter = add_text(command, "--scatter", request.scatter, "points over two columns", "X,Y");
  auto* histogram = add_text(command, "--histogram", request.histogram,
                             "how often values of a column are met", "COL");
  for (auto* kind : {map, lines, scatter, histogram}) {
    exclude(kind, {map, lines, scatter, histogram});
  }
  exclude(add_text(command, "--x", request.x,
                   "horizontal axis of --map and --lines; default: mu if that varies", "KEY"),
          {scatter, histogram});
  exclude(add_text(command, "--y", request.y, "vertical axis of --map; default: H if that varies",
                   "KEY"),
          {lines, scatter, histogram});
  exclude(add_text(command, "--by", request.by,
                   "whose values are the lines of --lines; default: that with the fewest", "KEY"),
          {map, scatter, histogram});
  exclude(add_text(command, "--colour", request.colour,
                   "column whose values colour the points of --scatter", "COL"),
          {map, lines, histogram});
}

void add_picture_flags(CLI::App& command, PictureFlags& flags) {
  add_text(command, "--size", flags.size, "width and height in pixels, of PNG twice as many", "WxH")
      ->default_str("760x520");
  add_text(command, "--out", flags.out, "output file, written atomically", "FILE");
  protocol::note_choices(
      add_text(command, "--format", flags.format,
               "svg, pdf, png, gp (a gnuplot script) or csv; default: as the name of "
               "--out ends. Without --out it goes to standard output",
               "FORMAT"),
      plot::picture_format_names());
  command.add_flag("--show", flags.show, "draw on the terminal");
}

/// Flags for the time histories of one point.
void add_flags_of_point(CLI::App& command, PlotFlags& flags) {
  const std::string group = "One point";
  command
      .add_option("--point", flags.point,
                  "draw the time histories of that point of the study, solved again")
      ->check(protocol::whole_number_from(0))
      ->type_name("N")
      ->group(group);
  auto* panel = add_text(command, "--panel", flags.panel,
                         "of a point one panel alone: forces, loop, deformation, "
                         "velocities, energies or shape",
                         "NAME")
                    ->group(group);
  protocol::note_choices(panel, plot::kPointPanels);
  add_point_source(command, flags.source);
  for (const char* flag : {"--local", "--on-worker"}) {
    command.get_option(flag)->group(group);
  }
  add_point_flags(command, flags.values, FlagValues::kOne);
}

}  // namespace

void add_plot(CLI::App& app, Action& parsed) {
  auto [command, flags] = new_command(app, parsed, "plot", "Draw results of a study, or one point",
                                      kPlotExamples, plot_results);
  auto& request = flags.request;
  add_text(command, "STUDY", request.study, "name of the study", "");
  add_kinds_of_pictures(command, request);
  add_text(command, "--where", request.where, "condition that points must meet", "EXPR");
  command.add_option("--at", request.at, "value of another axis; may be given for several")
      ->type_name("KEY=VALUE");
  add_text(command, "--block", request.block,
           "which block of the study; default: that with the most points of those that fit",
           "N|all");
  command.add_flag("--log-x", request.is_x_logarithmic, "a logarithmic horizontal axis");
  command.add_flag("--log-y", request.is_y_logarithmic, "a logarithmic vertical axis");
  command.add_flag("--log-colour", request.is_colour_logarithmic, "colours by logarithms");
  add_text(command, "--range", request.range,
           "values that colours span, or the vertical axis of --lines, or the bins of --histogram",
           "FROM:TO");
  add_picture_flags(command, flags.picture);
  add_flags_of_point(command, flags);
  for (const char* of_study :
       {"--map", "--lines", "--scatter", "--histogram", "--x", "--y", "--by", "--colour", "--where",
        "--at", "--block", "--range", "--log-x", "--log-y", "--log-colour"}) {
    command.get_option("--point")->excludes(command.get_option(of_study));
  }
}

}  // namespace oblique::client
