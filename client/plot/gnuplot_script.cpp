#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"
#include "client/plot/figure.h"
#include "client/plot/picture_file.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

// Line styles differ in lightness, dashes and marks, so that they are distinct in greyscale print.
constexpr std::size_t kLineStyles = 8;
constexpr std::string_view kStyles = R"(set encoding utf8
set border 15 lc rgb '#556070' lw 1
set tics out nomirror textcolor rgb '#1b1f24'
set key noenhanced Left reverse samplen 3.2 spacing 1.15
set style textbox opaque fillcolor rgb '#ffffff' noborder margins 0.3,0.3
set style line 1 lw 1.7 ps 0.7 lc rgb '#0067a5' dt solid pt 6
set style line 2 lw 1.7 ps 0.7 lc rgb '#c44e00' dt (9,4) pt 4
set style line 3 lw 1.7 ps 0.7 lc rgb '#007f5c' dt (2.5,3) pt 8
set style line 4 lw 1.7 ps 0.7 lc rgb '#aa3377' dt (10,4,2.5,4) pt 12
set style line 5 lw 1.7 ps 0.7 lc rgb '#7a6200' dt (18,5) pt 2
set style line 6 lw 1.7 ps 0.7 lc rgb '#332288' dt (5,3,2,3,2,3) pt 1
set style line 7 lw 1.7 ps 0.7 lc rgb '#666666' dt (2,5) pt 6
set style line 8 lw 1.7 ps 0.7 lc rgb '#111111' dt (14,4,4,4) pt 4
)";

/// Template of an axis: {0} is its letter, {1} its label, {2} and {3} its range.
constexpr std::string_view kAxis = R"(set {0}label {1} noenhanced
unset logscale {0}
set {0}tics autofreq
set format {0} '%h'
set {0}range [{2}:{3}]
)";

constexpr std::array<std::uint32_t, 11> kViridis{0x440154, 0x482475, 0x414487, 0x355f8d,
                                                 0x2a788e, 0x21918c, 0x22a884, 0x44bf70,
                                                 0x7ad151, 0xbddf26, 0xfde725};

// Compression is darker than restitution, also in greyscale; stick is hatched over both.
constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kSpanStyles{{
    {"compression", "fs solid 1 noborder fc rgb '#cfe1f3'"},
    {"restitution", "fs solid 1 noborder fc rgb '#fcf3e6'"},
    {"stick", "fs transparent pattern 5 noborder fc rgb '#939da7'"},
}};

/// Styles of curves, indexed by Curve::Mark.
constexpr std::array<std::string_view, 5> kMarks{
    "lines ls {}", "linespoints ls {}", "points ls {} pt 7 ps 0.4", "points ls {} pt 12 ps 1.0",
    "lines lc rgb '#202428' dt solid lw 1.5"};

// Sizes of text in pixels. A character of a terminal is kLetter wide and kLine high.
constexpr double kLetter = 6.5;  // average width of a letter, rounded up
constexpr double kLine = 17.0;
constexpr double kTitle = 22.0;
constexpr double kMargin = 12.0;

/// Legend entry of a map: a category of cells, or a kind of cells without a value.
struct Kind {
  std::uint32_t colour;
  int pattern;           ///< gnuplot's number of the pattern; 0: none
  std::string_view ink;  ///< colour of the pattern
  char letter;           ///< mark on terminals; in pictures only if it is a capital
  std::string text;      ///< name in the legend
  std::uint64_t count;   ///< number of points or cells of this kind

  bool has_capital() const { return std::isupper(static_cast<unsigned char>(letter)) != 0; }
};
constexpr int kNoKind = -1;  // for a cell that has a numeric value or is blank

/// Returns the categories, followed by the kinds no result, excluded and failed.
std::vector<Kind> kinds_of(const Cells& cells) {
  // Colours light enough for black patterns and letters: the scheme "light" of P. Tol, a brown, and
  // four darker colours.
  static constexpr std::array<std::uint32_t, 12> kFills{0x77aadd, 0xeedd88, 0xee8866, 0x99ddff,
                                                        0xbbcc33, 0xffaabb, 0x44bb99, 0xb59a80,
                                                        0x5a88b5, 0xc2b25c, 0xc2694b, 0x70b3d1};
  static constexpr std::array<int, 7> kPatterns{0, 5, 4, 1, 7, 6, 2};
  std::uint64_t whole = 0;
  for (const Category& category : cells.categories) {
    whole += category.points;
  }
  std::vector<Kind> kinds;
  for (const auto& [name, points, is_other] : cells.categories) {
    const std::size_t i = kinds.size();
    const double share = 100.0 * static_cast<double>(points) / static_cast<double>(whole);
    kinds.push_back(
        {kFills[i % kFills.size()], kPatterns[i % kPatterns.size()], "#4a4f57",
         static_cast<char>('A' + i % 26),
         fmt::format("{} ({}\u00a0%)", protocol::visible(name),
                     share < 0.1 ? "<0.1" : solver::fixed_number(share, share < 10.0 ? 1 : 0)),
         points});
    if (is_other) {
      kinds.back() = {0xdddddd, 2, "#8a8f96", '*', kinds.back().text, points};
    }
  }
  const auto add_gap = [&](CellState state, Kind kind) {
    kind.count = cells.count(state);
    kind.text += fmt::format(" ({})", format_count(kind.count));
    kinds.push_back(std::move(kind));
  };
  add_gap(CellState::kNoResult, {0xffffff, 5, "#9aa3ad", '/', "no result", 0});
  add_gap(CellState::kFiltered, {0xeceff2, 6, "#c3cad2", '-', "excluded by --where", 0});
  add_gap(CellState::kFailed, {0xffffff, 1, "#c01c14", 'x', "failed", 0});
  return kinds;
}

