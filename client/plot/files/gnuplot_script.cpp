#include <algorithm>
#include <cmath>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/plot/draw/palette.h"
#include "client/plot/files/figure_table.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

/// A text in the quotes in which gnuplot leaves everything as it is.
std::string gnuplot_text(std::string_view text) {
  std::string out = "'";
  for (const char letter : protocol::visible(std::string(text))) {
    out += letter == '\'' ? std::string("''") : std::string(1, letter);
  }
  return out + '\'';
}

std::string number(double value) {
  return std::isnan(value) ? "NaN" : solver::exact_number(value);
}

void write_axis(std::string& out, char letter, const FigureAxis& axis) {
  out += fmt::format("set {}label {} noenhanced\n", letter, gnuplot_text(axis.label));
  if (axis.is_logarithmic) {
    out += fmt::format("set logscale {}\n", letter);
  }
  out += fmt::format("set {}range [{}:{}]\n", letter, number(axis.range.from * axis.per_unit),
                     number(axis.range.to * axis.per_unit));
}

void write_palette(std::string& out, const Colours& colours) {
  out += "set palette defined (";
  constexpr std::size_t kStops = 16;
  for (std::size_t i = 0; i <= kStops; ++i) {
    const double share = static_cast<double>(i) / kStops;
    out += fmt::format("{}{} '{}'", i == 0 ? "" : ", ", i, hexadecimal(shade_of(colours, share)));
  }
  out += ")\n";
  write_axis(out, 'c',
             {colours.axis.label, colours.axis.name, colours.axis.range,
              colours.axis.is_logarithmic, colours.axis.per_unit});
  // gnuplot calls the axis of colours cb.
  const std::string from = "set clabel";
  out.replace(out.rfind(from), from.size(), "set cblabel");
  const std::string range = "set crange";
  out.replace(out.rfind(range), range.size(), "set cbrange");
  if (colours.axis.is_logarithmic) {
    const std::string scale = "set logscale c\n";
    out.replace(out.rfind(scale), scale.size(), "set logscale cb\n");
  }
}

void write_cells(std::string& out, const Panel& panel, const Figure& figure, std::size_t block) {
  const Cells& cells = panel.cells ? *panel.cells : panel.kinds->cells;
  const double per_unit = figure.colours ? figure.colours->axis.per_unit : 1.0;
  out += fmt::format("$data{} << EOD\n", block);
  for (std::size_t row = 0; row < cells.rows(); ++row) {
    for (std::size_t column = 0; column < cells.columns(); ++column) {
      // Corners of the cell, so that cells of any width are drawn where they are.
      const double value = cells.values[row * cells.columns() + column];
      if (!std::isnan(value)) {
        const auto x = [&](std::size_t i) { return number(cells.x_edges[i] * panel.x.per_unit); };
        const auto y = [&](std::size_t i) { return number(cells.y_edges[i] * panel.y.per_unit); };
        out += fmt::format("{} {} {} {} {} {} {}\n", x(column), y(row), x(column), x(column + 1),
                           y(row), y(row + 1), number(value * per_unit));
      }
    }
  }
  out += "EOD\n";
  if (panel.kinds) {
    out += fmt::format("set cbrange [0:{}]\nunset colorbox\n",
                       std::max<std::size_t>(2, panel.kinds->kinds.size()) - 1);
    out += "set palette defined (";
    for (std::size_t i = 0; i < panel.kinds->kinds.size(); ++i) {
      const Colour colour = panel.kinds->kinds[i].is_rest ? kFillOfOthers.colour : plain_fill(i);
      out += fmt::format("{}{} '{}'", i == 0 ? "" : ", ", i, hexadecimal(colour));
      // A palette of one colour wants two stops.
      if (panel.kinds->kinds.size() == 1) {
        out += fmt::format(", 1 '{}'", hexadecimal(colour));
      }
    }
    out += ")\nset key outside right\n";
  }
  out += fmt::format(
      "plot $data{} using 1:2:3:4:5:6:7 with boxxyerror palette fill solid 1 noborder "
      "notitle",
      block);
  for (std::size_t i = 0; panel.kinds && i < panel.kinds->kinds.size(); ++i) {
    const Colour colour = panel.kinds->kinds[i].is_rest ? kFillOfOthers.colour : plain_fill(i);
    out += fmt::format(", \\\n  NaN with boxes fill solid linecolor rgb '{}' title {} noenhanced",
                       hexadecimal(colour), gnuplot_text(panel.kinds->kinds[i].name));
  }
  out += '\n';
}

