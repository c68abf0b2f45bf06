#include "client/plot/gnuplot_script.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/io/format_units.h"
#include "client/plot/cell_areas.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

/// Sizes of texts, in pixels or in characters of a terminal.
struct Metrics {
  double letter;  ///< width of a letter on average, rather too much
  double line;    ///< height of a line
  double title;   ///< height of the title
  double margin;
};
constexpr Metrics kPixels{6.5, 17.0, 22.0, 12.0};
constexpr Metrics kCharacters{1.0, 1.0, 1.0, 1.0};

constexpr std::size_t kStrokes = 8;
// Colours that differ in lightness, dashes and marks, so that lines are told apart in print too.
constexpr std::array<std::string_view, kStrokes> kStrokeStyles{
    "lc rgb '#0067a5' dt solid pt 6",   "lc rgb '#c44e00' dt (9,4) pt 4",
    "lc rgb '#007f5c' dt (2.5,3) pt 8", "lc rgb '#aa3377' dt (10,4,2.5,4) pt 12",
    "lc rgb '#7a6200' dt (18,5) pt 2",  "lc rgb '#332288' dt (5,3,2,3,2,3) pt 1",
    "lc rgb '#666666' dt (2,5) pt 6",   "lc rgb '#111111' dt (14,4,4,4) pt 4"};

// Light enough for hatching and letters in black: the scheme "light" of P. Tol, a brown, and four
// darker ones.
constexpr std::array<std::uint32_t, 12> kFills{0x77aadd, 0xeedd88, 0xee8866, 0x99ddff,
                                               0xbbcc33, 0xffaabb, 0x44bb99, 0xb59a80,
                                               0x5a88b5, 0xc2b25c, 0xc2694b, 0x70b3d1};
constexpr std::array<int, 7> kPatterns{0, 5, 4, 1, 7, 6, 2};  // gnuplot's; 0: none
constexpr std::uint32_t kWhite = 0xffffff;
constexpr std::uint32_t kOther = 0xdddddd;

/// How a category, or a kind of cells without a value, is filled.
struct Fill {
  std::uint32_t colour = kWhite;
  int pattern = 0;
  std::string_view ink = "#4a4f57";  ///< of the pattern
};

Fill fill_of(const Cells& cells, std::size_t category) {
  if (cells.categories[category].is_other) {
    return {kOther, 2, "#8a8f96"};
  }
  return {kFills[category % kFills.size()], kPatterns[category % kPatterns.size()]};
}

/// Cells without a value, by the numbers that the script has for them.
struct Gap {
  CellState state;
  int number;
  Fill fill;
  std::string_view letter;  ///< on a terminal
  std::string_view words;
};
constexpr std::array<Gap, 3> kGaps{{
    {CellState::kNoResult, -1, {kWhite, 5, "#9aa3ad"}, "/", "no result"},
    {CellState::kFiltered, -2, {0xeceff2, 6, "#c3cad2"}, "-", "left out by --where"},
    {CellState::kFailed, -3, {kWhite, 1, "#c01c14"}, "x", "failed"},
}};
constexpr int kBlank = -9;

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.8g}", value) : "NaN";
}

std::string rgb(std::uint32_t colour) {
  return fmt::format("'#{:06x}'", colour);
}

std::string letter_of(std::size_t category) {
  return std::string(1, static_cast<char>('A' + category % 26));
}

/// Lines of at most that many letters, broken at spaces.
std::vector<std::string> wrapped(const std::string& text, double letters) {
  const auto most = static_cast<std::size_t>(std::max(letters, 8.0));
  std::vector<std::string> lines;
  for (const auto word : protocol::split(text, ' ')) {
    if (lines.empty() || lines.back().size() + 1 + word.size() > most) {
      lines.emplace_back(word);
    } else {
      lines.back().append(" ").append(word);
    }
  }
  return lines;
}

/// A text for gnuplot's enhanced mode, which the bold title needs, that shows all letters as they
/// are.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char letter : text) {
    if (std::string_view("\\_^{}@&~").find(letter) != std::string_view::npos) {
      out += '\\';
    }
    out += letter;
  }
  return out;
}

/// A text for a tick, in which % begins a format.
std::string quoted_tick(std::string_view text) {
  std::string doubled;
  for (const char letter : text) {
    doubled += letter == '%' ? "%%" : std::string(1, letter);
  }
  return gnuplot_text(doubled);
}

constexpr std::array<std::uint32_t, 11> kViridis{0x440154, 0x482475, 0x414487, 0x355f8d,
                                                 0x2a788e, 0x21918c, 0x22a884, 0x44bf70,
                                                 0x7ad151, 0xbddf26, 0xfde725};
/// The last colours are lost on white, where lines and points have them.
constexpr std::size_t kLastOnWhite = 7;

std::string palette_of(std::size_t last) {
  std::string out = "set palette defined (";
  for (std::size_t i = 0; i <= last; ++i) {
    out += fmt::format("{}{} {}", i == 0 ? "" : ", ", i, rgb(kViridis[i]));
  }
  return out + ")\n";
}