/// Index of a cell's kind; kNoKind if it has none.
int kind_of(const Cells& cells, std::size_t cell) {
  const auto categories = static_cast<int>(cells.categories.size());
  const CellState state = cells.states[cell];
  if (state == CellState::kSolved && categories > 0) {
    return static_cast<int>(cells.values[cell]);
  }
  return state == CellState::kNoResult   ? categories
         : state == CellState::kFiltered ? categories + 1
         : state == CellState::kFailed   ? categories + 2
                                         : kNoKind;
}

/// A panel divided into equal parts, row by row from below. Each part has the index of the cell at
/// its middle.
struct Raster {
  std::size_t columns;
  std::size_t rows;
  std::vector<std::size_t> cells = {};

  double x_share(std::size_t part) const {
    return (static_cast<double>(part % columns) + 0.5) / static_cast<double>(columns);
  }
  double y_share(std::size_t part) const {
    const std::size_t line = part / columns;
    return (static_cast<double>(line) + 0.5) / static_cast<double>(rows);
  }
};

Raster raster_of(const Panel& panel, std::size_t columns, std::size_t rows) {
  Raster raster{columns, rows};
  for (std::size_t part = 0; part < columns * rows; ++part) {
    const double x = panel.x.value_at(raster.x_share(part));
    const double y = panel.y.value_at(raster.y_share(part));
    raster.cells.push_back(interval_of(panel.cells->y.edges, y) * panel.cells->columns() +
                           interval_of(panel.cells->x.edges, x));
  }
  return raster;
}

/// Returns the places of the letters in a map. They are the middles of the largest squares of each
/// category, far apart from each other.
std::vector<std::size_t> letter_places(const Cells& cells, const Raster& raster) {
  const std::size_t columns = raster.columns;
  const auto kind_at = [&](std::size_t part) { return kind_of(cells, raster.cells[part]); };
  std::vector<std::size_t> sides(raster.cells.size(), 1);
  std::vector<std::size_t> corners;  // upper right corners of squares with room for a letter
  for (std::size_t i = columns + 1; i < sides.size(); ++i) {
    const int kind = kind_at(i);
    if (i % columns != 0 && kind == kind_at(i - 1) && kind == kind_at(i - columns) &&
        kind == kind_at(i - columns - 1)) {
      sides[i] = 1 + std::min({sides[i - 1], sides[i - columns], sides[i - columns - 1]});
    }
    if (sides[i] >= 3 && kind >= 0 && kind < static_cast<int>(cells.categories.size())) {
      corners.push_back(i);
    }
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [&](std::size_t a, std::size_t b) { return sides[a] > sides[b]; });
  std::vector<std::size_t> places;
  std::map<int, std::size_t> largest;  // size of the largest square by kind
  for (const std::size_t corner : corners) {
    const std::size_t place = corner - sides[corner] / 2 * (columns + 1);
    const int kind = kind_at(place);
    const auto is_near = [&](std::size_t other) {
      return kind_at(other) == kind &&
             std::hypot(raster.x_share(other) - raster.x_share(place),
                        raster.y_share(other) - raster.y_share(place)) < 0.35;
    };
    if (4 * sides[corner] >= largest.emplace(kind, sides[corner]).first->second &&
        std::none_of(places.begin(), places.end(), is_near)) {
      places.push_back(place);
    }
  }
  return places;
}

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.8g}", value) : "NaN";
}

/// Converts the values of an axis to the numbers of a script. gnuplot shows six digits. If the
/// range is too narrow for these, the numbers are differences from a round number, which the label
/// names, and the axis is linear.
struct Shown {
  FigureAxis axis;
  double offset = 0.0;  ///< in the shown unit

