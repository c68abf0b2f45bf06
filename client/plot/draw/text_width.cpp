#include "client/plot/draw/text_width.h"

#include <algorithm>
#include <array>

namespace oblique::client::plot {
namespace {

// Advance widths of DejaVu Sans from the space to the tilde, in thousandths of the font's size.
constexpr std::array<short, 95> kWidths{
    318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361,  318, 337, 636, 636, 636,
    636, 636, 636, 636, 636, 636, 636, 337, 337, 838, 838, 838, 531, 1000, 684, 686, 698, 770, 632,
    575, 775, 752, 295, 295, 656, 557, 863, 748, 787, 603, 787, 695, 635,  611, 732, 684, 989, 685,
    611, 685, 390, 337, 390, 838, 500, 500, 613, 635, 550, 635, 615, 352,  635, 634, 278, 278, 579,
    278, 974, 634, 612, 635, 635, 411, 521, 392, 634, 592, 818, 592, 592,  525, 636, 337, 636, 838};
constexpr short kOfOthers = 838;  // as wide as most signs, wider than most letters
constexpr short kOfDigitsAbove = 401;

/// Bytes of the character that begins with this byte of UTF-8.
std::size_t bytes_from(unsigned char lead) {
  return lead < 0x80 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
}

double width_of_character(std::string_view character) {
  const auto lead = static_cast<unsigned char>(character.front());
  if (lead >= 0x20 && lead < 0x7f) {
    return kWidths[lead - 0x20U];
  }
  // Digits above the line, and those of powers.
  if (character == "\u00b2" || character == "\u00b3" || character == "\u00b9" ||
      character.starts_with("\xe2\x81") || character.starts_with("\xe2\x82")) {
    return kOfDigitsAbove;
  }
  constexpr short kOfGreek = 636;
  return lead == 0xc2 || lead == 0xce || lead == 0xcf ? kOfGreek : kOfOthers;
}

}  // namespace

double text_width(std::string_view text, double font_size) {
  double width = 0.0;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t bytes = bytes_from(static_cast<unsigned char>(text[i]));
    width += width_of_character(text.substr(i, bytes));
    i += bytes;
  }
  return width * font_size / 1000.0;
}

std::vector<std::string> lines_of(std::string_view text, double font_size, double width) {
  std::vector<std::string> lines;
  std::string line;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string word(text.substr(0, end));
    const std::string longer = line.empty() ? word : line + ' ' + word;
    if (!line.empty() && text_width(longer, font_size) > width) {
      lines.push_back(line);
      line = word;
    } else {
      line = longer;
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  if (!line.empty()) {
    lines.push_back(line);
  }
  return lines;
}

std::string cut_to(std::string_view text, double font_size, double width) {
  if (text_width(text, font_size) <= width) {
    return std::string(text);
  }
  constexpr std::string_view kRest = "...";
  const double room = width - text_width(kRest, font_size);
  std::size_t end = 0;
  while (end < text.size()) {
    const std::size_t next = end + bytes_from(static_cast<unsigned char>(text[end]));
    if (text_width(text.substr(0, next), font_size) > room) {
      break;
    }
    end = next;
  }
  return std::string(text.substr(0, end)).append(kRest);
}

}  // namespace oblique::client::plot
