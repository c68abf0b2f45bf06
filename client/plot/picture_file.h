#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/plot/figure.h"

namespace oblique::client::plot {

enum class PictureFormat { kSvg, kPdf, kPng, kScript, kCsv };

/// The format of that name, or without one that of a file's ending, else SVG. Throws
/// solver::InputError for another name, and for a file that ends otherwise without a format.
PictureFormat picture_format(const std::string& name, const std::string& file);

std::vector<std::string_view> picture_format_names();

/// The figure in that format, in its own size unless one is given. Pictures are made by gnuplot:
/// throws std::runtime_error where it is missing, fails or takes too long. A script (`gp`) needs
/// none.
std::string picture_of(const Figure& figure, PictureFormat format,
                       const std::optional<Size>& size = {});

/// Its data as CSV in SI units, one panel behind the other.
std::string csv_of(const Figure& figure);

/// The figure in characters, by gnuplot, in the size of the terminal of standard output; with
/// colours if that is a terminal and NO_COLOR is not set.
std::string text_of(const Figure& figure);

/// Runs gnuplot on a script and returns its output. Throws std::runtime_error as picture_of does.
std::string output_of_gnuplot(const std::string& script);

/// Writes it to a file, which appears when it is whole, through a link where the name is one, or to
/// standard output where `file` is empty. Throws solver::InputError for a file that cannot be made,
/// and for PNG or PDF on a terminal.
void write_picture(const std::string& picture, PictureFormat format, const std::string& file);

/// "760x520". Throws solver::InputError for what is no size, or one that nothing can be read in.
Size size_of(const std::string& text);

// ---- Scripts (gnuplot_script.cpp) ----

/// The size without one that is asked for: that of the panels together, with the texts.
Size own_size(const Figure& figure);

/// A script for gnuplot 5.4 or later, with its data in it, that draws SVG, PDF or PNG to standard
/// output or, with a file name, to that file. PNG has two pixels each way for one of `size`.
std::string script_of(const Figure& figure, PictureFormat format, const Size& size,
                      const std::string& file = {});

/// The same for a terminal of that many characters.
std::string script_for_terminal(const Figure& figure, std::size_t columns, std::size_t lines,
                                bool has_colours);

/// A text in single quotes, in which gnuplot runs nothing and replaces nothing. Control characters
/// become visible, and apostrophes typographic: gnuplot 5.4 misreads a doubled one at the
/// beginning.
std::string gnuplot_text(std::string_view text);

}  // namespace oblique::client::plot