  explicit Shown(const FigureAxis& of) : axis(of) {
    axis.span(of.range);  // no range is empty
    const auto [from, to] = axis.range;
    const double size = axis.per_unit * std::max(std::abs(from), std::abs(to));
    const double width = axis.per_unit * (to - from);
    if (width > 1e-4 * size) {
      return;
    }
    const auto digits =
        static_cast<int>(std::floor(std::log10(size)) - std::floor(std::log10(1.01 * width)));
    const std::string round = solver::readable_number(axis.per_unit * 0.5 * (from + to), digits);
    offset = solver::number_of(round).value_or(0.0);
    axis.is_logarithmic = false;
    axis.label.insert(
        std::min(axis.label.rfind(" ["), axis.label.size()),
        offset > 0.0 ? " \u2212 " + round : " + " + solver::readable_number(-offset, digits));
  }
  double operator()(double value) const { return value * axis.per_unit - offset; }
};

/// Breaks a text at spaces into lines of at most `letters` characters.
std::vector<std::string> lines_of(const std::string& text, double letters) {
  return wrapped(text, static_cast<std::size_t>(std::max(letters, 8.0)));
}

/// Returns `text` with `mark` inserted before each of the characters in `letters`.
std::string marked(std::string_view text, std::string_view letters, char mark) {
  std::string out;
  for (const char letter : text) {
    out += letters.find(letter) == std::string_view::npos ? "" : std::string(1, mark);
    out += letter;
  }
  return out;
}

std::size_t rows_of(const Figure& figure) {
  return std::max<std::size_t>(1, (figure.panels.size() + figure.columns - 1) / figure.columns);
}

/// Builds the gnuplot script of one figure.
class Script {
 public:
  Script(const Figure& figure, Size size, bool is_text)
      : figure_(figure),
        size_(size),
        is_text_(is_text),
        colour_(figure.colours.value_or(FigureAxis())) {
    if (figure.panels.empty()) {
      throw solver::InputError("this answer has no picture: leave out --out and --show");
    }
    const double letters = (size.width - 2.0 * kMargin) / kLetter;
    if (!figure.subtitle.empty()) {
      subtitle_ = lines_of(figure.subtitle, letters);
    }
    for (const Panel& panel : figure.panels) {
      if (const Shown y(panel.y); is_text && y.offset != 0.0) {
        subtitle_.push_back("vertical axis: " + y.axis.label);  // terminals show no such label
      }
    }
    for (const auto& note : figure.notes) {
      const auto lines = lines_of(note, letters);
      notes_.insert(notes_.end(), lines.begin(), lines.end());
    }
  }

  std::string written() {
    const bool is_map = !figure_.panels.empty() && figure_.panels.front().cells;
    out_ += kStyles;
    out_ += is_text_ ? "" : "set xlabel offset 0,0.4\nset cblabel offset 1.2,0\n";
    out_ += is_text_ || is_map ? "" : "set grid back lt 1 lc rgb '#d9dfe6' lw 0.8\n";
    if (has_colours()) {
      std::vector<std::string> colours;
      for (const std::uint32_t colour : kViridis) {
        colours.push_back(fmt::format("{} '#{:06x}'", colours.size(), colour));
      }
      add("set palette defined ({})\n", fmt::join(colours, ", "));
      write_axis("cb", colour_);
      const double size = std::abs(colour_(colour_.axis.range.to));
      const bool has_exponents = size >= 1e6 || size < 1e-3;
      out_ += has_exponents && !is_text_ ? "set rmargin at screen 0.8\n" : "";
    } else {
      out_ += "unset colorbox\n";
    }
    write_texts();
    const bool is_multiplot = figure_.panels.size() > 1;
    out_ += is_multiplot ? "\nset multiplot\n" : "";
    for (std::size_t i = 0; i < figure_.panels.size(); ++i) {
      write_panel(figure_.panels[i], i);
    }
    out_ += is_multiplot ? "unset multiplot\n" : "";
    return std::move(out_);
  }
  /// Heights of the texts above and below the panels.
  double above() const { return kMargin + kTitle + kLine * static_cast<double>(subtitle_.size()); }
  double below() const {
    return kLine * static_cast<double>(notes_.size()) + kMargin / 2.0 + (is_text_ ? kLine : 0.0);
  }