/// Ticks at 1, 2 and 5 times powers of ten, or at each digit where these are few: gnuplot marks
/// powers of ten alone, of which a short axis may have none.
std::string log_ticks(std::string_view letter, const Range& range) {
  const double decades = std::log10(range.to / range.from);
  if (!(decades <= 3.0)) {
    return fmt::format("set {0}tics autofreq\nset format {0} '10^{{%T}}'\n", letter);
  }
  for (const std::vector<int>& digits :
       {std::vector<int>{1, 2, 5}, std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8, 9}}) {
    std::string ticks;
    int count = 0;
    for (int power = static_cast<int>(std::floor(std::log10(range.from)));
         power <= static_cast<int>(std::floor(std::log10(range.to))); ++power) {
      for (const int digit : digits) {
        const double value = digit * std::pow(10.0, power);
        if (value >= range.from * (1.0 - 1e-9) && value <= range.to * (1.0 + 1e-9)) {
          ticks += fmt::format("{}{}", count++ == 0 ? "" : ", ", number(value));
        }
      }
    }
    if (count >= 3) {
      return fmt::format("set {}tics ({})\n", letter, ticks);
    }
  }
  const double step = std::pow(10.0, std::floor(std::log10(range.to - range.from)));
  return fmt::format("set {}tics {}\n", letter, number(step / 2.0));
}

// Compression is darker than restitution, in grey too; stick is hatched over both.
struct SpanStyle {
  std::string_view name;
  std::string_view fill;
};
constexpr std::array<SpanStyle, 3> kSpanStyles{{
    {"compression", "fs solid 1 noborder fc rgb '#cfe1f3'"},
    {"restitution", "fs solid 1 noborder fc rgb '#fcf3e6'"},
    {"stick", "fs transparent pattern 5 noborder fc rgb '#939da7'"},
}};

/// Which of the cells between edges has the value.
std::size_t cell_at(const std::vector<double>& edges, double value) {
  const auto above = std::upper_bound(edges.begin() + 1, edges.end() - 1, value);
  return static_cast<std::size_t>(above - edges.begin() - 1);
}

/// Pixels that cells of an image need along a side: one each where they are equally wide.
std::size_t pixels_for(const std::vector<double>& edges, const Scale& scale) {
  constexpr std::size_t kOfUneven = 1000;
  const double width = 1.0 / static_cast<double>(edges.size() - 1);
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const double own = scale.share_of(edges[i]) - scale.share_of(edges[i - 1]);
    if (std::abs(own - width) > 1e-3 * width) {
      return kOfUneven;
    }
  }
  return edges.size() - 1;
}

/// What each cell is: a category, a number of kGaps, or nothing to draw.
std::vector<int> numbers_of(const Cells& cells) {
  std::vector<int> numbers(cells.states.size(), kBlank);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (cells.states[i] == CellState::kSolved) {
      numbers[i] = cells.categories.empty() ? kBlank : static_cast<int>(cells.values[i]);
    }
    for (const Gap& gap : kGaps) {
      numbers[i] = cells.states[i] == gap.state ? gap.number : numbers[i];
    }
  }
  return numbers;
}

std::string percentage(std::uint64_t part, std::uint64_t whole) {
  const double share = 100.0 * static_cast<double>(part) / static_cast<double>(whole);
  return share < 0.1 ? "<0.1\u00a0%"
                     : solver::fixed_number(share, share < 10.0 ? 1 : 0) + "\u00a0%";
}

/// Writes the script of one figure.
class ScriptWriter {
 public:
  ScriptWriter(const Figure& figure, Size size, bool is_text)
      : figure_(figure), size_(size), is_text_(is_text), metrics_(is_text ? kCharacters : kPixels) {
    const double letters = (size.width - 2.0 * metrics_.margin) / metrics_.letter;
    if (!figure.subtitle.empty()) {
      subtitle_ = wrapped(figure.subtitle, letters);
    }
    for (const auto& note : figure.notes) {
      const auto lines = wrapped(note, letters);
      notes_.insert(notes_.end(), lines.begin(), lines.end());
    }
    for (const Panel& panel : figure.panels) {
      is_map_ = is_map_ || panel.cells;
      if (panel.cells && panel.cells->categories.empty()) {
        has_gap_legend_ =
            has_gap_legend_ || std::any_of(kGaps.begin(), kGaps.end(), [&panel](const Gap& gap) {
              return panel.cells->count(gap.state) > 0;
            });
      }
    }
  }

  std::string written() {
    write_settings();
    write_texts();
    const bool is_multiplot = figure_.panels.size() > 1;
    out_ += is_multiplot ? "\nset multiplot\n" : "";
    for (std::size_t i = 0; i < figure_.panels.size(); ++i) {
      write_panel(figure_.panels[i], i);
    }
    out_ += is_multiplot ? "unset multiplot\n" : "";
    return std::move(out_);
  }
  /// Height of what is above and below the panels.
  double above() const {
    return metrics_.margin + metrics_.title + metrics_.line * static_cast<double>(subtitle_.size());
  }
  double below() const {
    return metrics_.line * (static_cast<double>(notes_.size()) + (has_gap_legend_ ? 1.5 : 0.0)) +
           metrics_.margin / 2.0 + (is_text_ ? 1.0 : 0.0);
  }

