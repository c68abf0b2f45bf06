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
  oblique plot friction                                 a suitable picture, on the terminal
  oblique plot friction --map fn_peak_N --x mu --y H --at e=1 --out peak.svg
  oblique plot friction --map major_mode --out modes.svg
  oblique plot friction --lines duration_s --x mu --by e --log-x --out duration.png
  oblique plot friction --scatter slide_m,friction_J --colour mu --out slide.svg
  oblique plot friction --histogram margin --log-x --show
  oblique plot friction --point 7 --out impact.svg      time histories of one point
  oblique plot friction --point 7 --panel loop --show
  oblique plot --H 1 --mu 1.2 --e 1 --out impact.svg    a point that belongs to no study

OUTPUT and COL are columns of `oblique query` or SQL expressions, such as fn_peak_N/ft_peak_N. KEY
is an axis of the study. An axis without --at is held at its first value; a message names it. A map
or lines show one block of a study; a message says which. Maps of texts, such as modes, name the
most frequent ones. Cells without a result are hatched, failed ones crossed. Scattered points, and
points that are too many to draw, are gathered in cells; the picture says so. gnuplot draws the
pictures (Debian: gnuplot-nox); --out FILE.gp writes its script and does not need it. Without --out
the picture is drawn on the terminal. --range and --at are in SI units.
Time histories are solved again: in this process if the database is a file or the point belongs to
no study, else by a worker of the server.)";

/// Destination, format and size of the picture.
struct PictureFlags {
  std::string size;  ///< empty: the default size of the picture
  std::string out;
  std::string format;
  bool show = false;
};

struct PlotFlags {
  plot::PlotRequest request;
  std::optional<std::int64_t> point;  ///< point of the study
  PointFlags values;                  ///< values of a point that belongs to no study
  std::string panel;                  ///< panel of a point; empty: all panels
  PictureFlags picture;
  PointSource source;
};

/// The picture that the combined flags request.
struct PictureChoice {
  plot::PictureFormat format;
  std::optional<plot::Size> size;
  bool is_shown;    ///< shown as text on standard output
  bool is_written;  ///< written to a file or standard output
};

/// Checks the combination of flags. Throws solver::InputError that names the flag if flags
/// contradict each other, or if no output is named and standard output is not a terminal.
PictureChoice picture_choice(const PictureFlags& flags) {
  const auto format = plot::picture_format(flags.format, flags.out);
  if (flags.show && flags.out.empty() && !flags.format.empty()) {
    throw solver::InputError(
        "--show draws on standard output: name a file for --format with --out FILE");
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
        "standard output is no terminal: write the picture to a file with --out FILE.svg (or .pdf, "
        ".png, .gp, .csv), or draw it as text with --show");
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

/// Moves the rows of the fall from the trace into `falls`: the shape of the finger after its tip
/// has dropped a quarter, a half and three quarters of H, interpolated between two rows. Leaves
/// `falls` empty if a worker sent no rows of the fall.
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
        fmt::format("One of {} instants is drawn; --local draws all.", solved.every));
  }
  if (!solved.is_confirmed) {
    history.remarks.push_back(fmt::format("The point was solved again: {}.", solved.comparison));
    console.note(history.remarks.back());
  }
  return history;
}

