#include "client/plot/draw/svg.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::client::plot {
namespace {

std::int64_t hundredths_of(double value) {
  constexpr double kFar = 1e7;
  if (!std::isfinite(value)) {
    return 0;
  }
  return std::llround(std::fmin(std::fmax(value, -kFar), kFar) * 100.0);
}

void append_hundredths(std::string& out, std::int64_t hundredths) {
  if (hundredths < 0) {
    out += '-';
    hundredths = -hundredths;
  }
  const auto whole = hundredths / 100;
  const auto rest = hundredths % 100;
  if (whole != 0 || rest == 0) {
    out += std::to_string(whole);
  }
  if (rest != 0) {
    out += '.';
    out += static_cast<char>('0' + rest / 10);
    if (rest % 10 != 0) {
      out += static_cast<char>('0' + rest % 10);
    }
  }
}

/// Stands for the beginning of the picture's ids until they are known. `visible` lets no text have
/// it.
constexpr char kOwn = '\x01';

/// Texts have no quote, so that this is an attribute.
constexpr std::string_view kPngMark = "\"data:image/png;base64,";

/// Where the next PNG begins in a picture, and where it ends.
std::pair<std::size_t, std::size_t> next_png(std::string_view text, std::size_t from) {
  const std::size_t begin = text.find(kPngMark, from);
  return begin == std::string_view::npos ? std::pair{text.size(), text.size()}
                                         : std::pair{begin, text.find('"', begin + 1)};
}

/// The rules of CSS, each of them of what is below the element with that id.
std::string below(std::string_view css, std::string_view id) {
  std::string out;
  while (!css.empty()) {
    const std::size_t open = css.find('{');
    if (css.front() == '@' && open != std::string_view::npos) {
      out += css.substr(0, open + 1);  // of rules inside
      css.remove_prefix(open + 1);
      continue;
    }
    if (css.front() == '}' || open == std::string_view::npos) {
      out += css.front();
      css.remove_prefix(1);
      continue;
    }
    for (const char letter : css.substr(0, open)) {
      const bool begins =
          out.empty() || out.back() == '}' || out.back() == '{' || out.back() == ',';
      out += begins ? fmt::format("#{} {}", id, letter) : std::string(1, letter);
    }
    const std::size_t close = css.find('}', open);
    out += css.substr(open, close - open + 1);
    css.remove_prefix(close + 1);
  }
  return out;
}

}  // namespace

std::string text_of(const OwnId& id) {
  return fmt::format("{}-{}", kOwn, id.name);
}

std::string text_of(const OwnLink& link) {
  return fmt::format("url(#{}-{})", kOwn, link.name);
}

std::string svg_number(double value) {
  std::string text;
  append_hundredths(text, hundredths_of(value));
  return text;
}

std::string svg_text(std::string_view text) {
  std::string escaped;
  for (const char letter : protocol::visible(std::string(text))) {
    switch (letter) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += letter;
    }
  }
  return escaped;
}

void PathData::append(char letter, double x, double y) {
  data_ += letter;
  append_hundredths(data_, hundredths_of(x));
  const auto second = hundredths_of(y);
  if (second >= 0) {
    data_ += ' ';
  }
  append_hundredths(data_, second);
  x_ = x;
  y_ = y;
}

void PathData::move_to(double x, double y) {
  append('M', x, y);
}

void PathData::line_to(double x, double y) {
  // The level and the upright line say one number only.
  if (hundredths_of(y) == hundredths_of(y_)) {
    data_ += 'H';
    append_hundredths(data_, hundredths_of(x));
    x_ = x;
  } else if (hundredths_of(x) == hundredths_of(x_)) {
    data_ += 'V';
    append_hundredths(data_, hundredths_of(y));
    y_ = y;
  } else {
    append('L', x, y);
  }
}

SvgWriter::SvgWriter(double width, double height, std::string_view title,
                     std::string_view description) {
  begin("svg", {{"xmlns", "http://www.w3.org/2000/svg"},
                {"id", OwnId{"picture"}},
                {"width", width},
                {"height", height},
                {"viewBox", "0 0 " + svg_number(width) + ' ' + svg_number(height)},
                {"role", "img"}});
  text_ += ">\n";
  text_element("title", {}, title);
  text_element("desc", {}, description);
}

void SvgWriter::begin(std::string_view name, Attributes attributes) {
  text_ += '<';
  text_ += name;
  for (const Attribute& attribute : attributes) {
    text_ += ' ';
    text_ += attribute.name;
    text_ += "=\"";
    text_ += attribute.text;
    text_ += '"';
  }
}

void SvgWriter::element(std::string_view name, Attributes attributes) {
  begin(name, attributes);
  text_ += "/>\n";
}

void SvgWriter::text_element(std::string_view name, Attributes attributes, std::string_view text) {
  begin(name, attributes);
  text_ += '>';
  text_ += svg_text(text);
  close(name);
}

void SvgWriter::open(std::string_view name, Attributes attributes) {
  begin(name, attributes);
  text_ += ">\n";
}

void SvgWriter::close(std::string_view name) {
  text_ += "</";
  text_ += name;
  text_ += ">\n";
}

void SvgWriter::line(double x1, double y1, double x2, double y2, std::string_view style) {
  element("line", {{"class", style}, {"x1", x1}, {"y1", y1}, {"x2", x2}, {"y2", y2}});
}

void SvgWriter::rectangle(double x, double y, double width, double height, std::string_view style) {
  element("rect", {{"class", style}, {"x", x}, {"y", y}, {"width", width}, {"height", height}});
}

void SvgWriter::path(const std::string& data, std::string_view style) {
  if (!data.empty()) {
    text_ += "<path class=\"";
    text_ += style;
    text_ += "\" d=\"";
    text_ += data;
    text_ += "\"/>\n";
  }
}

void SvgWriter::text(double x, double y, std::string_view style, std::string_view anchor,
                     std::string_view text) {
  if (!text.empty()) {
    text_element("text", {{"class", style}, {"x", x}, {"y", y}, {"text-anchor", anchor}}, text);
  }
}

void SvgWriter::text_upwards(double x, double y, std::string_view style, std::string_view text) {
  if (!text.empty()) {
    text_element(
        "text",
        {{"class", style},
         {"transform", "translate(" + svg_number(x) + ' ' + svg_number(y) + ") rotate(-90)"},
         {"text-anchor", "middle"}},
        text);
  }
}

void SvgWriter::style(std::string_view css) {
  text_ += "<style>" + below(css, text_of(OwnId{"picture"})) + "</style>\n";
}

std::string SvgWriter::finished() && {
  close("svg");
  auto png = next_png(text_, 0);
  for (std::size_t i = 0; i < text_.size(); ++i) {
    if (i == png.first) {
      i = png.second;
      png = next_png(text_, i);
    }
    hash_ = (hash_ ^ static_cast<unsigned char>(text_[i])) * kFactor;
  }
  const std::string own = fmt::format("p{:08x}", static_cast<std::uint32_t>(hash_ >> 32U));
  std::string whole;
  whole.reserve(text_.size() + text_.size() / 8);
  for (std::size_t from = 0; from < text_.size();) {
    const std::size_t mark = std::min(text_.find(kOwn, from), text_.size());
    whole.append(text_, from, mark - from);
    whole += mark < text_.size() ? own : std::string();
    from = mark + 1;
  }
  return whole;
}

}  // namespace oblique::client::plot