 private:
  /// A text at a place that is counted from the upper left corner.
  void label(const std::string& text, double x, double y, std::string_view more) {
    out_ += fmt::format("set label {} at screen {:.4f}, {:.4f} left{}\n", text, x / size_.width,
                        1.0 - y / size_.height, more);
  }
  /// Begins a block of data and returns its name.
  std::string begin_data() {
    const std::string name = fmt::format("$data{}", ++blocks_);
    out_ += name + " << EOD\n";
    return name;
  }
  void row(std::initializer_list<double> values) {
    const char* separator = "";
    for (const double value : values) {
      out_ += separator + number(value);
      separator = " ";
    }
    out_ += '\n';
  }
  void end_data() { out_ += "EOD\n"; }
  bool has_colours() const { return figure_.colours && !figure_.is_empty; }
  double colour_unit() const { return figure_.colours ? figure_.colours->per_unit : 1.0; }

  void write_settings() {
    out_ +=
        "set encoding utf8\n"
        "set border 15 lc rgb '#556070' lw 1\n"
        "set tics out nomirror textcolor rgb '#1b1f24'\n"
        "set key noenhanced Left reverse samplen 3.2 spacing 1.15\n"
        "set style textbox opaque fillcolor rgb '#ffffff' noborder margins 0.3,0.3\n";
    if (!is_text_) {
      // Nearer to the ticks where the key of a panel follows.
      out_ += fmt::format("set xlabel offset 0,{}\nset cblabel offset 1.2,0\n",
                          figure_.panels.size() > 1 ? "0.35" : "0.4");
    }
    if (!is_map_ && !is_text_) {
      out_ += "set grid back lt 1 lc rgb '#d9dfe6' lw 0.8\n";
    }
    if (!has_colours()) {
      out_ += "unset colorbox\n";
      return;
    }
    const bool is_on_white =
        !is_map_ || figure_.panels.front().cells->count(CellState::kNoPoint) > 0;
    out_ += palette_of(is_on_white ? kLastOnWhite : kViridis.size() - 1);
    write_axis("cb", *figure_.colours);
  }

  void write_texts() {
    out_ += "\n# Title and notes\n";
    const double x = metrics_.margin;
    double y = metrics_.margin + metrics_.title / 2.0;
    const std::string title = gnuplot_text(escaped(protocol::visible(figure_.title)));
    label(is_text_ ? gnuplot_text(figure_.title)
                   : "'{/:Bold*1.25 " + title.substr(1, title.size() - 2) + "}'",
          x, y, is_text_ ? " noenhanced" : "");
    y = metrics_.margin + metrics_.title + metrics_.line / 2.0;
    for (const auto& line : subtitle_) {
      label(gnuplot_text(line), x, y, " noenhanced tc rgb '#555f6b'");
      y += metrics_.line;
    }
    y = size_.height - metrics_.margin / 2.0 -
        metrics_.line * (static_cast<double>(notes_.size()) - 0.5);
    for (const auto& line : notes_) {
      label(gnuplot_text(line), x, y, " noenhanced tc rgb '#555f6b'");
      y += metrics_.line;
    }
  }

  void write_axis(std::string_view letter, const FigureAxis& axis) {
    const Range range{axis.range.from * axis.per_unit, axis.range.to * axis.per_unit};
    out_ += fmt::format("set {}label {} noenhanced\n", letter, gnuplot_text(axis.label));
    if (axis.is_logarithmic) {
      out_ += fmt::format("set logscale {}\n{}", letter, log_ticks(letter, range));
    } else {
      out_ +=
          fmt::format("unset logscale {0}\nset {0}tics autofreq\nset format {0} '% h'\n", letter);
    }
    out_ += fmt::format("set {}range [{}:{}]\n", letter, number(range.from), number(range.to));
  }

  /// Where the panel is in the picture, and its title.
  void write_frame(const Panel& panel, std::size_t index) {
    const std::size_t columns = std::max<std::size_t>(1, figure_.columns);
    const std::size_t rows = (figure_.panels.size() + columns - 1) / columns;
    const double width = 1.0 / static_cast<double>(columns);
    const double bottom = below() / size_.height;
    const double height = (1.0 - bottom - above() / size_.height) /
                          static_cast<double>(std::max<std::size_t>(1, rows));
    const std::size_t row = index / columns;
    const double from_below = static_cast<double>(rows - 1 - row);
    const double top = bottom + height * (from_below + 1.0);
    out_ += fmt::format("set origin {:.4f}, {:.4f}\nset size {} {:.4f}, {:.4f}\n",
                        width * static_cast<double>(index % columns), bottom + height * from_below,
                        panel.has_equal_aspect ? "ratio -1" : "noratio", width, height);
    const double title_height =
        panel.title.empty() ? metrics_.margin : (is_text_ ? 2.0 : 1.6) * metrics_.line;
    out_ += fmt::format("set tmargin at screen {:.4f}\n", top - title_height / size_.height);
    if (!panel.title.empty()) {
      out_ +=
          fmt::format("set label {} at graph 0, graph 1 left offset 0, character {} noenhanced\n",
                      gnuplot_text(panel.title), is_text_ ? "1" : "0.8");
    }
  }

