#include "client/plot/figures/legend.h"

#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/plot/draw/text_width.h"
#include "client/plot/draw/theme.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

using Sign = LegendEntry::Sign;

constexpr double kSignWidth = 26.0;
constexpr double kRowHeight = 17.0;
constexpr double kLineHeight = 13.5;  // of a name's second line
constexpr double kBetween = 18.0;     // columns

bool has(const std::vector<LegendEntry>& entries, Sign sign, const std::string& name) {
  return std::any_of(entries.begin(), entries.end(), [&](const LegendEntry& entry) {
    return entry.sign == sign && entry.name == name;
  });
}

std::string percentage(std::uint64_t part, std::uint64_t whole) {
  const double share = 100.0 * static_cast<double>(part) / static_cast<double>(whole);
  return share < 0.1 ? "<0.1 %" : solver::fixed_number(share, share < 10.0 ? 1 : 0) + " %";
}

void add_kinds(std::vector<LegendEntry>& entries, const KindCells& kinds) {
  std::uint64_t whole = 0;
  for (const Kind& kind : kinds.kinds) {
    whole += kind.points;
  }
  for (std::size_t i = 0; i < kinds.kinds.size(); ++i) {
    const Kind& kind = kinds.kinds[i];
    const auto share = percentage(kind.points, whole);
    entries.push_back({.sign = kind.is_rest ? Sign::kRest : Sign::kKind,
                       .number = i,
                       .is_hatched = kinds.least_outlined > 0,
                       .name = fmt::format("{} ({})", kind.name, share)});
  }
}

double width_of_names(const LegendLayout::Place& place) {
  double width = 0.0;
  for (const auto& line : place.lines) {
    width = std::max(width, text_width(line, kSmallSize));
  }
  return width;
}

double height_of(const LegendLayout::Place& place) {
  const auto more = place.lines.empty() ? 0 : place.lines.size() - 1;
  return kRowHeight + kLineHeight * static_cast<double>(more);
}

void draw_area_sign(SvgWriter& svg, const LegendEntry& entry, double x, double y) {
  const double width = kSignWidth - 6.0;
  constexpr double kHeight = 12.0;
  const auto rectangle = [&](const auto& filling) {
    svg.element(
        "rect",
        {{"x", x}, {"y", y - 6.0}, {"width", width}, {"height", kHeight}, {"fill", filling}});
  };
  if (entry.sign == Sign::kKind || entry.sign == Sign::kRest) {
    const Fill filling = entry.sign == Sign::kRest ? kFillOfOthers : fill(entry.number);
    rectangle(hexadecimal(
        entry.is_hatched || entry.sign == Sign::kRest ? filling.colour : plain_fill(entry.number)));
    if (entry.is_hatched && filling.hatch != Hatch::kNone) {
      rectangle(OwnLink{hatch_id(filling.hatch)});
    }
  } else {
    rectangle(OwnLink{entry.sign == Sign::kFailed     ? "failed"
                      : entry.sign == Sign::kFiltered ? "filtered"
                                                      : "missing"});
  }
  svg.rectangle(x, y - 6.0, width, kHeight, "frame");
  if (entry.sign == Sign::kKind && entry.is_hatched) {
    svg.text(x + width / 2.0, y + 4.0, "letter small", "middle", letter_of(entry.number));
  }
}

void draw_sign(SvgWriter& svg, const LegendEntry& entry, double x, double y) {
  const double width = kSignWidth - 4.0;
  switch (entry.sign) {
    case Sign::kCurve:
      if (entry.has_line) {
        svg.line(x, y, x + width, y, fmt::format("line s{}", entry.number % kStrokes));
      }
      if (entry.has_marks) {
        svg.path(mark_path(stroke(entry.number).mark, x + width / 2.0, y, 3.2),
                 fmt::format("mark m{}", entry.number % kStrokes));
      }
      break;
    case Sign::kSpan:
      svg.rectangle(x, y - 6.0, width - 2.0, 12.0, fmt::format("p{}", entry.number % kSpanKinds));
      svg.rectangle(x, y - 6.0, width - 2.0, 12.0, "frame");
      break;
    case Sign::kKnown:
      svg.path(mark_path(Mark::kDiamond, x + width / 2.0, y, 4.5), "known");
      break;
    default:
      draw_area_sign(svg, entry, x, y);
  }
}

}  // namespace