 private:
  template <class... Values>
  void add(fmt::format_string<Values...> form, Values&&... values) {
    fmt::format_to(std::back_inserter(out_), form, std::forward<Values>(values)...);
  }
  template <class... Values>
  void plot(fmt::format_string<Values...> form, Values&&... values) {
    plots_.push_back(fmt::format(form, std::forward<Values>(values)...));
  }
  /// A position in gnuplot's screen coordinates, given from the upper left corner.
  std::string screen(double x, double y) const {
    return fmt::format("screen {:.4f}, {:.4f}", x / size_.width, 1.0 - y / size_.height);
  }
  /// Writes lines of text below each other and returns the y position of the next line.
  double label(const std::vector<std::string>& lines, double x, double y, std::string_view more) {
    for (const auto& line : lines) {
      add("set label {} at {} left noenhanced{}\n", gnuplot_text(line), screen(x, y), more);
      y += kLine;
    }
    return y;
  }
  /// Begins a block of data and returns its name.
  std::string begin_data() {
    const std::string name = fmt::format("$data{}", ++blocks_);
    out_ += name + " << EOD\n";
    return name;
  }
  void row(std::initializer_list<double> values) {
    for (const double value : values) {
      out_ += number(value) + ' ';
    }
    out_.back() = '\n';
  }
  /// Title of an element in the key; an empty title gives no entry.
  std::string titled(const std::string& title) {
    titles_.push_back(title);
    return "title " + gnuplot_text(title);
  }
  bool has_colours() const { return figure_.colours && !figure_.is_empty; }

  void write_texts() {
    constexpr std::string_view kGrey = " tc rgb '#555f6b'";
    out_ += "\n# Title and notes\n";
    const double x = kMargin;
    const double y = kMargin + kTitle / 2.0;
    if (is_text_) {
      label({figure_.title}, x, y, "");
    } else {
      // Bold letters need gnuplot's enhanced text. A backslash makes characters literal.
      const auto title = gnuplot_text(marked(protocol::visible(figure_.title), "\\_^{}@&~", '\\'));
      add("set label '{{/:Bold*1.25 {}}}' at {} left\n", title.substr(1, title.size() - 2),
          screen(x, y));
    }
    label(subtitle_, x, kMargin + kTitle + kLine / 2.0, kGrey);
    label(notes_, x,
          size_.height - kMargin / 2.0 - kLine * (static_cast<double>(notes_.size()) - 0.5), kGrey);
  }

  void write_axis(std::string_view letter, const Shown& shown) {
    const FigureAxis& axis = shown.axis;
    const Range range{shown(axis.range.from), shown(axis.range.to)};
    add(kAxis, letter, gnuplot_text(axis.label), number(range.from), number(range.to));
    if (!axis.is_logarithmic) {
      return;
    }
    // gnuplot marks only powers of ten by default. It omits ticks outside the range.
    const double decades = std::log10(range.to) - std::log10(range.from);
    const double step = round_step(range, 6.0);
    add("set logscale {}\n", letter);
    if (decades < 0.9) {
      add("set {0}tics ()\ndo for [i={1:.0f}:{2:.0f}] {{ set {0}tics add (i*{3:g}) }}\n", letter,
          std::ceil(range.from / step), std::floor(range.to / step), step);
    } else if (decades < 3.0) {
      add("set {0}tics ()\ndo for [power={1:.0f}:{2:.0f}] {{ do for [digit in '{3}'] {{ "
          "set {0}tics add (digit*10.0**power) }} }}\n",
          letter, std::floor(std::log10(range.from)), std::floor(std::log10(range.to)),
          decades < 2.5 ? "1 2 5" : "1 3");
    } else if (!is_text_) {
      add("set format {} '10^{{%T}}'\n", letter);
    }
  }

  /// Writes the position of the panel in the picture, and its title.
  void write_frame(const Panel& panel, std::size_t index) {
    frame_.width = size_.width / static_cast<double>(figure_.columns);
    frame_.height = (size_.height - above() - below()) / static_cast<double>(rows_of(figure_));
    frame_.left = frame_.width * static_cast<double>(index % figure_.columns);
    const std::size_t panel_row = index / figure_.columns;
    frame_.bottom = above() + frame_.height * static_cast<double>(panel_row + 1);
    const double title_height = panel.title.empty() ? kMargin : (is_text_ ? 2.0 : 1.6) * kLine;
    add("set origin {:.4f}, {:.4f}\nset size {} {:.4f}, {:.4f}\nset tmargin at screen {:.4f}\n",
        frame_.left / size_.width, 1.0 - frame_.bottom / size_.height,
        panel.has_equal_aspect ? "ratio -1" : "noratio", frame_.width / size_.width,
        frame_.height / size_.height,
        1.0 - (frame_.bottom - frame_.height + title_height) / size_.height);
    if (!panel.title.empty()) {
      add("set label {} at graph 0, graph 1 left offset 0, character {} noenhanced\n",
          gnuplot_text(panel.title), is_text_ ? "1" : "0.8");
    }
  }

