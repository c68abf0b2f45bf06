#include <algorithm>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "client/plot/draw/outline.h"
#include "client/plot/draw/png.h"
#include "client/plot/draw/theme.h"
#include "client/plot/figures/svg_marks.h"

namespace oblique::client::plot {
namespace {

constexpr std::uint8_t kClear = 255;

/// Which cell each of `pixels` equal parts of an axis shows.
std::vector<std::size_t> cells_of_pixels(const std::vector<double>& edges, const Scale& scale,
                                         std::size_t pixels) {
  std::vector<std::size_t> cells(pixels);
  std::size_t cell = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(pixels);
    while (cell + 2 < edges.size() && scale.share_of(edges[cell + 1]) <= share) {
      ++cell;
    }
    cells[i] = cell;
  }
  return cells;
}

/// How many pixels an axis gets: whole numbers a cell where cells are alike, so that none is drawn
/// wider than another.
std::size_t pixels_for(const std::vector<double>& edges, const Scale& scale) {
  constexpr std::size_t kAtLeast = 400;
  constexpr std::size_t kOfUnequal = 1200;
  const std::size_t n = edges.size() - 1;
  const double first = scale.share_of(edges[1]) - scale.share_of(edges[0]);
  for (std::size_t i = 1; i < n; ++i) {
    const double width = scale.share_of(edges[i + 1]) - scale.share_of(edges[i]);
    if (std::abs(width - first) > 1e-6) {
      return std::max(kOfUnequal, n);
    }
  }
  return n >= kAtLeast ? n : n * ((kAtLeast + n - 1) / n);
}

/// Draws cells, each with the colour whose number it has, over the whole frame.
void draw_image(SvgWriter& svg, const Cells& cells, const std::vector<std::uint8_t>& numbers,
                std::vector<Colour> colours, const Places& places) {
  const std::size_t width = pixels_for(cells.x_edges, places.x_scale());
  const std::size_t height = pixels_for(cells.y_edges, places.y_scale());
  const auto columns = cells_of_pixels(cells.x_edges, places.x_scale(), width);
  const auto rows = cells_of_pixels(cells.y_edges, places.y_scale(), height);
  IndexedImage image{width, height, std::move(colours), kClear, {}};
  image.colours.resize(kClear + 1U);
  image.pixels.reserve(width * height);
  for (std::size_t y = 0; y < height; ++y) {
    const std::size_t row = rows[height - 1 - y] * cells.columns();
    for (std::size_t x = 0; x < width; ++x) {
      image.pixels.push_back(numbers[row + columns[x]]);
    }
  }
  const Box& frame = places.frame();
  svg.element("image", {{"class", "cells"},
                        {"x", frame.x},
                        {"y", frame.y},
                        {"width", frame.width},
                        {"height", frame.height},
                        {"preserveAspectRatio", "none"},
                        {"href", "data:image/png;base64," + base64(png_of(image))}});
}

double x_of(const Places& places, const Cells& cells, std::size_t corner) {
  return places.x(cells.x_edges[corner]);
}
double y_of(const Places& places, const Cells& cells, std::size_t corner) {
  return places.y(cells.y_edges[corner]);
}

std::string path_of(const std::vector<Outline>& outlines, const Cells& cells, const Places& places,
                    bool is_closed) {
  PathData path;
  for (const Outline& outline : outlines) {
    bool is_first = true;
    for (const Corner& corner : outline.corners) {
      const double x = x_of(places, cells, corner.x);
      const double y = y_of(places, cells, corner.y);
      if (is_first) {
        path.move_to(x, y);
      } else {
        path.line_to(x, y);
      }
      is_first = false;
    }
    if (is_closed) {
      path.close();
    }
  }
  return path.text();
}

/// Edges of areas that are few enough to be seen. Of a map like noise they would hide the colours,
/// and take megabytes.
constexpr std::size_t kMostCorners = 60'000;

std::size_t corners_of(const std::vector<Outline>& outlines) {
  std::size_t corners = 0;
  for (const Outline& outline : outlines) {
    corners += outline.corners.size();
  }
  return corners;
}

void fill_path(SvgWriter& svg, const std::string& data, const std::string& filling) {
  if (!data.empty()) {
    svg.element("path", {{"fill", filling}, {"fill-rule", "evenodd"}, {"d", data}});
  }
}

/// Hatches cells without result, and those that failed.
void draw_gaps(SvgWriter& svg, const Cells& cells, const Places& places) {
  KindGrid grid{cells.columns(), cells.rows(), {}};
  for (const CellState state : cells.states) {
    grid.kinds.push_back(static_cast<int>(state));
  }
  for (const auto& [state, filling] : {std::pair{CellState::kNoResult, "url(#missing)"},
                                       std::pair{CellState::kFailed, "url(#failed)"}}) {
    fill_path(svg, path_of(outlines_of(grid, static_cast<int>(state)), cells, places, true),
              filling);
  }
}

/// Writes its letter into the area of a kind where there is room.
void draw_letter(SvgWriter& svg, const KindGrid& grid, std::size_t kind, const Cells& cells,
                 const Places& places) {
  const Roomiest room = roomiest_of(grid, static_cast<int>(kind));
  if (room.side == 0) {
    return;
  }
  const auto corner = [&](double at, const auto& edges) {
    const auto whole = static_cast<std::size_t>(at);
    return at > static_cast<double>(whole) ? 0.5 * (edges(whole) + edges(whole + 1)) : edges(whole);
  };
  const auto x_edge = [&](std::size_t i) { return x_of(places, cells, i); };
  const auto y_edge = [&](std::size_t i) { return y_of(places, cells, i); };
  const double half = static_cast<double>(room.side) / 2.0;
  const double width = corner(room.x + half, x_edge) - corner(room.x - half, x_edge);
  const double height = corner(room.y - half, y_edge) - corner(room.y + half, y_edge);
  constexpr double kRoomForLetter = 13.0;
  if (width >= kRoomForLetter && height >= kRoomForLetter) {
    svg.text(corner(room.x, x_edge), corner(room.y, y_edge) + 4.5, "letter", "middle",
             letter_of(kind));
  }
}

}  // namespace