std::vector<LegendEntry> legend_of(const Figure& figure) {
  std::vector<LegendEntry> entries;
  const auto add_once = [&entries](LegendEntry entry) {
    if (!entry.name.empty() && !has(entries, entry.sign, entry.name)) {
      entries.push_back(std::move(entry));
    }
  };
  for (const Panel& panel : figure.panels) {
    for (const Curve& curve : panel.curves) {
      if (!curve.shade) {
        add_once({.sign = Sign::kCurve,
                  .number = curve.stroke,
                  .has_line = curve.has_line,
                  .has_marks = curve.has_marks,
                  .name = curve.name});
      }
    }
    for (const Span& span : panel.spans) {
      add_once({.sign = Sign::kSpan, .number = span.kind, .name = span.name});
    }
    for (const KnownPoint& known : panel.known) {
      add_once({.sign = Sign::kKnown, .name = known.name});
    }
    if (panel.kinds) {
      add_kinds(entries, *panel.kinds);
    }
  }
  if (figure.gaps.no_result > 0) {
    entries.push_back({.sign = Sign::kNoResult,
                       .name = fmt::format("no result ({})", shown_count(figure.gaps.no_result))});
  }
  if (figure.gaps.filtered > 0) {
    entries.push_back(
        {.sign = Sign::kFiltered,
         .name = fmt::format("left out by --where ({})", shown_count(figure.gaps.filtered))});
  }
  if (figure.gaps.failed > 0) {
    entries.push_back({.sign = Sign::kFailed,
                       .name = fmt::format("failed ({})", shown_count(figure.gaps.failed))});
  }
  return entries;
}

std::string letter_of(std::size_t kind) {
  constexpr std::size_t kLetters = 26;
  std::string letters(1, static_cast<char>('A' + kind % kLetters));
  return kind < kLetters ? letters : letter_of(kind / kLetters - 1) + letters;
}

LegendLayout laid_out_beside(const std::vector<LegendEntry>& entries, double most_width) {
  LegendLayout layout;
  for (const LegendEntry& entry : entries) {
    layout.places.push_back(
        {0.0, layout.height, lines_of(entry.name, kSmallSize, most_width - kSignWidth)});
    layout.height += height_of(layout.places.back());
    layout.width = std::max(layout.width, kSignWidth + width_of_names(layout.places.back()));
  }
  return layout;
}

LegendLayout laid_out_below(const std::vector<LegendEntry>& entries, double width) {
  // As many columns as the widest name allows, filled row by row.
  const LegendLayout beside = laid_out_beside(entries, width);
  const auto columns = std::max<std::size_t>(
      1, static_cast<std::size_t>((width + kBetween) / (beside.width + kBetween)));
  LegendLayout layout = beside;
  layout.width = width;
  double y = 0.0;
  for (std::size_t i = 0; i < entries.size(); i += columns) {
    double height = 0.0;
    for (std::size_t k = i; k < std::min(i + columns, entries.size()); ++k) {
      layout.places[k].x = static_cast<double>(k - i) * (beside.width + kBetween);
      layout.places[k].y = y;
      height = std::max(height, height_of(layout.places[k]));
    }
    y += height;
  }
  layout.height = y;
  return layout;
}

void draw_legend(SvgWriter& svg, const std::vector<LegendEntry>& entries,
                 const LegendLayout& layout, double x, double y) {
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto& place = layout.places[i];
    const double left = x + place.x;
    double middle = y + place.y + kRowHeight / 2.0;
    draw_sign(svg, entries[i], left, middle);
    for (const auto& line : place.lines) {
      svg.text(left + kSignWidth, middle + 4.0, "small", "start", line);
      middle += kLineHeight;
    }
  }
}

std::string mark_path(Mark mark, double x, double y, double radius) {
  PathData path;
  const double r = radius;
  const auto polygon = [&path](std::initializer_list<std::pair<double, double>> corners) {
    bool is_first = true;
    for (const auto& [px, py] : corners) {
      if (is_first) {
        path.move_to(px, py);
      } else {
        path.line_to(px, py);
      }
      is_first = false;
    }
  };
  switch (mark) {
    case Mark::kDisc:
      return fmt::format("M{0} {1}a{2} {2} 0 1 0 {3} 0a{2} {2} 0 1 0-{3} 0Z", svg_number(x - r),
                         svg_number(y), svg_number(r), svg_number(2.0 * r));
    case Mark::kSquare:
      polygon({{x - r, y - r}, {x + r, y - r}, {x + r, y + r}, {x - r, y + r}});
      break;
    case Mark::kTriangle:
      polygon({{x, y - r}, {x + r, y + r}, {x - r, y + r}});
      break;
    case Mark::kDiamond:
      polygon({{x, y - r}, {x + r, y}, {x, y + r}, {x - r, y}});
      break;
    case Mark::kCross:
      polygon({{x - r, y - r}, {x + r, y + r}});
      polygon({{x - r, y + r}, {x + r, y - r}});
      return path.text();
    case Mark::kPlus:
      polygon({{x - r, y}, {x + r, y}});
      polygon({{x, y - r}, {x, y + r}});
      return path.text();
  }
  path.close();
  return path.text();
}

}  // namespace oblique::client::plot