  /// Width, in letters, of the numbers or names left of the panels: the maximum of all panels.
  double left_letters() const {
    std::size_t longest = 10;
    for (const Panel& panel : figure_.panels) {
      for (const std::string& name : panel.bars ? panel.bars->names : std::vector<std::string>()) {
        longest = std::max(longest, name.size());
      }
    }
    return static_cast<double>(longest + 3);
  }

  /// Places the key beside the panel if the picture has room there or the panel is narrow.
  /// Otherwise the key is below the panel, in as many columns as fit.
  void write_key(const Panel& panel) {
    const bool is_alone = figure_.panels.size() == 1;
    const bool is_below = is_alone ? has_colours() || is_text_ : !panel.has_equal_aspect;
    std::size_t longest = 0;
    for (const std::string& title : titles_) {
      longest = std::max(longest, title.size());
    }
    const double room = frame_.width / kLetter - 20.0;
    const double columns =
        std::clamp(std::floor(room / static_cast<double>(longest + 8)), 1.0, 3.0);
    const double lines = is_below ? std::ceil(static_cast<double>(titles_.size()) / columns) : 0.0;
    add("set key {} maxcols {}\n",
        !is_below  ? "rmargin top vertical"
        : is_text_ ? "bmargin left horizontal"  // width -1 makes letters overlap on a terminal
                   : "bmargin left horizontal width -1",
        is_below ? columns : 1.0);
    if (!is_alone || lines > 0.0) {
      add("set bmargin at screen {:.4f}\n",
          1.0 - (frame_.bottom - (1.15 * lines + 3.8) * kLine) / size_.height);
    }
    if (!is_alone) {
      // Aligns the axes of panels that are in one column.
      add("set lmargin at screen {:.4f}\nset rmargin at screen {:.4f}\n",
          (frame_.left + left_letters() * kLetter) / size_.width,
          (frame_.left + frame_.width - (is_below ? 3.0 : 28.0) * kLetter) / size_.width);
    }
  }

  void write_panel(const Panel& panel, std::size_t index) {
    plots_.clear();
    titles_.clear();
    out_ += figure_.panels.size() == 1 ? "\n# Axes\n" : fmt::format("\n# Panel {}\n", index + 1);
    write_frame(panel, index);
    x_ = Shown(panel.x);
    y_ = Shown(panel.y);
    if (is_text_ && figure_.panels.size() > 1) {
      y_.axis.label.clear();  // the label would cover the numbers of the ticks
    }
    write_axis("x", x_);
    write_axis("y", y_);
    for (const Span& span : panel.spans) {
      if (!is_text_) {
        add("set object rectangle from {}, graph 0 to {}, graph 1 behind {}\n",
            number(x_(span.from)), number(x_(span.to)),
            kSpanStyles[static_cast<std::size_t>(span.kind)].second);
      }
    }
    if (panel.cells && !panel.cells->values.empty()) {
      const auto kinds = kinds_of(*panel.cells);
      is_text_ ? write_characters(panel, kinds) : write_cells(panel, kinds);
      write_legend(*panel.cells, kinds);
    }
    if (panel.bars) {
      write_bars(panel);
    }
    write_curves(panel);
    if (plots_.empty()) {
      plot("NaN notitle");
    }
    write_key(panel);
    add("plot {}\n", fmt::join(plots_, ", \\\n     "));
    out_ += figure_.panels.size() == 1 ? "" : "unset label\nunset object\n";
  }

