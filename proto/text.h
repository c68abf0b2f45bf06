#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::protocol {

/// Escapes text from outside that people will read: names, values of a database, keys of files,
/// messages of other processes. Escapes everything that would control a terminal, forge a log line
/// or be invisible: control characters (C0, DEL and C1), marks of writing direction, zero-width
/// characters, Unicode's line and paragraph separators, and bytes that are not UTF-8. ESC becomes
/// \x1b, U+202E \u202e, a line break
/// .
std::string visible(std::string_view text);

/// As `visible`, but keeps line breaks, for messages of several lines.
std::string visible_lines(std::string_view text);

/// Whether `visible` would not change `text`.
bool is_visible(std::string_view text);

/// Whether all of `text` is UTF-8.
bool is_utf8(std::string_view text);

/// The first characters of a UTF-8 text, at most `bytes` in all.
std::string shortened(const std::string& text, std::size_t bytes);

/// At most `bytes` of visible(text), for an error message, followed by "..." if it was cut.
std::string excerpt(std::string_view text, std::size_t bytes = 80);

/// The parts of `text` between separators, empty ones included.
std::vector<std::string_view> split(std::string_view text, char separator);

/// Length [bytes] and code point of the UTF-8 character at the start of `text`; length 0 if there
/// is none.
struct Character {
  std::size_t bytes;
  char32_t code;
};
Character first_character(std::string_view text);

/// The candidate with the smallest edit distance to `word`, ignoring case; empty if none is close
/// enough to be a likely slip.
std::string_view nearest(std::string_view word, std::span<const std::string_view> candidates);

/// " (did you mean `x`?)" with the nearest candidate, or an empty text.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> candidates);

/// "unknown key `muu` (did you mean `mu`?)".
std::string unknown_key(std::string_view name, std::span<const std::string_view> known);

std::string joined(std::span<const std::string_view> names);

}  // namespace oblique::protocol
