#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace oblique::client::plot {

/// A length of pictures as text: at most two decimals, no zeros at the end, the same on every
/// machine and in every language. What is no number is 0.
std::string svg_number(double value);

/// A text between tags or in quotes. Characters that XML has no place for become visible ones.
std::string svg_text(std::string_view text);

/// An id of the picture. Several pictures may stand in one page of HTML, where ids and styles hold
/// for all of it: SvgWriter begins each id with what tells the picture from others.
struct OwnId {
  std::string_view name;
};
/// A reference to it: "url(#...)".
struct OwnLink {
  std::string_view name;
};
/// Both as they stand in a text that SvgWriter is given verbatim.
std::string text_of(const OwnId& id);
std::string text_of(const OwnLink& link);

/// The data of a path, from place to place.
class PathData {
 public:
  void move_to(double x, double y);
  void line_to(double x, double y);
  void close() { data_ += 'Z'; }
  bool is_empty() const { return data_.empty(); }
  const std::string& text() const { return data_; }

 private:
  void append(char letter, double x, double y);

  std::string data_;
  double x_ = 0.0;
  double y_ = 0.0;
};

/// An attribute: its name, and its value as a length or a text.
struct Attribute {
  Attribute(std::string_view name_given, double value)
      : name(name_given), text(svg_number(value)) {}
  Attribute(std::string_view name_given, std::string_view value)
      : name(name_given), text(svg_text(value)) {}
  Attribute(std::string_view name_given, const std::string& value)
      : Attribute(name_given, std::string_view(value)) {}
  Attribute(std::string_view name_given, const char* value)
      : Attribute(name_given, std::string_view(value)) {}
  Attribute(std::string_view name_given, const OwnId& id) : name(name_given), text(text_of(id)) {}
  Attribute(std::string_view name_given, const OwnLink& link)
      : name(name_given), text(text_of(link)) {}
  std::string_view name;
  std::string text;
};
using Attributes = std::initializer_list<Attribute>;

/// Writes elements one after another; those that are opened are closed in turn.
class SvgWriter {
 public:
  /// A picture of that size, described for those who do not see it.
  SvgWriter(double width, double height, std::string_view title, std::string_view description);

  void element(std::string_view name, Attributes attributes);
  /// With a text as its content.
  void text_element(std::string_view name, Attributes attributes, std::string_view text);
  void open(std::string_view name, Attributes attributes = {});
  void close(std::string_view name);
  /// As it is, as definitions are.
  void verbatim(std::string_view text) { text_ += text; }
  /// Rules of CSS, which hold in this picture alone.
  void style(std::string_view css);
  /// What is in the picture as bytes that may differ from machine to machine, as a PNG, and tells
  /// it from others.
  void tell_apart(std::uint64_t hash) { hash_ ^= hash * kFactor; }

  void line(double x1, double y1, double x2, double y2, std::string_view style);
  void rectangle(double x, double y, double width, double height, std::string_view style);
  void path(const std::string& data, std::string_view style);
  /// `anchor`: start, middle or end, at x; the line of writing is at y.
  void text(double x, double y, std::string_view style, std::string_view anchor,
            std::string_view text);
  /// Upwards, its middle at y.
  void text_upwards(double x, double y, std::string_view style, std::string_view text);

  /// The whole picture, with its ids.
  std::string finished() &&;

 private:
  static constexpr std::uint64_t kFactor = 0x100000001b3U;  // of FNV-1a

  void begin(std::string_view name, Attributes attributes);

  std::string text_;
  std::uint64_t hash_ = 0xcbf29ce484222325U;
};

}  // namespace oblique::client::plot
