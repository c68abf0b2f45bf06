#include <memory>
#include <string>
#include <vector>

#include "client/plot/plot_request.h"
#include "client/plot/study_shape.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/picture_flags.h"
#include "client/verbs/plot_point.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"
#include "server/maintenance/study_changes_offline.h"

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

struct PlotFlags {
  plot::PlotRequest request;
  PointPictureFlags point;
  PictureFlags picture;
  SourceFlags source;
};

protocol::Recipe recipe_for(const PlotFlags& flags, Source& source) {
  const std::string database = database_meant(flags.source);
  if (database.empty()) {
    return Connection(connection_settings(flags.source)).describe(flags.request.study);
  }
  return server::stored_recipe(database, study_named(source, flags.request.study).study_id());
}

int plot_study(const PlotFlags& flags) {
  const auto source = open_source(flags.source);
  const auto shape = plot::shape_for(recipe_for(flags, *source), flags.request);
  put_out(flags.picture,
          plot::figure_of(*source, shape, plot::completed(flags.request, shape), tell_line));
  return kDone;
}

int plot_what_is_meant(PlotFlags& flags) {
  static_cast<void>(picture_choice(flags.picture));
  static_cast<void>(picture_size(flags.picture));
  plot::check(flags.request);
  refuse_pipe(flags.picture);
  flags.point.study = flags.request.study;
  return is_point_meant(flags.point) ? plot_point(flags.point, flags.picture, flags.source)
                                     : plot_study(flags);
}

CLI::Option* add_text(CLI::App& verb, const std::string& flag, std::string& value,
                      const std::string& help, const std::string& type) {
  return verb.add_option(flag, value, help)->type_name(type);
}

/// What would be of no effect beside others is refused.
void exclude(CLI::Option* option, const std::vector<CLI::Option*>& others) {
  for (auto* other : others) {
    if (other != option) {
      option->excludes(other);
    }
  }
}

/// The kinds of pictures, and the axes that each has.
void add_kinds_of_pictures(CLI::App& verb, plot::PlotRequest& request) {
  auto* map = add_text(verb, "--map", request.map,
                       "an output over two axes, in colours; of modes a map of them", "OUTPUT");
  auto* lines = add_text(verb, "--lines", request.lines,
                         "an output over one axis, a line a value of another", "OUTPUT");
  auto* scatter = add_text(verb, "--scatter", request.scatter, "points over two columns", "X,Y");
  auto* histogram = add_text(verb, "--histogram", request.histogram,
                             "how often values of a column are met", "COL");
  for (auto* kind : {map, lines, scatter, histogram}) {
    exclude(kind, {map, lines, scatter, histogram});
  }
  exclude(add_text(verb, "--x", request.x,
                   "horizontal axis of --map and --lines; default: mu if that varies", "KEY"),
          {scatter, histogram});
  exclude(
      add_text(verb, "--y", request.y, "vertical axis of --map; default: H if that varies", "KEY"),
      {lines, scatter, histogram});
  exclude(add_text(verb, "--by", request.by,
                   "whose values are the lines of --lines; default: that with the fewest", "KEY"),
          {map, scatter, histogram});
  exclude(add_text(verb, "--colour", request.colour,
                   "column whose values colour the points of --scatter", "COL"),
          {map, lines, histogram});
}

}  // namespace

void add_plot(CLI::App& app, Command& command) {
  auto flags = std::make_shared<PlotFlags>();
  auto& request = flags->request;
  auto* verb = app.add_subcommand("plot", "Draw results of a study, or one point");
  verb->footer(kPlotExamples);
  verb->add_option("STUDY", request.study, "name of the study")->type_name("");
  add_kinds_of_pictures(*verb, request);
  add_text(*verb, "--where", request.where, "condition that points must meet", "EXPR");
  verb->add_option("--at", request.at, "value of another axis; may be given for several")
      ->type_name("KEY=VALUE");
  add_text(*verb, "--block", request.block,
           "which block of the study; default: that with the most points of those that fit",
           "N|all");
  verb->add_flag("--log-x", request.is_x_logarithmic, "a logarithmic horizontal axis");
  verb->add_flag("--log-y", request.is_y_logarithmic, "a logarithmic vertical axis");
  verb->add_flag("--log-colour", request.is_colour_logarithmic, "colours by logarithms");
  add_text(*verb, "--range", request.range,
           "values that colours span, or the vertical axis of --lines, or the bins of --histogram",
           "FROM:TO");
  add_picture_flags(*verb, flags->picture);
  add_point_picture_flags(*verb, flags->point, command.names_single_lengths);
  for (const char* of_study :
       {"--map", "--lines", "--scatter", "--histogram", "--x", "--y", "--by", "--colour", "--where",
        "--at", "--block", "--range", "--log-x", "--log-y", "--log-colour"}) {
    verb->get_option("--point")->excludes(verb->get_option(of_study));
  }
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return plot_what_is_meant(*flags); }; });
}

}  // namespace oblique::client