  /// Draws the cells of a map: colours, patterns, borders between categories, and letters. Equal
  /// neighbours in a row are merged into one rectangle.
  void write_cells(const Panel& panel, const std::vector<Kind>& kinds) {
    const Cells& cells = *panel.cells;
    out_ += "\n# Cells: x y x0 x1 y0 y1 kind, and a colour or, of kind -1, a value\n";
    const auto data = begin_data();
    for (std::size_t i = 0, end = 0; i < cells.values.size(); i = end) {
      const std::size_t line = i / cells.columns();
      const int kind = kind_of(cells, i);
      end = i + 1;
      while (kind != kNoKind && end < (line + 1) * cells.columns() && kind_of(cells, end) == kind) {
        ++end;
      }
      if (kind == kNoKind && cells.states[i] != CellState::kSolved) {
        continue;
      }
      const double x0 = x_(cells.x.edges[i % cells.columns()]);
      const double x1 = x_(cells.x.edges[(end - 1) % cells.columns() + 1]);
      const double y0 = y_(cells.y.edges[line]);
      row({x0, y0, x0, x1, y0, y_(cells.y.edges[line + 1]), static_cast<double>(kind),
           kind == kNoKind ? colour_(cells.values[i])
                           : static_cast<double>(kinds[static_cast<std::size_t>(kind)].colour)});
    }
    out_ += "EOD\n";
    // Without the border, viewers show gaps between rectangles.
    constexpr std::string_view kRectangles =
        "{} using ($7{}0?$1:NaN):2:3:4:5:6:8 with boxxyerror fs solid 1 lc {} lw 0.3 notitle";
    if (has_colours()) {
      plot(kRectangles, data, "<", "palette");
    }
    if (std::any_of(kinds.begin(), kinds.end(), [](const Kind& kind) { return kind.count > 0; })) {
      plot(kRectangles, data, ">=", "rgb variable");
    }
    const bool has_borders = !cells.categories.empty() && write_borders(panel);
    for (std::size_t i = has_borders ? 0 : cells.categories.size(); i < kinds.size(); ++i) {
      if (kinds[i].pattern != 0 && kinds[i].count > 0) {
        plot(
            "{} using ($7=={}?$1:NaN):2:3:4:5:6 with boxxyerror fs transparent pattern {} noborder "
            "fc rgb '{}' notitle",
            data, i, kinds[i].pattern, kinds[i].ink);
      }
    }
    if (has_borders) {
      // Parts of the raster are about 5 pixels wide and high, because the picture is wider than the
      // map.
      const auto raster = raster_of(panel, static_cast<std::size_t>(0.13 * size_.width),
                                    static_cast<std::size_t>(0.13 * size_.height));
      for (const std::size_t place : letter_places(cells, raster)) {
        const auto& kind = kinds[static_cast<std::size_t>(kind_of(cells, raster.cells[place]))];
        if (kind.has_capital()) {
          add("set label '{{/:Bold {}}}' at graph {:.4f}, {:.4f} center front boxed\n", kind.letter,
              raster.x_share(place), raster.y_share(place));
        }
      }
    }
  }

  /// Draws lines between neighbours of different categories. Draws nothing and returns false if
  /// there are too many lines to distinguish areas.
  bool write_borders(const Panel& panel) {
    const Cells& cells = *panel.cells;
    const auto categories = static_cast<int>(cells.categories.size());
    const auto differ = [&](std::size_t a, std::size_t b) {
      const int one = kind_of(cells, a);
      const int other = kind_of(cells, b);
      return one != other && one >= 0 && other >= 0 && one < categories && other < categories;
    };
    std::vector<std::array<double, 4>> pieces;
    for (std::size_t i = 0; i < cells.values.size(); ++i) {
      const std::size_t column = i % cells.columns();
      const std::size_t line = i / cells.columns();
      const double x0 = x_(cells.x.edges[column]);
      const double x1 = x_(cells.x.edges[column + 1]);
      const double y0 = y_(cells.y.edges[line]);
      const double y1 = y_(cells.y.edges[line + 1]);
      if (column + 1 < cells.columns() && differ(i, i + 1)) {
        pieces.push_back({x1, y0, 0.0, y1 - y0});
      }
      if (line + 1 < cells.rows() && differ(i, i + cells.columns())) {
        pieces.push_back({x0, y1, x1 - x0, 0.0});
      }
    }
    if (pieces.size() > std::max<std::size_t>(600, cells.values.size() / 2)) {
      return false;
    }
    out_ += "# Borders of categories: x y dx dy\n";
    const auto data = begin_data();
    for (const auto& [x, y, dx, dy] : pieces) {
      row({x, y, dx, dy});
    }
    out_ += "EOD\n";
    plot("{} using 1:2:3:4 with vectors nohead lc rgb '#202428' lw 1 dt solid notitle", data);
    return true;
  }

  /// gnuplot cannot fill rectangles on a terminal. The map therefore consists of characters: one
  /// per category, or a scale from light to dark.
  void write_characters(const Panel& panel, const std::vector<Kind>& kinds) {
    constexpr std::string_view kLightToDark = ".:-=+*%#@";
    const Cells& cells = *panel.cells;
    // The raster has one part per character of the terminal; more parts would overwrite each other.
    const auto raster = raster_of(panel, static_cast<std::size_t>(size_.width / kLetter),
                                  static_cast<std::size_t>(size_.height / kLine));
    const auto data = begin_data();
    for (std::size_t part = 0; part < raster.cells.size(); ++part) {
      const std::size_t cell = raster.cells[part];
      char letter = ' ';
      std::uint32_t colour = 0x808080;
      if (const int kind = kind_of(cells, cell); kind != kNoKind) {
        letter = kinds[static_cast<std::size_t>(kind)].letter;
        colour = std::isalpha(static_cast<unsigned char>(letter)) != 0
                     ? kinds[static_cast<std::size_t>(kind)].colour
                     : colour;
      } else if (cells.states[cell] == CellState::kSolved) {
        const double share = std::clamp(figure_.colours->share_of(cells.values[cell]), 0.0, 1.0);
        letter = kLightToDark[static_cast<std::size_t>(share * 8.999)];
        colour = kViridis[static_cast<std::size_t>(share * 10.0 + 0.5)];
      }
      add("{} {} \"{}\" {}\n", number(x_(panel.x.value_at(raster.x_share(part)))),
          number(y_(panel.y.value_at(raster.y_share(part)))), letter, colour);
    }
    out_ += "EOD\n";
    plot("{} using 1:2:3:4 with labels tc rgb variable notitle", data);
  }

