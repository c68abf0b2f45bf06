#include "client/plot/files/figure_table.h"

#include <cmath>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/formats/cell_text.h"
#include "proto/text.h"

namespace oblique::client::plot {
namespace {

/// Fields of one row, in turn.
class CsvRow {
 public:
  explicit CsvRow(std::string& out) : out_(out) {}
  ~CsvRow() { out_ += "\n"; }
  CsvRow(const CsvRow&) = delete;
  CsvRow& operator=(const CsvRow&) = delete;

  CsvRow& text(std::string_view text) {
    separate();
    append_csv_field(out_, text);
    return *this;
  }
  CsvRow& number(double value) {
    separate();
    if (!std::isnan(value)) {
      append_number(out_, value);
    }
    return *this;
  }

 private:
  void separate() {
    out_ += is_first_ ? "" : ",";
    is_first_ = false;
  }

  std::string& out_;
  bool is_first_ = true;
};

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

template <class Write>
void each_cell(const Cells& cells, const Panel& panel, const Write& write) {
  const auto x =
      cells.x_values.empty() ? middles_of(cells.x_edges, panel.x.is_logarithmic) : cells.x_values;
  const auto y =
      cells.y_values.empty() ? middles_of(cells.y_edges, panel.y.is_logarithmic) : cells.y_values;
  for (std::size_t row = 0; row < y.size(); ++row) {
    for (std::size_t column = 0; column < x.size(); ++column) {
      write(x[column], y[row], row * x.size() + column);
    }
  }
}

void append_cells(std::string& out, const Panel& panel, const std::string& value_name) {
  const Cells& cells = panel.cells ? *panel.cells : panel.kinds->cells;
  CsvRow(out).text(panel.x.name).text(panel.y.name).text(value_name).text("state");
  each_cell(cells, panel, [&](double x, double y, std::size_t i) {
    CsvRow row(out);
    row.number(x).number(y);
    if (cells.states[i] != CellState::kSolved) {
      row.number(std::nan(""));
    } else if (panel.kinds) {
      row.text(panel.kinds->names[i]);
    } else {
      row.number(cells.values[i]);
    }
    row.text(name_of(cells.states[i]));
  });
}

void append_bars(std::string& out, const Panel& panel) {
  const Bars& bars = *panel.bars;
  if (!bars.names.empty()) {
    CsvRow(out).text(panel.y.name).text("points");
  } else {
    CsvRow(out).text(panel.x.name + "_from").text(panel.x.name + "_to").text("points");
  }
  for (std::size_t i = 0; i < bars.heights.size(); ++i) {
    CsvRow row(out);
    if (!bars.names.empty()) {
      row.text(bars.names[i]);
    } else {
      row.number(bars.edges[i]).number(bars.edges[i + 1]);
    }
    row.number(bars.heights[i]);
  }
}

void append_dots(std::string& out, const Panel& panel, const Figure& figure) {
  const Dots& dots = *panel.dots;
  {
    CsvRow header(out);
    header.text(panel.x.name).text(panel.y.name);
    if (!dots.shades.empty()) {
      header.text(figure.colours ? figure.colours->axis.name : "colour");
    }
  }
  for (std::size_t i = 0; i < dots.x.size(); ++i) {
    CsvRow row(out);
    row.number(dots.x[i]).number(dots.y[i]);
    if (!dots.shades.empty()) {
      row.number(dots.shades[i]);
    }
  }
}

void append_curves(std::string& out, const Panel& panel) {
  const bool has_known = !panel.known.empty();
  const bool is_told_apart = panel.curves.size() > 1 || has_known || !panel.by_name.empty();
  {
    CsvRow header(out);
    if (is_told_apart) {
      header.text(panel.by_name.empty() ? "line" : panel.by_name);
    }
    header.text(panel.x.name).text(panel.y.name);
  }
  const auto append = [&](const Curve* curve, const std::string& name, double x, double y) {
    CsvRow row(out);
    if (is_told_apart && curve != nullptr && curve->by) {
      row.number(*curve->by);
    } else if (is_told_apart) {
      row.text(name);
    }
    row.number(x).number(y);
  };
  for (const Curve& curve : panel.curves) {
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      append(&curve, curve.name, curve.x[i], curve.y[i]);
    }
  }
  for (const KnownPoint& known : panel.known) {
    append(nullptr, known.name, known.x, known.y);
  }
}

}  // namespace

std::string csv_of(const Figure& figure) {
  std::string out;
  for (std::size_t i = 0; i < figure.panels.size(); ++i) {
    const Panel& panel = figure.panels[i];
    if (i > 0) {
      out += "\n";
    }
    if (panel.cells || panel.kinds) {
      append_cells(out, panel, panel.kinds ? panel.kinds->name : figure.colours->axis.name);
    } else if (panel.bars) {
      append_bars(out, panel);
    } else if (panel.dots) {
      append_dots(out, panel, figure);
    } else {
      append_curves(out, panel);
    }
  }
  return out;
}

}  // namespace oblique::client::plot
