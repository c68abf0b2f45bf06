#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/plot/figure.h"

namespace oblique::client::plot {

enum class PictureFormat { kSvg, kPdf, kPng, kScript, kCsv };

/// The format called `name`. If `name` is empty, the ending of `file` gives the format; if both are
/// empty, it is SVG. Throws solver::InputError for other names and endings.
PictureFormat picture_format(const std::string& name, const std::string& file);

std::vector<std::string_view> picture_format_names();

/// Renders the figure in `format` and in `size` (default: own_size). All formats but CSV and script
/// need gnuplot: throws std::runtime_error if it is missing, fails or takes too long.
std::string picture_of(const Figure& figure, PictureFormat format,
                       const std::optional<Size>& size = {});

/// Returns the data of the figure as CSV in SI units, panel after panel.
std::string csv_of(const Figure& figure);

/// Renders the figure as text that fits the terminal of standard output; needs gnuplot. The text
/// has colours if standard output is a terminal and NO_COLOR is not set.
std::string text_of(const Figure& figure);

/// Runs gnuplot on a script and returns its output. Throws std::runtime_error if gnuplot is
/// missing, fails or takes too long.
std::string output_of_gnuplot(const std::string& script);

/// Writes `picture` to a file (AtomicFile), or to standard output if `file` is empty. Throws
/// solver::InputError if the file cannot be created, or if a PNG or PDF would go to a terminal.
void write_picture(const std::string& picture, PictureFormat format, const std::string& file);

/// Parses a size such as "760x520". Throws solver::InputError if the text is malformed or the size
/// too small for a readable picture.
Size size_of(const std::string& text);

// ---- Scripts (gnuplot_script.cpp) ----

/// Default size of the picture: its panels with the texts around them.
Size own_size(const Figure& figure);

/// Returns a script for gnuplot 5.4 or later that contains the data and draws SVG, PDF or PNG to
/// `file`, or to standard output if `file` is empty. PNG has twice the pixels of `size` in both
/// directions.
std::string script_of(const Figure& figure, PictureFormat format, const Size& size,
                      const std::string& file = {});

/// Returns a gnuplot script that draws on a text terminal of `columns` x `lines` characters.
std::string script_for_terminal(const Figure& figure, std::size_t columns, std::size_t lines,
                                bool has_colours);

/// Quotes a text for gnuplot with single quotes, so that gnuplot expands nothing in it. Makes
/// control characters visible. Replaces apostrophes by typographic ones, because gnuplot 5.4
/// misreads a doubled apostrophe at the beginning of a text.
std::string gnuplot_text(std::string_view text);

}  // namespace oblique::client::plot