  /// Writes the legend of a map. Entries for categories need colour, pattern and letter, so they
  /// are drawn beside the map; other entries use gnuplot's key.
  void write_legend(const Cells& cells, const std::vector<Kind>& kinds) {
    const bool is_key = is_text_ || cells.categories.empty();
    const double sample = 4.4 * kLetter;
    double width = 0.0;
    for (const Kind& kind : kinds) {
      width = std::max(width, kLetter * static_cast<double>(kind.text.size()));
    }
    width = std::min(0.36 * size_.width, width) + 7.0 * kLetter;
    const double x = size_.width - width;
    double y = above() + kMargin + kLine / 2.0;
    if (!is_key) {
      add("# Legend\nset rmargin at screen {:.4f}\n", (x - kMargin) / size_.width);
    }
    for (const Kind& kind : kinds) {
      if (kind.count == 0) {
        continue;
      }
      if (is_text_) {
        plot("keyentry with lines lt nodraw {}",
             titled(fmt::format("{}  {}", kind.letter, kind.text)));
        continue;
      }
      if (is_key) {
        const bool is_white = kind.colour == 0xffffff;
        plot("keyentry with boxes fs {} border lc rgb '#556070' fc rgb '{}' {}",
             is_white ? fmt::format("pattern {}", kind.pattern) : "solid 1",
             is_white ? std::string(kind.ink) : fmt::format("#{:06x}", kind.colour),
             titled(kind.text));
        continue;
      }
      const std::string place = fmt::format("set object rectangle from {} to {}",
                                            screen(x, y + 6.5), screen(x + sample, y - 6.5));
      add("{} fs solid 1 border lc rgb '#556070' fc rgb '#{:06x}'\n", place, kind.colour);
      if (kind.pattern != 0) {
        add("{} fs transparent pattern {} border lc rgb '#556070' fc rgb '{}'\n", place,
            kind.pattern, kind.ink);
      }
      if (kind.has_capital()) {
        add("set label '{{/:Bold*0.9 {}}}' at {} center front boxed\n", kind.letter,
            screen(x + 0.5 * sample, y));
      }
      y = label(lines_of(kind.text, width / kLetter - 5.5), x + 1.25 * sample, y, "") +
          0.15 * kLine;
    }
  }

  void write_bars(const Panel& panel) {
    const Bars& bars = *panel.bars;
    out_ += "\n# Bars\n";
    if (!bars.names.empty()) {
      std::vector<std::string> ticks;
      for (const std::string& name : bars.names) {
        // In a tick, gnuplot reads % as the beginning of a format.
        ticks.push_back(fmt::format("{} {}", gnuplot_text(marked(name, "%", '%')), ticks.size()));
      }
      add("set ytics ({}) noenhanced\nset yrange [{}:-0.7] noreverse\nset grid noytics\n",
          fmt::join(ticks, ", "), static_cast<double>(bars.names.size()) - 0.3);
    }
    const auto data = begin_data();
    for (std::size_t i = 0; i < bars.heights.size(); ++i) {
      const auto at = static_cast<double>(i);
      if (bars.names.empty()) {
        const double from = x_(bars.edges[i]);
        row({from, 0.0, from, x_(bars.edges[i + 1]), panel.y.range.from,
             std::max(bars.heights[i], panel.y.range.from)});
      } else {
        row({0.0, at, std::min(0.0, bars.heights[i]), std::max(0.0, bars.heights[i]), at - 0.36,
             at + 0.36});
      }
    }
    out_ += "EOD\n";
    plot(
        "{} using 1:2:3:4:5:6 with boxxyerror fs solid 1 border lc rgb '#ffffff' lw 0.5 fc rgb "
        "'#0067a5' notitle",
        data);
    if (bars.intervals.empty()) {
      return;
    }
    const auto intervals = begin_data();
    for (std::size_t i = 0; i < bars.intervals.size(); ++i) {
      row({bars.heights[i], static_cast<double>(i), bars.intervals[i].from, bars.intervals[i].to});
    }
    out_ += "EOD\n";
    plot("{} using 1:2:3:4 with xerrorbars pt -1 lw 1.7 lc rgb '#111111' notitle", intervals);
  }

