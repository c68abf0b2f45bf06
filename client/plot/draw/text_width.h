#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::client::plot {

/// Font families of pictures, as CSS has them. Which of them a reader has is not known.
inline constexpr std::string_view kFontFamilies =
    "'DejaVu Sans', Verdana, 'Liberation Sans', Arial, Helvetica, sans-serif";

/// How wide a text is at a font of that size, in its units: that of DejaVu Sans, the widest of the
/// families, so that what is given room fits in the others too.
double text_width(std::string_view text, double font_size);

/// `text` in lines that are at most so wide, broken at spaces; a longer word has a line of its own.
std::vector<std::string> lines_of(std::string_view text, double font_size, double width);

/// `text` cut to that width, with "..." where something is missing.
std::string cut_to(std::string_view text, double font_size, double width);

}  // namespace oblique::client::plot
