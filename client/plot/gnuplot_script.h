#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "client/plot/figure.h"

namespace oblique::client::plot {

/// What gnuplot makes of a script.
enum class Terminal { kSvg, kPdf, kPng };

/// The size without one that is asked for: that of the panels together, with the texts.
Size own_size(const Figure& figure);

/// A script for gnuplot 5.4 or later, with its data in it, that draws the figure to standard
/// output or, with a file name, to that file. PNG has two pixels each way for one of `size`.
std::string script_of(const Figure& figure, Terminal terminal, const Size& size,
                      const std::string& file = {});

/// The same for a terminal of that many characters.
std::string script_for_terminal(const Figure& figure, std::size_t columns, std::size_t lines,
                                bool has_colours);

/// A text in single quotes, in which gnuplot runs nothing and replaces nothing. Control characters
/// become visible, and apostrophes typographic: gnuplot 5.4 misreads a doubled one at the
/// beginning.
std::string gnuplot_text(std::string_view text);

}  // namespace oblique::client::plot
