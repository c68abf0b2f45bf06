#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/plot/draw/outline.h"
#include "client/plot/figures/svg_marks.h"

// What maps of values and maps of kinds are drawn with.
namespace oblique::client::plot {

/// The number of no colour, which lets through what is below.
inline constexpr std::uint8_t kClear = 255;

/// Draws cells, each with the colour whose number it has, over the whole frame.
void draw_image(SvgWriter& svg, const Cells& cells, const std::vector<std::uint8_t>& numbers,
                std::vector<Colour> colours, const Places& places);

/// Hatches cells without result, and those that failed.
void draw_gaps(SvgWriter& svg, const Cells& cells, const Places& places);

/// Lines along edges of cells as the data of a path.
std::string path_of(const std::vector<Outline>& outlines, const Cells& cells, const Places& places,
                    bool is_closed);

/// Fills a path, holes left out, with the pattern of that id.
void fill_path(SvgWriter& svg, const std::string& data, std::string_view filling);

}  // namespace oblique::client::plot