  void write_panel(const Panel& panel, std::size_t index) {
    elements_.clear();
    out_ += figure_.panels.size() == 1 ? "\n# Axes\n" : fmt::format("\n# Panel {}\n", index + 1);
    write_frame(panel, index);
    write_axis("x", panel.x);
    write_axis("y", panel.y);
    // Beside a panel there is room for the key where the picture has one, or where it is narrow.
    const bool is_beside = figure_.panels.size() == 1 || panel.has_equal_aspect;
    out_ += is_text_ || !is_beside ? "set key bmargin left horizontal\n"
                                   : "set key rmargin top vertical\n";
    write_spans(panel);
    if (panel.cells) {
      if (is_text_) {
        write_text_cells(panel);
      }
      panel.cells->categories.empty() ? write_value_cells(panel) : write_category_cells(panel);
    }
    if (panel.bars) {
      write_bars(panel);
    }
    if (panel.dots) {
      write_dots(panel);
    }
    write_curves(panel);
    if (elements_.empty()) {
      elements_.emplace_back("NaN notitle");
    }
    out_ += "plot ";
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      out_ += (i == 0 ? "" : ", \\\n     ") + elements_[i];
    }
    out_ += "\n";
    if (figure_.panels.size() > 1) {
      out_ += "unset label\nunset object\n";
    }
  }

  void write_spans(const Panel& panel) {
    if (is_text_) {
      return;
    }
    for (const Span& span : panel.spans) {
      out_ += fmt::format("set object rectangle from {}, graph 0 to {}, graph 1 behind {}\n",
                          number(span.from * panel.x.per_unit), number(span.to * panel.x.per_unit),
                          kSpanStyles[static_cast<std::size_t>(span.kind)].fill);
    }
  }

  /// Rows of x, y, x0, x1, y0, y1, number and colour, one for neighbours in a row with one number.
  void write_rectangles(const Panel& panel, const std::vector<int>& numbers) {
    const Cells& cells = *panel.cells;
    const double ux = panel.x.per_unit;
    const double uy = panel.y.per_unit;
    for (std::size_t y = 0; y < cells.rows(); ++y) {
      for (std::size_t begin = 0, x = 0; x < cells.columns(); begin = x) {
        const int kind = numbers[y * cells.columns() + x];
        while (x < cells.columns() && numbers[y * cells.columns() + x] == kind) {
          ++x;
        }
        if (kind == kBlank) {
          continue;
        }
        const Fill fill = kind >= 0 ? fill_of(cells, static_cast<std::size_t>(kind))
                                    : kGaps[static_cast<std::size_t>(-kind - 1)].fill;
        const double x0 = ux * cells.x_edges[begin];
        const double x1 = ux * cells.x_edges[x];
        const double y0 = uy * cells.y_edges[y];
        const double y1 = uy * cells.y_edges[y + 1];
        row({x0, y0, x0, x1, y0, y1, static_cast<double>(kind), static_cast<double>(fill.colour)});
      }
    }
  }

  /// Hatches the rectangles of that data.
  void write_patterns(const Cells& cells, const std::string& data, bool with_categories) {
    const auto hatch = [&](int kind, const Fill& fill) {
      if (fill.pattern != 0) {
        elements_.push_back(fmt::format(
            "{} using ($7=={}?$1:NaN):2:3:4:5:6 with boxxyerror fs transparent pattern {} noborder "
            "fc rgb '{}' notitle",
            data, kind, fill.pattern, fill.ink));
      }
    };
    for (std::size_t i = 0; with_categories && i < cells.categories.size(); ++i) {
      hatch(static_cast<int>(i), fill_of(cells, i));
    }
    for (const Gap& gap : kGaps) {
      if (cells.count(gap.state) > 0) {
        hatch(gap.number, gap.fill);
      }
    }
  }

  /// A terminal fills no rectangles: a map is made of letters there, for categories their own, for
  /// values from light to dark.
  void write_text_cells(const Panel& panel) {
    const Cells& cells = *panel.cells;
    if (cells.values.empty()) {
      return;
    }
    constexpr std::string_view kLightToDark = ".:-=+*%#@";
    const auto numbers = numbers_of(cells);
    const Scale x_scale(panel.x.range, panel.x.is_logarithmic);
    const Scale y_scale(panel.y.range, panel.y.is_logarithmic);
    const Scale colours = figure_.colours
                              ? Scale(figure_.colours->range, figure_.colours->is_logarithmic)
                              : Scale({0, 1});
    const auto data = begin_data();
    // More letters than the panel has room for: some are written over others.
    for (double line = 0.5; line < size_.height; ++line) {
      for (double column = 0.5; column < size_.width; ++column) {
        const double x = x_scale.value_at(column / size_.width);
        const double y = y_scale.value_at(line / size_.height);
        const std::size_t cell =
            cell_at(cells.y_edges, y) * cells.columns() + cell_at(cells.x_edges, x);
        std::string letter(" ");
        std::uint32_t colour = 0x808080;
        for (const Gap& gap : kGaps) {
          letter = cells.states[cell] == gap.state ? gap.letter : letter;
        }
        if (numbers[cell] >= 0) {
          const auto category = static_cast<std::size_t>(numbers[cell]);
          letter = cells.categories[category].is_other ? "*" : letter_of(category);
          colour = fill_of(cells, category).colour;
        } else if (cells.states[cell] == CellState::kSolved) {
          const double share = std::clamp(colours.share_of(cells.values[cell]), 0.0, 1.0);
          letter = kLightToDark[static_cast<std::size_t>(share * 8.999)];
          colour = kViridis[static_cast<std::size_t>(share * 10.0 + 0.5)];
        }
        out_ += fmt::format("{} {} \"{}\" {}\n", number(x * panel.x.per_unit),
                            number(y * panel.y.per_unit), letter, colour);
      }
    }
    end_data();
    elements_.push_back(data + " using 1:2:3:4 with labels tc rgb variable notitle");
  }

  void write_value_rectangles(const Panel& panel) {
    const Cells& cells = *panel.cells;
    const auto data = begin_data();
    for (std::size_t i = 0; i < cells.values.size(); ++i) {
      if (cells.states[i] == CellState::kSolved) {
        const std::size_t column = i % cells.columns();
        const std::size_t line = i / cells.columns();
        const double x0 = panel.x.per_unit * cells.x_edges[column];
        const double y0 = panel.y.per_unit * cells.y_edges[line];
        row({x0, y0, x0, panel.x.per_unit * cells.x_edges[column + 1], y0,
             panel.y.per_unit * cells.y_edges[line + 1], cells.values[i] * colour_unit()});
      }
    }
    end_data();
    // The border closes the seams that viewers leave between rectangles.
    elements_.push_back(
        data + " using 1:2:3:4:5:6:7 with boxxyerror fs solid 1 lc palette lw 0.3 notitle");
  }

  /// On axes of its own, from 0 to 1: an image needs linear ones.
  void write_image(const Panel& panel) {
    const Cells& cells = *panel.cells;
    const Scale x_scale(panel.x.range, panel.x.is_logarithmic);
    const Scale y_scale(panel.y.range, panel.y.is_logarithmic);
    const std::size_t width = pixels_for(cells.x_edges, x_scale);
    const std::size_t height = pixels_for(cells.y_edges, y_scale);
    out_ += "set x2range [0:1]\nset y2range [0:1]\n";
    const auto data = begin_data();
    for (std::size_t i = 0; i < width * height; ++i) {
      const std::size_t row_of_image = i / width;
      const double x = (static_cast<double>(i % width) + 0.5) / static_cast<double>(width);
      const double y = (static_cast<double>(row_of_image) + 0.5) / static_cast<double>(height);
      const std::size_t cell = cell_at(cells.y_edges, y_scale.value_at(y)) * cells.columns() +
                               cell_at(cells.x_edges, x_scale.value_at(x));
      const bool is_solved = cells.states[cell] == CellState::kSolved;
      row({x, y, is_solved ? cells.values[cell] * colour_unit() : std::nan("")});
    }
    end_data();
    elements_.push_back(data + " using 1:2:3 axes x2y2 with image notitle");
  }

  void write_value_cells(const Panel& panel) {
    const Cells& cells = *panel.cells;
    if (has_gap_legend_) {
      write_legend_below(cells);
    }
    if (cells.values.empty() || is_text_) {
      return;
    }
    out_ += "\n# Values of cells\n";
    // Rectangles have sharp edges in every viewer, and an image is small.
    constexpr std::size_t kMostRectangles = 20'000;
    cells.values.size() > kMostRectangles ? write_image(panel) : write_value_rectangles(panel);
    if (has_gap_legend_) {
      out_ += "# Cells without a value: not solved -1, left out -2, failed -3\n";
      const auto gaps = begin_data();
      write_rectangles(panel, numbers_of(cells));
      end_data();
      elements_.push_back(
          gaps +
          " using 1:2:3:4:5:6:8 with boxxyerror fs solid 1 noborder lc rgb variable "
          "notitle");
      write_patterns(cells, gaps, false);
    }
  }

  void write_category_cells(const Panel& panel) {
    const Cells& cells = *panel.cells;
    if (!is_text_) {
      const auto numbers = numbers_of(cells);
      out_ += "\n# Cells: x y x0 x1 y0 y1 category colour\n";
      const auto data = begin_data();
      write_rectangles(panel, numbers);
      end_data();
      elements_.push_back(
          data + " using 1:2:3:4:5:6:8 with boxxyerror fs solid 1 lc rgb variable lw 0.3 notitle");
      // A picture has room beside the map, so a cell is smaller than its share of the whole.
      const CellAreas areas = areas_of(numbers, cells.columns(),
                                       0.65 * size_.width / static_cast<double>(cells.columns()),
                                       0.65 * size_.height / static_cast<double>(cells.rows()));
      const bool is_outlined = areas.areas.size() <= kMostOutlinedAreas;
      write_patterns(cells, data, is_outlined);
      if (is_outlined) {
        write_borders(panel, areas);
        write_letters(panel, areas);
      }
    }
    write_legend_beside(cells);
  }

  /// Lines between areas, one piece for neighbours.
  void write_borders(const Panel& panel, const CellAreas& areas) {
    const Cells& cells = *panel.cells;
    const std::size_t columns = cells.columns();
    const std::size_t rows = cells.rows();
    const auto differ = [&](std::size_t a, std::size_t b) {
      return areas.of_cells[a] != areas.of_cells[b] && areas.of_cells[a] != CellAreas::kNone &&
             areas.of_cells[b] != CellAreas::kNone;
    };
    out_ += "# Lines between areas\n";
    const auto data = begin_data();
    // Along x the line below row y, along y the line left of column x.
    const auto write_lines = [&](std::size_t lines, std::size_t length, bool is_along_x) {
      for (std::size_t line = 1; line < lines; ++line) {
        for (std::size_t at = 0; at < length; ++at) {
          const std::size_t begin = at;
          while (at < length &&
                 (is_along_x ? differ(line * columns + at, (line - 1) * columns + at)
                             : differ(at * columns + line, at * columns + line - 1))) {
            ++at;
          }
          for (const std::size_t end : {begin, at}) {
            if (at > begin) {
              row({panel.x.per_unit * cells.x_edges[is_along_x ? end : line],
                   panel.y.per_unit * cells.y_edges[is_along_x ? line : end]});
            }
          }
          out_ += at > begin ? "\n" : "";
        }
      }
    };
    write_lines(rows, columns, true);
    write_lines(columns, rows, false);
    end_data();
    elements_.push_back(data + " using 1:2 with lines lc rgb '#202428' lw 1 dt solid notitle");
  }

  /// A letter in each area that has room for it.
  void write_letters(const Panel& panel, const CellAreas& areas) {
    const Cells& cells = *panel.cells;
    const auto place = [](const std::vector<double>& edges, double at, bool is_logarithmic) {
      const auto below = std::min(static_cast<std::size_t>(at), edges.size() - 2);
      const Scale scale({edges[below], edges[below + 1]}, is_logarithmic);
      return scale.value_at(at - static_cast<double>(below));
    };
    for (const CellArea& area : areas.areas) {
      if (area.room <= 2.3 * metrics_.letter ||
          cells.categories[static_cast<std::size_t>(area.category)].is_other) {
        continue;
      }
      const std::string letter = letter_of(static_cast<std::size_t>(area.category));
      out_ += fmt::format(
          "set label '{{/:Bold {}}}' at {}, {} center front boxed\n", letter,
          number(panel.x.per_unit * place(cells.x_edges, area.x, panel.x.is_logarithmic)),
          number(panel.y.per_unit * place(cells.y_edges, area.y, panel.y.is_logarithmic)));
    }
  }

  struct Entry {
    Fill fill;
    std::string letter;
    std::string text;
  };
  /// The legend of a map: its categories with their percentages, and cells without a value.
  std::vector<Entry> legend_of(const Cells& cells) const {
    std::vector<Entry> entries;
    std::uint64_t whole = 0;
    for (const Category& category : cells.categories) {
      whole += category.points;
    }
    for (std::size_t i = 0; i < cells.categories.size(); ++i) {
      const Category& category = cells.categories[i];
      entries.push_back({fill_of(cells, i),
                         !category.is_other ? letter_of(i)
                         : is_text_         ? "*"
                                            : "",
                         fmt::format("{} ({})", protocol::visible(category.name),
                                     percentage(category.points, whole))});
    }
    for (const Gap& gap : kGaps) {
      if (const auto count = cells.count(gap.state); count > 0) {
        entries.push_back({gap.fill, is_text_ ? std::string(gap.letter) : "",
                           fmt::format("{} ({})", gap.words, format_count(count))});
      }
    }
    return entries;
  }

  void write_entry(const Entry& entry, const std::vector<std::string>& lines, double x, double y) {
    const Fill& fill = entry.fill;
    const double width = (is_text_ ? 3.0 : 5.5) * metrics_.letter;
    if (is_text_) {
      label(gnuplot_text(entry.letter), x, y,
            fmt::format(" noenhanced tc rgb {}",
                        rgb(fill.colour == kWhite ? 0x909090 : fill.colour)));
    } else {
      const std::string place =
          fmt::format("set object rectangle from screen {:.4f}, {:.4f} to screen {:.4f}, {:.4f}",
                      x / size_.width, 1.0 - (y + 6.5) / size_.height,
                      (x + 0.8 * width) / size_.width, 1.0 - (y - 6.5) / size_.height);
      out_ +=
          fmt::format("{} fs solid 1 border lc rgb '#556070' fc rgb {}\n", place, rgb(fill.colour));
      if (fill.pattern != 0) {
        out_ += fmt::format("{} fs transparent pattern {} border lc rgb '#556070' fc rgb '{}'\n",
                            place, fill.pattern, fill.ink);
      }
      if (!entry.letter.empty()) {
        out_ += fmt::format(
            "set label '{{/:Bold*0.9 {}}}' at screen {:.4f}, {:.4f} center front boxed\n",
            entry.letter, (x + 0.4 * width) / size_.width, 1.0 - y / size_.height);
      }
    }
    for (const auto& line : lines) {
      label(gnuplot_text(line), x + width, y, " noenhanced");
      y += metrics_.line;
    }
  }

  void write_legend_beside(const Cells& cells) {
    out_ += "# Legend\n";
    const auto entries = legend_of(cells);
    double longest = 0.0;
    for (const Entry& entry : entries) {
      longest = std::max(longest, metrics_.letter * static_cast<double>(entry.text.size()));
    }
    const double width = std::min(0.36 * size_.width, longest) + 7.0 * metrics_.letter;
    out_ += fmt::format("set rmargin at screen {:.4f}\n",
                        1.0 - (width + metrics_.margin) / size_.width);
    double y = above() + metrics_.margin + metrics_.line / 2.0;
    for (const Entry& entry : entries) {
      const auto lines = wrapped(entry.text, width / metrics_.letter - 5.5);
      write_entry(entry, lines, size_.width - width, y);
      y += metrics_.line * (static_cast<double>(lines.size()) + (is_text_ ? 0.0 : 0.15));
    }
  }

  void write_legend_below(const Cells& cells) {
    out_ += "# Legend\n";
    double x = metrics_.margin;
    for (const Entry& entry : legend_of(cells)) {
      write_entry(entry, {entry.text}, x, size_.height - below() + metrics_.line * 0.6);
      x += metrics_.letter * static_cast<double>(entry.text.size() + 8);
    }
  }

  void write_bars(const Panel& panel) {
    const Bars& bars = *panel.bars;
    out_ += "\n# Bars\n";
    if (!bars.names.empty()) {
      std::string ticks;
      for (std::size_t i = 0; i < bars.names.size(); ++i) {
        ticks += fmt::format("{}{} {}", i == 0 ? "" : ", ", quoted_tick(bars.names[i]), i);
      }
      out_ += fmt::format(
          "set ytics ({}) noenhanced\nset yrange [{}:-0.7] noreverse\nset grid noytics\n", ticks,
          static_cast<double>(bars.names.size()) - 0.3);
    }
    const auto data = begin_data();
    for (std::size_t i = 0; i < bars.heights.size(); ++i) {
      const auto at = static_cast<double>(i);
      if (bars.names.empty()) {
        const double from = bars.edges[i] * panel.x.per_unit;
        row({from, 0.0, from, bars.edges[i + 1] * panel.x.per_unit, panel.y.range.from,
             std::max(bars.heights[i], panel.y.range.from)});
      } else {
        row({0.0, at, 0.0, bars.heights[i], at - 0.36, at + 0.36});
      }
    }
    end_data();
    elements_.push_back(
        data +
        " using 1:2:3:4:5:6 with boxxyerror fs solid 1 border lc rgb '#ffffff' lw 0.5 "
        "fc rgb '#0067a5' notitle");
  }

  void write_dots(const Panel& panel) {
    const Dots& dots = *panel.dots;
    out_ += "\n# Points\n";
    const auto data = begin_data();
    for (std::size_t i = 0; i < dots.x.size(); ++i) {
      const double shade = dots.shades.empty() ? 0.0 : dots.shades[i];
      if (std::isfinite(dots.x[i]) && std::isfinite(dots.y[i]) && std::isfinite(shade)) {
        row({dots.x[i] * panel.x.per_unit, dots.y[i] * panel.y.per_unit, shade * colour_unit()});
      }
    }
    end_data();
    const double size = dots.x.size() > 1000 ? 0.25 : 0.4;
    elements_.push_back(fmt::format("{} using 1:2:3 with points pt 7 ps {} {} notitle", data, size,
                                    has_colours() ? "lc palette" : "lc rgb '#0067a5'"));
  }

  void write_curves(const Panel& panel) {
    // Of points closer than about a pixel one is enough.
    const double pixels = 0.7 * size_.width / static_cast<double>(figure_.columns);
    const double pixel_x = (panel.x.range.to - panel.x.range.from) / pixels;
    const double pixel_y = (panel.y.range.to - panel.y.range.from) / pixels;
    const bool is_linear = !panel.x.is_logarithmic && !panel.y.is_logarithmic;
    const bool are_coloured = !panel.curves.empty() && panel.curves.front().is_coloured_by;
    std::string data;
    for (const Curve& curve : panel.curves) {
      if (!are_coloured || data.empty()) {
        data = begin_data();
      }
      std::size_t last = 0;
      for (std::size_t i = 0; i < curve.x.size(); ++i) {
        const bool is_near = is_linear && !curve.has_marks && i > 0 && i + 1 < curve.x.size() &&
                             std::abs(curve.x[i] - curve.x[last]) < pixel_x &&
                             std::abs(curve.y[i] - curve.y[last]) < pixel_y;
        if (!is_near) {
          row({curve.x[i] * panel.x.per_unit, curve.y[i] * panel.y.per_unit,
               curve.by.value_or(0.0) * colour_unit()});
          last = i;
        }
      }
      if (are_coloured) {
        out_ += '\n';
        continue;
      }
      end_data();
      const bool is_named = panel.has_key && !curve.name.empty();
      elements_.push_back(fmt::format("{} using 1:2 with {} {} lw 1.7 ps 0.7 {}", data,
                                      curve.has_marks ? "linespoints" : "lines",
                                      kStrokeStyles[curve.stroke % kStrokes],
                                      is_named ? "title " + gnuplot_text(curve.name) : "notitle"));
    }
    if (are_coloured) {
      end_data();
      elements_.push_back(data + " using 1:2:3 with lines lc palette lw 1.1 notitle");
    }
    if (!panel.known.empty()) {
      data = begin_data();
      for (const KnownPoint& known : panel.known) {
        row({known.x * panel.x.per_unit, known.y * panel.y.per_unit});
      }
      end_data();
      elements_.push_back(data + " using 1:2 with points pt 13 ps 1.1 lc rgb '#ffffff' notitle");
      elements_.push_back(
          data + " using 1:2 with points pt 12 ps 1.0 lw 1.5 lc rgb '#111111' " +
          (panel.has_key ? "title " + gnuplot_text(panel.known.front().name) : "notitle"));
    }
    if (is_text_ || !panel.has_key || has_span_key_) {
      return;
    }
    for (std::size_t kind = 0; kind < kSpanStyles.size(); ++kind) {
      const bool is_met = std::any_of(
          panel.spans.begin(), panel.spans.end(),
          [kind](const Span& span) { return static_cast<std::size_t>(span.kind) == kind; });
      if (is_met) {
        has_span_key_ = true;
        elements_.push_back(fmt::format("keyentry with boxes {} title {}", kSpanStyles[kind].fill,
                                        gnuplot_text(kSpanStyles[kind].name)));
      }
    }
  }

  const Figure& figure_;
  Size size_;
  bool is_text_;
  Metrics metrics_;
  std::vector<std::string> subtitle_;
  std::vector<std::string> notes_;
  bool is_map_ = false;
  bool has_gap_legend_ = false;
  bool has_span_key_ = false;  // spans are named in the key of one panel
  std::string out_;
  std::vector<std::string> elements_;  ///< of the plot command of the panel
  int blocks_ = 0;
};

