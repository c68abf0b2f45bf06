#pragma once

#include <cstddef>
#include <string>

#include "client/plot/figures/figure.h"
#include "client/plot/terminal/text_canvas.h"

namespace oblique::client::plot {

/// What a terminal can show.
struct TerminalLook {
  std::size_t columns = 80;
  std::size_t lines = 32;
  bool is_plain = false;  ///< ASCII alone, without colours
  Shading shading = Shading::kTrue;
};

/// What standard output can show: ASCII in a pipe, on a narrow terminal, on one without UTF-8, and
/// where NO_COLOR is set.
TerminalLook look_of_standard_output();

/// The figure as lines of text: maps in half blocks, lines and points in Braille's dots, bars in
/// blocks; in ASCII maps are letters for kinds and ten signs for shades.
std::string text_of(const Figure& figure, const TerminalLook& look);

}  // namespace oblique::client::plot
