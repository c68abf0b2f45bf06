#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/plot/draw/colour.h"

namespace oblique::client::plot {

/// How colours are written for a terminal.
enum class Shading { kNone, k256, kTrue };

/// Characters in rows and columns, each with a colour of its own.
class TextCanvas {
 public:
  TextCanvas(std::size_t columns, std::size_t lines);

  std::size_t columns() const { return columns_; }
  std::size_t lines() const { return cells_.size() / columns_; }

  /// One character of UTF-8, at a column and a line from the upper left. Outside nothing happens.
  void put(std::size_t column, std::size_t line, std::string_view character,
           std::optional<Colour> ink = {}, std::optional<Colour> ground = {});
  /// A text from there to the right, as far as there is room.
  void write(std::size_t column, std::size_t line, std::string_view text);
  /// A text that ends before that column.
  void write_before(std::size_t end, std::size_t line, std::string_view text);
  /// A text with its middle there, moved so that all of it is inside.
  void write_around(std::size_t middle, std::size_t line, std::string_view text);

  /// Lines, each ended by a line feed, without spaces at their end.
  std::string text(Shading shading) const;

 private:
  struct Cell {
    std::string character = " ";
    std::optional<Colour> ink = {};
    std::optional<Colour> ground = {};
  };

  std::size_t columns_;
  std::vector<Cell> cells_;
};

/// A text of a line, with its characters of UTF-8.
std::vector<std::string> characters_of(std::string_view text);

}  // namespace oblique::client::plot
