#include "proto/text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

namespace oblique::protocol {
namespace {

bool is_control(char32_t code) {
  using Range = std::pair<char32_t, char32_t>;
  constexpr std::array<Range, 13> kControls{{
      {0x00, 0x1f},        // C0
      {0x7f, 0x9f},        // DEL, C1
      {0xad, 0xad},        // soft hyphen
      {0x034f, 0x034f},    // combining grapheme joiner
      {0x061c, 0x061c},    // Arabic letter mark
      {0x180b, 0x180f},    // Mongolian variation selectors and vowel separator
      {0x200b, 0x200f},    // zero-width space and joiners; left-to-right and right-to-left marks
      {0x2028, 0x202e},    // line and paragraph separators; embeddings and overrides
      {0x2060, 0x206f},    // word joiner, invisible operators, isolates
      {0xfe00, 0xfe0f},    // variation selectors
      {0xfeff, 0xfeff},    // zero-width no-break space
      {0xfffe, 0xffff},    // not characters, and not allowed in XML
      {0xe0000, 0xe0fff},  // tags, variation selectors
  }};
  return std::any_of(kControls.begin(), kControls.end(), [code](const Range& range) {
    return code >= range.first && code <= range.second;
  });
}

std::string escape_of(char32_t code) {
  constexpr std::u32string_view kNamed = U"\n\r\t";
  if (const auto place = kNamed.find(code); place != std::u32string_view::npos) {
    return {'\\', "nrt"[place]};
  }
  return fmt::format(fmt::runtime(code < 0x80 ? "\\x{:02x}" : "\\u{:04x}"),
                     static_cast<unsigned>(code));
}

std::string visible_but(std::string_view text, std::string_view kept) {
  std::string shown;
  while (!text.empty()) {
    const Character next = first_character(text);
    const auto bytes = text.substr(0, std::max<std::size_t>(next.bytes, 1));
    if (next.bytes == 0) {
      shown += fmt::format("\\x{:02x}", static_cast<unsigned char>(text.front()));
    } else if (is_control(next.code) && kept.find(bytes) == std::string_view::npos) {
      shown += escape_of(next.code);
    } else {
      shown += bytes;
    }
    text.remove_prefix(bytes.size());
  }
  return shown;
}

// Levenshtein's distance, computed one row of its table at a time.
std::size_t distance(std::string_view a, std::string_view b) {
  const auto lower = [](char letter) { return std::tolower(static_cast<unsigned char>(letter)); };
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (lower(a[i]) == lower(b[j]) ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace

Character first_character(std::string_view text) {
  constexpr Character kNone{0, 0};
  const auto lead = static_cast<unsigned char>(text.empty() ? '\xff' : text.front());
  if (lead < 0x80) {
    return {1, lead};
  }
  const std::size_t bytes = lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < bytes) {
    return kNone;
  }
  char32_t code = lead & (0x7fU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte & 0xc0U) != 0x80) {
      return kNone;
    }
    code = (code << 6U) | (byte & 0x3fU);
  }
  // Invalid: an overlong encoding, half of a UTF-16 pair, and a number above the last code point.
  constexpr std::array<char32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};
  const bool is_sound =
      code >= kLeast.at(bytes) && !(code >= 0xd800 && code <= 0xdfff) && code <= 0x10ffff;
  return is_sound ? Character{bytes, code} : kNone;
}

std::string visible(std::string_view text) {
  return visible_but(text, {});
}

std::string visible_lines(std::string_view text) {
  return visible_but(text, "\n");
}

bool is_utf8(std::string_view text) {
  while (!text.empty() && first_character(text).bytes > 0) {
    text.remove_prefix(first_character(text).bytes);
  }
  return text.empty();
}

std::string shortened(const std::string& text, std::size_t bytes) {
  if (text.size() <= bytes) {
    return text;
  }
  while (bytes > 0 && (static_cast<unsigned char>(text[bytes]) & 0xc0U) == 0x80U) {
    --bytes;
  }
  return text.substr(0, bytes);
}

std::string excerpt(std::string_view text, std::size_t bytes) {
  constexpr std::size_t kLongestCharacter = 4;
  const std::string all = visible(text.substr(0, bytes + kLongestCharacter));
  const std::string part = shortened(all, bytes);
  return part.size() < all.size() ? part + "..." : part;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) {
      return parts;
    }
    text.remove_prefix(end + 1);
  }
}

bool is_visible(std::string_view text) {
  return visible(text) == text;
}

std::string_view nearest(std::string_view word, std::span<const std::string_view> candidates) {
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(1, word.size() / 2) + 1;
  for (const auto candidate : candidates) {
    // The distance cannot be less than the difference of the lengths.
    if (word.size() >= candidate.size() + best_distance) {
      continue;
    }
    const std::size_t candidate_distance = distance(word, candidate);
    // Nothing is suggested if the two words have no letter in common.
    if (candidate_distance < best_distance &&
        candidate_distance < std::max(word.size(), candidate.size())) {
      best_distance = candidate_distance;
      best = candidate;
    }
  }
  return best;
}

std::string did_you_mean(std::string_view word, std::span<const std::string_view> candidates) {
  const auto best = nearest(word, candidates);
  return best.empty() ? "" : fmt::format(" (did you mean `{}`?)", best);
}

std::string unknown_key(std::string_view name, std::span<const std::string_view> known) {
  return fmt::format("unknown key `{}`{}", excerpt(name), did_you_mean(name, known));
}

void append_csv_field(std::string& out, std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos && !text.empty()) {
    out += text;
    return;
  }
  out += '"';
  for (const char letter : text) {
    out.append(letter == '"' ? 2 : 1, letter);
  }
  out += '"';
}

std::string joined(std::span<const std::string_view> names) {
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string random_id() {
  std::random_device bits;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", bits(), bits(), bits(), bits());
}

}  // namespace oblique::protocol
