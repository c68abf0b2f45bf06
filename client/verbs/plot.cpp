#include <unistd.h>

#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/formats/pager.h"
#include "client/formats/sink.h"
#include "client/plot/files/picture_file.h"
#include "client/plot/plot_request.h"
#include "client/plot/terminal/terminal_figure.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/verbs.h"
#include "server/care/study_care.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kPlotExamples = R"(Examples:
  oblique plot friction                                 what suits the study, on the terminal
  oblique plot friction --map fn_peak_N --x mu --y H --at e=1 --out peak.svg
  oblique plot friction --map major_mode --out modes.svg
  oblique plot friction --lines duration_s --x mu --by e --log-x --out duration.png
  oblique plot friction --scatter slide_m,friction_J --colour mu --out slide.svg
  oblique plot friction --histogram margin --log-x --show

OUTPUT and COL are columns of `oblique query`, or SQL expressions over them, as ft_peak_N/fn_peak_N;
KEY is an axis of the study. Of an axis that is left open the first value is drawn, and said. Maps of
texts, as of modes, name those that are met most. Cells without a result are hatched, failed ones
crossed. Where points lie scattered, or are too many to draw each, cells gather them, and the picture
says so. PNG needs rsvg-convert. Without --out the picture is drawn on a terminal, and as SVG into a
pipe. --range and --at are in SI units.)";

struct PlotFlags {
  plot::PlotRequest request;
  std::string size{"760x520"};
  std::string out;
  std::string format;
  bool show = false;
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
  const auto size = plot::size_of(flags.size);
  const auto format = plot::picture_format(flags.format, flags.out);
  if (flags.show && flags.out.empty() && !flags.format.empty()) {
    throw solver::InputError(
        "--show draws on standard output: give the file for --format as --out FILE");
  }
  plot::check(flags.request);
  const auto source = open_source(flags.source);
  const auto shape = plot::shape_of(recipe_for(flags, *source));
  const auto figure =
      plot::figure_of(*source, shape, plot::completed(flags.request, shape), tell_line);
  const bool is_for_terminal =
      flags.out.empty() && flags.format.empty() && terminal_size().lines > 0;
  if (flags.show || is_for_terminal) {
    std::cout.flush();
    write_all(STDOUT_FILENO, plot::text_of(figure, plot::look_of_standard_output()),
              "standard output");
    if (flags.out.empty()) {
      return kDone;
    }
  }
  plot::write_picture(plot::picture_of(figure, format, size), format, flags.out);
  return kDone;
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
  auto* verb = app.add_subcommand("plot", "Draw results of a study");
  verb->footer(kPlotExamples);
  verb->add_option("STUDY", request.study, "name of the study")->required()->type_name("");
  add_kinds_of_pictures(*verb, request);
  add_text(*verb, "--where", request.where, "condition that points must meet", "EXPR");
  verb->add_option("--at", request.at, "value of another axis; may be given for several")
      ->type_name("KEY=VALUE");
  verb->add_flag("--log-x", request.is_x_logarithmic, "a logarithmic horizontal axis");
  verb->add_flag("--log-y", request.is_y_logarithmic, "a logarithmic vertical axis");
  verb->add_flag("--log-colour", request.is_colour_logarithmic, "colours by logarithms");
  add_text(*verb, "--range", request.range,
           "values that colours span, or the vertical axis of --lines, or the bins of --histogram",
           "FROM:TO");
  add_text(*verb, "--palette", request.palette, "colours of maps: viridis or cividis", "NAME")
      ->capture_default_str();
  add_text(*verb, "--size", flags->size,
           "width and height in pixels, of PNG twice as many; higher where a legend needs it",
           "WxH")
      ->capture_default_str();
  add_text(*verb, "--out", flags->out, "file to write, which appears when it is whole", "FILE");
  add_text(*verb, "--format", flags->format,
           "svg, png, csv or gnuplot; as the file's name ends when left out, else svg", "FORMAT");
  verb->add_flag("--show", flags->show, "draw on the terminal");
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return plot_study(*flags); }; });
}

}  // namespace oblique::client