std::string terminal_command(Terminal terminal, const Size& size) {
  switch (terminal) {
    case Terminal::kPdf:
      return fmt::format(
          "pdfcairo size {:.3f}in,{:.3f}in font 'DejaVu Sans,12' fontscale 1 "
          "linewidth 2 pointscale 0.6 dashlength 2",
          size.width / 72.0, size.height / 72.0);
    case Terminal::kPng:
      return fmt::format(
          "pngcairo size {},{} font 'DejaVu Sans,18' linewidth 2 "
          "pointscale 2 dashlength 2",
          2.0 * size.width, 2.0 * size.height);
    case Terminal::kSvg:
      break;
  }
  return fmt::format("svg size {},{} font 'DejaVu Sans,12' background '#ffffff'", size.width,
                     size.height);
}

}  // namespace

Size own_size(const Figure& figure) {
  const std::size_t columns = std::max<std::size_t>(1, figure.columns);
  const std::size_t rows = std::max<std::size_t>(1, (figure.panels.size() + columns - 1) / columns);
  Size size{figure.panel_size.width * static_cast<double>(columns),
            figure.panel_size.height * static_cast<double>(rows)};
  const ScriptWriter writer(figure, size, false);
  size.height = std::ceil(size.height + (rows > 1 ? writer.above() + writer.below() : 0.0));
  return size;
}

std::string script_of(const Figure& figure, Terminal terminal, const Size& size,
                      const std::string& file) {
  std::string out = "# A picture by `oblique plot`, for gnuplot 5.4 or later.\n";
  if (!file.empty()) {
    out += "# Run it with `gnuplot`; for PDF or PNG set terminal pdfcairo or pngcairo instead.\n";
  }
  out += fmt::format("set terminal {}\n", terminal_command(terminal, size));
  if (!file.empty()) {
    out += fmt::format("set output {}\n", gnuplot_text(file));
  }
  return out + ScriptWriter(figure, size, false).written();
}

std::string script_for_terminal(const Figure& figure, std::size_t columns, std::size_t lines,
                                bool has_colours) {
  const Size size{static_cast<double>(columns), static_cast<double>(lines)};
  return fmt::format("set terminal dumb {} size {},{} aspect 1\n", has_colours ? "ansi256" : "mono",
                     columns, lines) +
         ScriptWriter(figure, size, true).written();
}

std::string gnuplot_text(std::string_view text) {
  std::string out = "'";
  for (const char letter : protocol::visible(std::string(text))) {
    out += letter == '\'' ? "\u2019" : std::string(1, letter);
  }
  return out + '\'';
}

}  // namespace oblique::client::plot
