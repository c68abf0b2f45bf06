#include "client/plot/figure_table.h"

#include <cmath>
#include <string_view>
#include <variant>
#include <vector>

#include "client/io/row_output.h"

namespace oblique::client::plot {
namespace {

using Field = std::variant<std::string_view, double>;

void append_row(std::string& out, const std::vector<Field>& fields) {
  for (std::size_t i = 0; i < fields.size(); ++i) {
    out += i == 0 ? "" : ",";
    if (const auto* text = std::get_if<std::string_view>(&fields[i])) {
      append_csv_field(out, *text);
    } else if (const double value = std::get<double>(fields[i]); !std::isnan(value)) {
      append_number(out, value);
    }
  }
  out += '\n';
}

std::string_view name_of(CellState state) {
  switch (state) {
    case CellState::kSolved:
      return "solved";
    case CellState::kNoResult:
      return "no result";
    case CellState::kFiltered:
      return "filtered";
    case CellState::kFailed:
      return "failed";
    case CellState::kNoValue:
      return "no value";
    case CellState::kNoPoint:
      return "no point";
  }
  return "";
}

void append_cells(std::string& out, const Panel& panel, const Cells& cells) {
  append_row(out, {panel.x.name, panel.y.name, cells.name, std::string_view("state")});
  const auto x =
      cells.x_values.empty() ? middles_of(cells.x_edges, panel.x.is_logarithmic) : cells.x_values;
  const auto y =
      cells.y_values.empty() ? middles_of(cells.y_edges, panel.y.is_logarithmic) : cells.y_values;
  for (std::size_t i = 0; i < cells.values.size(); ++i) {
    Field value = cells.states[i] == CellState::kSolved ? cells.values[i] : std::nan("");
    if (cells.states[i] == CellState::kSolved && !cells.names.empty()) {
      value = std::string_view(cells.names[i]);
    }
    append_row(out, {x[i % x.size()], y[i / x.size()], value, name_of(cells.states[i])});
  }
}

void append_bars(std::string& out, const Panel& panel, const Bars& bars) {
  const std::string from = panel.x.name + "_from";
  const std::string to = panel.x.name + "_to";
  const std::string_view points = "points";
  append_row(out, bars.names.empty() ? std::vector<Field>{from, to, points}
                                     : std::vector<Field>{panel.y.name, points});
  for (std::size_t i = 0; i < bars.heights.size(); ++i) {
    append_row(out, bars.names.empty()
                        ? std::vector<Field>{bars.edges[i], bars.edges[i + 1], bars.heights[i]}
                        : std::vector<Field>{bars.names[i], bars.heights[i]});
  }
}

void append_dots(std::string& out, const Panel& panel, const Dots& dots, const Figure& figure) {
  std::vector<Field> row{panel.x.name, panel.y.name};
  if (!dots.shades.empty()) {
    row.emplace_back(figure.colours ? std::string_view(figure.colours->name) : "colour");
  }
  append_row(out, row);
  for (std::size_t i = 0; i < dots.x.size(); ++i) {
    row = {dots.x[i], dots.y[i]};
    if (!dots.shades.empty()) {
      row.emplace_back(dots.shades[i]);
    }
    append_row(out, row);
  }
}

void append_curves(std::string& out, const Panel& panel) {
  const bool has_names = panel.curves.size() > 1 || !panel.known.empty() || !panel.by_name.empty();
  const auto append = [&](const Field& name, const Field& x, const Field& y) {
    append_row(out, has_names ? std::vector<Field>{name, x, y} : std::vector<Field>{x, y});
  };
  append(panel.by_name.empty() ? std::string_view("line") : panel.by_name, panel.x.name,
         panel.y.name);
  for (const Curve& curve : panel.curves) {
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      append(curve.by ? Field(*curve.by) : Field(curve.name), curve.x[i], curve.y[i]);
    }
  }
  for (const KnownPoint& known : panel.known) {
    append(known.name, known.x, known.y);
  }
}

}  // namespace

std::string csv_of(const Figure& figure) {
  std::string out;
  for (const Panel& panel : figure.panels) {
    out += out.empty() ? "" : "\n";
    if (panel.cells) {
      append_cells(out, panel, *panel.cells);
    } else if (panel.bars) {
      append_bars(out, panel, *panel.bars);
    } else if (panel.dots) {
      append_dots(out, panel, *panel.dots, figure);
    } else {
      append_curves(out, panel);
    }
  }
  return out;
}

}  // namespace oblique::client::plot
