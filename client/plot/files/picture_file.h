#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/plot/figures/figure.h"
#include "client/plot/figures/layout.h"
#include "client/plot/sheets/sheet.h"

namespace oblique::client::plot {

enum class PictureFormat { kSvg, kPng, kCsv, kGnuplot };

/// The format of that name, or without one that of a file's ending, else SVG. Throws
/// solver::InputError for another name, and for a file that ends otherwise without a format.
PictureFormat picture_format(const std::string& name, const std::string& file);

/// Names of all.
std::vector<std::string_view> picture_format_names();

/// The figure in that format. PNG is made by rsvg-convert, two pixels each way for one of SVG;
/// throws std::runtime_error where that program is missing or fails.
std::string picture_of(const Figure& figure, PictureFormat format, const Size& size);
/// The same of several figures; tables and scripts have their panels one after another.
std::string picture_of(const Sheet& sheet, PictureFormat format, const Size& size);

/// Writes it to a file, which appears when it is whole, through a link where the name is one, or to
/// standard output where `file` is empty. Throws solver::InputError for a file that cannot be made,
/// and for PNG on a terminal.
void write_picture(const std::string& picture, PictureFormat format, const std::string& file);

/// "760x520". Throws solver::InputError for what is no size, or one that nothing can be read in.
Size size_of(const std::string& text);

}  // namespace oblique::client::plot