  void write_curves(const Panel& panel) {
    for (const Curve& curve : panel.curves) {
      const bool is_coloured = !curve.colours.empty() && has_colours();
      const auto data = begin_data();
      const std::size_t step = 1 + curve.x.size() / 1000;  // about one point per pixel, and peaks
      for (std::size_t i = 0; i < curve.x.size(); ++i) {
        if (curve.mark == Curve::Mark::kLine && i % step != 0 && i + 1 < curve.x.size() &&
            (curve.y[i] - curve.y[i - 1]) * (curve.y[i + 1] - curve.y[i]) > 0.0) {
          continue;  // neither a peak nor beside a gap
        }
        row({x_(curve.x[i]), y_(curve.y[i])});
        if (is_coloured) {
          out_.back() = ' ';
          row({colour_(curve.colours[i])});
        }
      }
      out_ += "EOD\n";
      plot("{} using 1:2{} with {}{} {}", data, is_coloured ? ":3" : "",
           fmt::format(fmt::runtime(kMarks[static_cast<std::size_t>(curve.mark)]),
                       curve.stroke % kLineStyles + 1),
           is_coloured ? " lc palette dt solid lw 1.1" : "",
           panel.has_key && !is_coloured && !curve.name.empty() ? titled(curve.name) : "notitle");
    }
    if (!panel.spans.empty() && !is_text_ && panel.has_key && !std::exchange(has_span_key_, true)) {
      for (std::size_t kind = 0; kind < kSpanStyles.size(); ++kind) {
        const auto& [name, fill] = kSpanStyles.at(kind);
        if (std::ranges::any_of(panel.spans, [kind](const Span& span) {
              return static_cast<std::size_t>(span.kind) == kind;
            })) {
          plot("keyentry with boxes {} {}", fill, titled(std::string(name)));
        }
      }
    }
  }

  const Figure& figure_;
  const Size size_;
  const bool is_text_;
  const Shown colour_;     // colour scale
  Shown x_{FigureAxis()};  // axes of the panel
  Shown y_{FigureAxis()};
  std::vector<std::string> subtitle_;
  std::vector<std::string> notes_;
  struct {
    double left, bottom, width, height;
  } frame_{};                        // position of the panel, from the upper left corner
  std::vector<std::string> titles_;  // titles in the key of the panel
  bool has_span_key_ = false;        // a panel's key already names the spans
  std::string out_;
  std::vector<std::string> plots_;  // elements of the panel's plot command
  int blocks_ = 0;
};

std::string terminal_command(PictureFormat format, const Size& size) {
  const double scale = format == PictureFormat::kPng   ? 2.0
                       : format == PictureFormat::kPdf ? 1.0 / 72.0
                                                       : 1.0;
  const std::string_view form =
      format == PictureFormat::kSvg ? "svg size {},{} font 'DejaVu Sans,12' background '#ffffff'"
      : format == PictureFormat::kPng
          ? "pngcairo size {},{} font 'DejaVu Sans,18' linewidth 2 pointscale 2 dashlength 2"
          : "pdfcairo size {:.3f}in,{:.3f}in font 'DejaVu Sans,12' linewidth 2 pointscale 0.6 "
            "dashlength 2";
  return fmt::format(fmt::runtime(form), scale * size.width, scale * size.height);
}

}  // namespace

Size own_size(const Figure& figure) {
  const auto rows = static_cast<double>(rows_of(figure));
  Size size{figure.panel_size.width * static_cast<double>(figure.columns),
            figure.panel_size.height * rows};
  const Script script(figure, size, false);
  size.height = std::ceil(size.height + (rows > 1.0 ? script.above() + script.below() : 0.0));
  return size;
}

std::string script_of(const Figure& figure, PictureFormat format, const Size& size,
                      const std::string& file) {
  std::string out = "# A picture made by `oblique plot`, for gnuplot 5.4 or later.\n";
  if (!file.empty()) {
    out += "# Run it with `gnuplot`; for PDF or PNG set the terminal to pdfcairo or pngcairo.\n";
  }
  out += fmt::format("set terminal {}\n", terminal_command(format, size));
  if (!file.empty()) {
    out += fmt::format("set output {}\n", gnuplot_text(file));
  }
  return out + Script(figure, size, false).written();
}

std::string script_for_terminal(const Figure& figure, std::size_t columns, std::size_t lines,
                                bool has_colours) {
  const Size size{kLetter * static_cast<double>(columns), kLine * static_cast<double>(lines)};
  return fmt::format("set terminal dumb {} size {},{} aspect 1\n", has_colours ? "ansi256" : "mono",
                     columns, lines) +
         Script(figure, size, true).written();
}

std::string gnuplot_text(std::string_view text) {
  std::string out = "'";
  for (const char letter : protocol::visible(text)) {
    out += letter == '\'' ? "\u2019" : std::string(1, letter);
  }
  return out + '\'';
}

}  // namespace oblique::client::plot