Colour colour_at(const Colours& colours, double value) {
  const Scale scale(colours.axis.range.from, colours.axis.range.to, colours.axis.is_logarithmic);
  return shade(colours.palette, shade_number(scale.share_of(value)));
}

void draw_cells(SvgWriter& svg, const Cells& cells, const Colours& colours, const Places& places) {
  const Scale scale(colours.axis.range.from, colours.axis.range.to, colours.axis.is_logarithmic);
  // One colour of the 256 is the clear one.
  constexpr std::size_t kLast = kClear - 1;
  std::vector<Colour> shades;
  for (std::size_t i = 0; i <= kLast; ++i) {
    shades.push_back(shade(colours.palette, (i * (kShades - 1) + kLast / 2) / kLast));
  }
  std::vector<std::uint8_t> numbers(cells.values.size(), kClear);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const double share = scale.share_of(cells.values[i]);
    if (cells.states[i] == CellState::kSolved && !std::isnan(share)) {
      numbers[i] = static_cast<std::uint8_t>(
          std::floor(std::clamp(share, 0.0, 1.0) * static_cast<double>(kLast) + 0.5));
    }
  }
  draw_gaps(svg, cells, places);
  draw_image(svg, cells, numbers, std::move(shades), places);
}

void draw_kinds(SvgWriter& svg, const KindCells& map, const Places& places) {
  const Cells& cells = map.cells;
  std::vector<Colour> colours;
  for (std::size_t i = 0; i < map.kinds.size(); ++i) {
    colours.push_back(map.kinds[i].is_rest ? kFillOfOthers.colour : fill(i).colour);
  }
  KindGrid grid{cells.columns(), cells.rows(), std::vector<int>(cells.values.size(), -1)};
  std::vector<std::uint8_t> numbers(cells.values.size(), kClear);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (cells.states[i] == CellState::kSolved) {
      numbers[i] = static_cast<std::uint8_t>(cells.values[i]);
      grid.kinds[i] = numbers[i];
    }
  }
  draw_gaps(svg, cells, places);
  draw_image(svg, cells, numbers, std::move(colours), places);
  if (const auto boundaries = boundaries_of(grid); corners_of(boundaries) <= kMostCorners) {
    // Outlines turn where boundaries do: they are as few.
    for (std::size_t i = 0; i < map.kinds.size(); ++i) {
      const Hatch hatch = map.kinds[i].is_rest ? kFillOfOthers.hatch : fill(i).hatch;
      if (hatch != Hatch::kNone) {
        fill_path(svg, path_of(outlines_of(grid, static_cast<int>(i)), cells, places, true),
                  hatch_link(hatch));
      }
    }
    svg.path(path_of(boundaries, cells, places, false), "boundary");
  }
  for (std::size_t i = 0; i < map.kinds.size(); ++i) {
    if (!map.kinds[i].is_rest) {
      draw_letter(svg, grid, i, cells, places);
    }
  }
}

}  // namespace oblique::client::plot
