#include "client/plot/terminal/text_canvas.h"

#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::client::plot {
namespace {

/// The number of the nearest colour in the cube of 256 that terminals have.
int number_in_cube(const Colour& colour) {
  const auto step = [](std::uint8_t channel) {
    return channel < 48 ? 0 : channel < 115 ? 1 : (channel - 35) / 40;
  };
  return 16 + 36 * step(colour.red) + 6 * step(colour.green) + step(colour.blue);
}

std::string escape_for(const Colour& colour, bool is_ground, Shading shading) {
  const int base = is_ground ? 48 : 38;
  return shading == Shading::kTrue
             ? fmt::format(";{};2;{};{};{}", base, colour.red, colour.green, colour.blue)
             : fmt::format(";{};5;{}", base, number_in_cube(colour));
}

}  // namespace

std::vector<std::string> characters_of(std::string_view text) {
  std::vector<std::string> characters;
  for (const char letter : text) {
    const bool goes_on = (static_cast<unsigned char>(letter) & 0xc0U) == 0x80U;
    if (goes_on && !characters.empty()) {
      characters.back() += letter;
    } else {
      characters.emplace_back(1, letter);
    }
  }
  return characters;
}

TextCanvas::TextCanvas(std::size_t columns, std::size_t lines)
    : columns_(columns), cells_(columns * lines) {}

void TextCanvas::put(std::size_t column, std::size_t line, std::string_view character,
                     std::optional<Colour> ink, std::optional<Colour> ground) {
  if (column < columns_ && line < lines()) {
    cells_[line * columns_ + column] = {std::string(character), ink, ground};
  }
}

void TextCanvas::write(std::size_t column, std::size_t line, std::string_view text) {
  for (const auto& character : characters_of(protocol::visible(text))) {
    put(column++, line, character);
  }
}

void TextCanvas::write_before(std::size_t end, std::size_t line, std::string_view text) {
  const auto size = characters_of(text).size();
  write(end > size ? end - size : 0, line, text);
}

void TextCanvas::write_around(std::size_t middle, std::size_t line, std::string_view text) {
  const auto size = characters_of(text).size();
  const std::size_t from = middle > size / 2 ? middle - size / 2 : 0;
  const std::size_t last = columns_ > size ? columns_ - size : 0;
  write(std::min(from, last), line, text);
}

std::string TextCanvas::text(Shading shading) const {
  std::string out;
  for (std::size_t line = 0; line < lines(); ++line) {
    const auto begin = cells_.begin() + static_cast<std::ptrdiff_t>(line * columns_);
    auto end = begin + static_cast<std::ptrdiff_t>(columns_);
    while (end != begin && (end - 1)->character == " " && !(end - 1)->ground) {
      --end;
    }
    std::string now;  // the escape that holds
    for (auto cell = begin; cell != end; ++cell) {
      std::string wanted;
      if (shading != Shading::kNone && cell->ink) {
        wanted += escape_for(*cell->ink, false, shading);
      }
      if (shading != Shading::kNone && cell->ground) {
        wanted += escape_for(*cell->ground, true, shading);
      }
      if (wanted != now) {
        out += "\x1b[0" + wanted + 'm';
        now = wanted;
      }
      out += cell->character;
    }
    out += now.empty() ? "\n" : "\x1b[0m\n";
  }
  return out;
}

}  // namespace oblique::client::plot