plot::PointHistory history_of_values(Console& console, const PlotFlags& flags) {
  const auto table = points_of_flags(flags.values, tip_reach(console));
  if (table.size() != 1) {
    throw solver::InputError(
        fmt::format("the flags define {} points, but a plot of time histories shows one: give one "
                    "value per flag",
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
    throw solver::InputError("--point is the number of a point in a study: name the study");
  }
  if (study.empty() && !has_values) {
    throw solver::InputError(
        "plot needs the name of a study, or the values of a point such as --H 1 --mu 0.4 --e 1");
  }
  if (!study.empty() && has_values) {
    throw solver::InputError(fmt::format(
        "{} is a study whose points have values: choose one with --point N, or leave the study out",
        study));
  }
  static_cast<void>(plot::point_panel_named(flags.panel));
  const bool is_point = has_values || flags.point;
  if (!is_point && (!flags.panel.empty() || flags.source.is_local || flags.source.is_on_worker)) {
    throw solver::InputError(
        "--panel, --local and --on-worker apply to one point: name it with --point N");
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

/// Makes the command line refuse the option together with any of `others`.
void exclude(CLI::Option* option, const std::vector<CLI::Option*>& others) {
  for (auto* other : others) {
    if (other != option) {
      option->excludes(other);
    }
  }
}

void add_kinds_of_pictures(CLI::App& command, plot::PlotRequest& request) {
  auto* map = add_text(
      command, "--map", request.map,
      "colour map of an output over two axes; of a text, such as the mode, a map of categories",
      "OUTPUT");
  auto* lines = add_text(command, "--lines", request.lines,
                         "an output over one axis, with one line per value of another", "OUTPUT");
  auto* scatter = add_text(command, "--scatter", request.scatter, "points over two columns", "X,Y");
  auto* histogram = add_text(command, "--histogram", request.histogram,
                             "how often the values of a column occur", "COL");
  for (auto* kind : {map, lines, scatter, histogram}) {
    exclude(kind, {map, lines, scatter, histogram});
  }
  exclude(add_text(command, "--x", request.x,
                   "horizontal axis of --map and --lines; default: mu if it varies", "KEY"),
          {scatter, histogram});
  exclude(
      add_text(command, "--y", request.y, "vertical axis of --map; default: H if it varies", "KEY"),
      {lines, scatter, histogram});
  exclude(
      add_text(command, "--by", request.by,
               "axis with one line per value in --lines; default: the one with the fewest values",
               "KEY"),
      {map, scatter, histogram});
  exclude(add_text(command, "--colour", request.colour,
                   "column that colours the points of --scatter", "COL"),
          {map, lines, histogram});
}

void add_picture_flags(CLI::App& command, PictureFlags& flags) {
  add_text(command, "--size", flags.size, "width and height in pixels; PNG has twice as many",
           "WxH")
      ->default_str("760x520");
  add_text(command, "--out", flags.out, "output file, written atomically", "FILE");
  protocol::note_choices(add_text(command, "--format", flags.format,
                                  "svg, pdf, png, gp (gnuplot script) or csv; default: from the "
                                  "name of --out; without --out written to standard output",
                                  "FORMAT"),
                         plot::picture_format_names());
  command.add_flag("--show", flags.show, "draw on the terminal as text");
}

void add_flags_of_point(CLI::App& command, PlotFlags& flags) {
  const std::string group = "One point";
  command
      .add_option("--point", flags.point,
                  "draw the time histories of this point, which is solved again")
      ->check(protocol::whole_number_from(0))
      ->type_name("N")
      ->group(group);
  auto* panel =
      add_text(command, "--panel", flags.panel,
               "draw one panel: forces, loop, deformation, velocities, energies or shape", "NAME")
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
  auto [command, flags] =
      new_command(app, parsed, "plot", "Draw results of a study or the time histories of a point",
                  kPlotExamples, plot_results);
  auto& request = flags.request;
  add_text(command, "STUDY", request.study, "name of the study", "");
  add_kinds_of_pictures(command, request);
  add_text(command, "--where", request.where, "condition that points must meet", "EXPR");
  command.add_option("--at", request.at, "value of another axis; may be repeated")
      ->type_name("KEY=VALUE");
  add_text(command, "--block", request.block,
           "block of the study to draw; default: the suitable block with the most points", "N|all");
  command.add_flag("--log-x", request.is_x_logarithmic, "logarithmic horizontal axis");
  command.add_flag("--log-y", request.is_y_logarithmic, "logarithmic vertical axis");
  command.add_flag("--log-colour", request.is_colour_logarithmic, "logarithmic colours");
  add_text(command, "--range", request.range,
           "range of the colours, of the vertical axis of --lines, or of the bins of --histogram",
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
