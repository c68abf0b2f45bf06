// Maps of kinds: colours of cells, and over them hatching, boundaries and letters of areas.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "client/plot/draw/areas.h"
#include "client/plot/draw/theme.h"
#include "client/plot/figures/svg_cells.h"

namespace oblique::client::plot {
namespace {

Fill fill_of(const KindCells& map, std::size_t kind) {
  return map.kinds[kind].is_rest ? kFillOfOthers : fill(kind);
}

Colour colour_of(const KindCells& map, std::size_t kind) {
  const bool is_hatched = map.least_outlined > 0;
  return is_hatched || map.kinds[kind].is_rest ? fill_of(map, kind).colour : plain_fill(kind);
}

/// Hatches areas and draws lines between them.
void draw_areas(SvgWriter& svg, const KindCells& map, const KindGrid& grid, const Places& places) {
  for (std::size_t i = 0; i < map.kinds.size(); ++i) {
    const Hatch hatch = fill_of(map, i).hatch;
    if (hatch != Hatch::kNone) {
      fill_path(svg, path_of(outlines_of(grid, static_cast<int>(i)), map.cells, places, true),
                hatch_id(hatch));
    }
  }
  svg.path(path_of(boundaries_of(grid), map.cells, places, false), "boundary");
}

/// A square of cells in the picture.
Box box_of(const Area& area, const Cells& cells, const Places& places) {
  const auto at = [](const std::vector<double>& edges, double corner, const auto& place) {
    const auto whole = static_cast<std::size_t>(corner);
    const double from = place(edges[whole]);
    return corner > static_cast<double>(whole) ? 0.5 * (from + place(edges[whole + 1])) : from;
  };
  const auto x = [&](double corner) {
    return at(cells.x_edges, corner, [&](double value) { return places.x(value); });
  };
  const auto y = [&](double corner) {
    return at(cells.y_edges, corner, [&](double value) { return places.y(value); });
  };
  const double half = static_cast<double>(area.side) / 2.0;
  const double left = x(area.x - half);
  const double above = y(area.y + half);
  return {left, above, x(area.x + half) - left, y(area.y - half) - above};
}

/// Writes letters into areas where there is room: into the largest of each kind, and into others
/// that are seen by themselves.
void draw_letters(SvgWriter& svg, const KindCells& map, const KindGrid& grid,
                  const Places& places) {
  constexpr double kRoomForLetter = 10.5;
  constexpr double kRoomForAnother = 14.0;
  constexpr std::size_t kMostLetters = 60;
  std::vector<Area> areas = areas_of(grid).areas;
  std::stable_sort(areas.begin(), areas.end(),
                   [](const Area& a, const Area& b) { return a.side > b.side; });
  std::vector<bool> has_letter(map.kinds.size(), false);
  std::size_t letters = 0;
  for (const Area& area : areas) {
    const auto kind = static_cast<std::size_t>(area.kind);
    const Box box = box_of(area, map.cells, places);
    const double room = std::min(box.width, box.height);
    if (map.kinds[kind].is_rest || letters == kMostLetters ||
        room < (has_letter[kind] ? kRoomForAnother : kRoomForLetter)) {
      continue;
    }
    svg.text(box.x + box.width / 2.0, box.y + box.height / 2.0 + 4.5, "letter", "middle",
             letter_of(kind));
    has_letter[kind] = true;
    ++letters;
  }
}

}  // namespace

void draw_kinds(SvgWriter& svg, const KindCells& map, const Places& places) {
  const Cells& cells = map.cells;
  std::vector<Colour> colours;
  for (std::size_t i = 0; i < map.kinds.size(); ++i) {
    colours.push_back(colour_of(map, i));
  }
  std::vector<std::uint8_t> numbers(cells.values.size(), kClear);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (cells.states[i] == CellState::kSolved) {
      numbers[i] = static_cast<std::uint8_t>(cells.values[i]);
    }
  }
  draw_image(svg, cells, numbers, std::move(colours), places);
  draw_gaps(svg, cells, places);
  if (map.least_outlined > 0) {
    const KindGrid all = kind_grid_of(cells);
    const KindGrid grid = map.least_outlined > 1 ? without_specks(all, map.least_outlined) : all;
    draw_areas(svg, map, grid, places);
    draw_letters(svg, map, grid, places);
  }
}

}  // namespace oblique::client::plot
