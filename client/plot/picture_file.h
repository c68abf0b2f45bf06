#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/plot/figure.h"

namespace oblique::client::plot {

enum class PictureFormat { kSvg, kPdf, kPng, kScript, kCsv };

/// The format called `name` or, if that is empty, of the ending of `file`; SVG if both are empty.
/// Throws solver::InputError for other names and endings.
PictureFormat picture_format(const std::string& name, const std::string& file);

std::vector<std::string_view> picture_format_names();

/// The figure in that format, in its own size unless one is given. Runs gnuplot, except for a
/// script (`gp`): throws std::runtime_error if gnuplot is missing, fails or takes too long.
std::string picture_of(const Figure& figure, PictureFormat format,
                       const std::optional<Size>& size = {});

/// The data of the figure as CSV in SI units, panel after panel.
std::string csv_of(const Figure& figure);

/// The figure as text in the size of the terminal of standard output, drawn by gnuplot; with
/// colours if it is a terminal and NO_COLOR is not set.
std::string text_of(const Figure& figure);

/// Runs gnuplot on a script and returns its output. Throws std::runtime_error as picture_of does.
std::string output_of_gnuplot(const std::string& script);

/// Writes `picture` to a file (AtomicFile), or to standard output if `file` is empty. Throws
/// solver::InputError if the file cannot be created, and for PNG or PDF on a terminal.
void write_picture(const std::string& picture, PictureFormat format, const std::string& file);

/// Parses a size such as "760x520". Throws solver::InputError if it is malformed or too small to
/// read.
Size size_of(const std::string& text);

// ---- Scripts (gnuplot_script.cpp) ----

/// The default size: that of the panels with their texts.
Size own_size(const Figure& figure);

/// A script for gnuplot 5.4 or later, including the data, that draws SVG, PDF or PNG to standard
/// output or to `file`. PNG has twice the pixels of `size` in both directions.
std::string script_of(const Figure& figure, PictureFormat format, const Size& size,
                      const std::string& file = {});

/// A script for a text terminal of that size in characters.
std::string script_for_terminal(const Figure& figure, std::size_t columns, std::size_t lines,
                                bool has_colours);

/// A single-quoted string, in which gnuplot executes and replaces nothing. Control characters
/// become visible. Apostrophes become typographic ones, because gnuplot 5.4 misreads a doubled one
/// at the beginning.
std::string gnuplot_text(std::string_view text);

}  // namespace oblique::client::plot