void write_bars(std::string& out, const Panel& panel, std::size_t block) {
  const Bars& bars = *panel.bars;
  out += fmt::format("$data{} << EOD\n", block);
  for (std::size_t i = 0; i < bars.heights.size(); ++i) {
    if (bars.names.empty()) {
      out += fmt::format("{} {} {}\n", number(bars.edges[i] * panel.x.per_unit),
                         number(bars.edges[i + 1] * panel.x.per_unit), number(bars.heights[i]));
    } else {
      out += fmt::format("\"{}\" {}\n", protocol::visible(bars.names[i]), number(bars.heights[i]));
    }
  }
  out += "EOD\nset style fill solid 0.8\n";
  out += bars.names.empty()
             ? fmt::format("plot $data{0} using (($1+$2)/2):3:($2-$1) with boxes notitle\n", block)
             : fmt::format(
                   "set yrange [*:*] reverse\nset ytics noenhanced\nplot $data{0} using "
                   "($2/2):0:($2/2):(0.36):ytic(1) with boxxyerror notitle\n",
                   block);
}

void write_points(std::string& out, const Panel& panel, const Figure& figure, std::size_t block) {
  const double per_unit = figure.colours ? figure.colours->axis.per_unit : 1.0;
  std::string plots;
  const auto add = [&](const std::vector<double>& x, const std::vector<double>& y,
                       const std::vector<double>& shades, double shade_of_all,
                       const std::string& style) {
    const std::string name = fmt::format("$data{}_{}", block, plots.empty() ? 0 : plots.size());
    out += name + " << EOD\n";
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double shade = shades.empty() ? shade_of_all : shades[i];
      out += fmt::format("{} {} {}\n", number(x[i] * panel.x.per_unit),
                         number(y[i] * panel.y.per_unit), number(shade * per_unit));
    }
    out += "EOD\n";
    plots += fmt::format("{}{} {}", plots.empty() ? "plot " : ", \\\n  ", name, style);
  };
  if (panel.dots) {
    add(panel.dots->x, panel.dots->y, panel.dots->shades, 0.0,
        panel.dots->shades.empty() ? "using 1:2 with points pointtype 7 pointsize 0.4 notitle"
                                   : "using 1:2:3 with points pointtype 7 pointsize 0.4 palette "
                                     "notitle");
  }
  for (const Curve& curve : panel.curves) {
    const std::string style = curve.has_line && curve.has_marks ? "linespoints"
                              : curve.has_line                  ? "lines"
                                                                : "points";
    add(curve.x, curve.y, {}, curve.shade.value_or(0.0),
        curve.shade ? "using 1:2:3 with lines palette notitle"
                    : fmt::format("using 1:2 with {} title {} noenhanced", style,
                                  gnuplot_text(curve.name)));
  }
  for (std::size_t i = 0; i < panel.known.size();) {
    const std::string& name = panel.known[i].name;
    std::vector<double> x;
    std::vector<double> y;
    for (; i < panel.known.size() && panel.known[i].name == name; ++i) {
      x.push_back(panel.known[i].x);
      y.push_back(panel.known[i].y);
    }
    add(x, y, {}, 0.0,
        fmt::format("using 1:2 with points pointtype 12 title {} noenhanced", gnuplot_text(name)));
  }
  const std::string key = figure.panels.size() > 1 ? "set key below\n" : "set key outside right\n";
  out += plots.empty() ? "plot NaN notitle\n" : key + plots + '\n';
}

}  // namespace

std::string gnuplot_of(const Figure& figure, const Size& size) {
  std::string out = fmt::format(
      "# gnuplot 5 or later: gnuplot FILE. Writes picture.svg.\nset terminal svg size {},{} "
      "background rgb 'white'\nset output 'picture.svg'\n",
      number(size.width), number(size.height));
  if (figure.panels.size() > 1) {
    const std::size_t columns = figure.panels.size() > 3 ? 2 : 1;
    out += fmt::format("set multiplot layout {},{} title {} noenhanced\n",
                       (figure.panels.size() + columns - 1) / columns, columns,
                       gnuplot_text(figure.title + ", " + figure.subtitle));
  } else {
    out += fmt::format("set title {} noenhanced\n",
                       gnuplot_text(figure.title + ", " + figure.subtitle));
  }
  if (has_colour_scale(figure)) {
    write_palette(out, *figure.colours);
  } else if (figure.colours) {
    out += "unset colorbox\n";
  }
  for (std::size_t i = 0; i < figure.panels.size(); ++i) {
    const Panel& panel = figure.panels[i];
    if (i > 0) {
      out += "unset logscale xy\nset size noratio\n";
    }
    if (figure.panels.size() > 1) {
      out += fmt::format("set title {} noenhanced\n", gnuplot_text(panel.title));
    }
    write_axis(out, 'x', panel.x);
    write_axis(out, 'y', panel.y);
    if (panel.has_equal_aspect) {
      out += "set size ratio -1\n";
    }
    if (panel.cells || panel.kinds) {
      write_cells(out, panel, figure, i);
    } else if (panel.bars) {
      write_bars(out, panel, i);
    } else {
      write_points(out, panel, figure, i);
    }
  }
  return out;
}

}  // namespace oblique::client::plot
