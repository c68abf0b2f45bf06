#include "client/plot/figures/svg_cells.h"

#include <algorithm>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "client/plot/draw/outline.h"
#include "client/plot/draw/png.h"
#include "client/plot/draw/theme.h"

namespace oblique::client::plot {
namespace {

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

/// FNV-1a.
std::uint64_t hash_of(const std::vector<std::uint8_t>& bytes) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const std::uint8_t byte : bytes) {
    hash = (hash ^ byte) * 0x100000001b3U;
  }
  return hash;
}

double x_of(const Places& places, const Cells& cells, std::size_t corner) {
  return places.x(cells.x_edges[corner]);
}
double y_of(const Places& places, const Cells& cells, std::size_t corner) {
  return places.y(cells.y_edges[corner]);
}

/// Gaps with more corners would take up too many bytes as paths.
std::size_t most_corners(const Cells& cells) {
  constexpr std::size_t kEach = 6;
  return kEach * (cells.columns() + cells.rows());
}

/// Fills the cells of a state through a mask, whose size is bounded by the number of cells.
void fill_masked(SvgWriter& svg, const Cells& cells, CellState state, std::string_view filling,
                 const Places& places) {
  std::vector<std::uint8_t> numbers;
  numbers.reserve(cells.states.size());
  for (const CellState each : cells.states) {
    numbers.push_back(each == state ? 0 : kClear);
  }
  const Box& frame = places.frame();
  const std::string mask = fmt::format("only-{}", filling);
  svg.open("mask", {{"id", OwnId{mask}},
                    {"maskUnits", "userSpaceOnUse"},
                    {"x", frame.x},
                    {"y", frame.y},
                    {"width", frame.width},
                    {"height", frame.height}});
  draw_image(svg, cells, numbers, {colour_of(0xffffff)}, places);
  svg.close("mask");
  svg.element("rect", {{"x", frame.x},
                       {"y", frame.y},
                       {"width", frame.width},
                       {"height", frame.height},
                       {"fill", OwnLink{filling}},
                       {"mask", OwnLink{mask}}});
}

}  // namespace

void draw_image(SvgWriter& svg, const Cells& cells, const std::vector<std::uint8_t>& numbers,
                std::vector<Colour> colours, const Places& places) {
  const std::size_t width = pixels_for(cells.x_edges, places.x_scale());
  const std::size_t height = pixels_for(cells.y_edges, places.y_scale());
  const auto columns = cells_of_pixels(cells.x_edges, places.x_scale(), width);
  const auto rows = cells_of_pixels(cells.y_edges, places.y_scale(), height);
  const auto clear = static_cast<std::uint8_t>(colours.size());
  IndexedImage image{width, height, std::move(colours), clear, {}};
  image.colours.resize(clear + std::size_t{1});
  image.pixels.reserve(width * height);
  for (std::size_t y = 0; y < height; ++y) {
    const std::size_t row = rows[height - 1 - y] * cells.columns();
    for (std::size_t x = 0; x < width; ++x) {
      image.pixels.push_back(std::min(numbers[row + columns[x]], clear));
    }
  }
  svg.tell_apart(hash_of(image.pixels));
  const Box& frame = places.frame();
  svg.element("image", {{"class", "cells"},
                        {"x", frame.x},
                        {"y", frame.y},
                        {"width", frame.width},
                        {"height", frame.height},
                        {"preserveAspectRatio", "none"},
                        {"href", "data:image/png;base64," + base64(png_of(image))}});
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

void fill_path(SvgWriter& svg, const std::string& data, std::string_view filling) {
  if (!data.empty()) {
    svg.element("path", {{"fill", OwnLink{filling}}, {"fill-rule", "evenodd"}, {"d", data}});
  }
}

void draw_gaps(SvgWriter& svg, const Cells& cells, const Places& places) {
  KindGrid grid{cells.columns(), cells.rows(), {}};
  for (const CellState state : cells.states) {
    grid.kinds.push_back(static_cast<int>(state));
  }
  for (const auto& [state, filling] :
       {std::pair{CellState::kNoResult, "missing"}, std::pair{CellState::kFiltered, "filtered"},
        std::pair{CellState::kFailed, "failed"}}) {
    const auto outlines = outlines_of(grid, static_cast<int>(state));
    if (corners_of(outlines) > most_corners(cells)) {
      fill_masked(svg, cells, state, filling, places);
    } else {
      fill_path(svg, path_of(outlines, cells, places, true), filling);
    }
  }
}

Colour colour_at(const Colours& colours, double value) {
  const Scale scale(colours.axis.range.from, colours.axis.range.to, colours.axis.is_logarithmic);
  return shade_of(colours, scale.share_of(value));
}

void draw_cells(SvgWriter& svg, const Cells& cells, const Colours& colours, const Places& places) {
  const Scale scale(colours.axis.range.from, colours.axis.range.to, colours.axis.is_logarithmic);
  // One colour of the 256 is the clear one.
  constexpr std::size_t kLast = kClear - 1;
  std::vector<Colour> shades;
  for (std::size_t i = 0; i <= kLast; ++i) {
    shades.push_back(shade_of(colours, static_cast<double>(i) / kLast));
  }
  std::vector<std::uint8_t> numbers(cells.values.size(), kClear);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const double share = scale.share_of(cells.values[i]);
    if (cells.states[i] == CellState::kSolved && !std::isnan(share)) {
      numbers[i] = static_cast<std::uint8_t>(
          std::floor(std::clamp(share, 0.0, 1.0) * static_cast<double>(kLast) + 0.5));
    }
  }
  draw_image(svg, cells, numbers, std::move(shades), places);
  draw_gaps(svg, cells, places);
}

}  // namespace oblique::client::plot
