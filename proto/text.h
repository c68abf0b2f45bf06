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
/// \x1b, U+202E \u202e, a line break \n.
std::string visible(std::string_view text);

/// Works like `visible`, but keeps line breaks, for messages of several lines.
std::string visible_lines(std::string_view text);

/// Returns whether `visible` would leave `text` unchanged.
bool is_visible(std::string_view text);

/// Returns whether all of `text` is UTF-8.
bool is_utf8(std::string_view text);

/// Returns the first characters of a UTF-8 text, at most `bytes` bytes in all.
std::string shortened(const std::string& text, std::size_t bytes);

/// Returns at most `bytes` bytes of visible(text), for an error message, and "..." if it was cut.
std::string excerpt(std::string_view text, std::size_t bytes = 80);

/// Returns the parts of `text` between separators. Parts may be empty.
std::vector<std::string_view> split(std::string_view text, char separator);

/// Length [bytes] and code point of the UTF-8 character at the start of a text. The length is 0 if
/// there is no valid character.
struct Character {
  std::size_t bytes;
  char32_t code;
};
Character first_character(std::string_view text);

/// Returns the candidate with the smallest edit distance to `word`, ignoring case; empty if no
/// candidate is so close that `word` may be a misspelling of it.
std::string_view nearest(std::string_view word, std::span<const std::string_view> candidates);

/// Returns " (did you mean `x`?)" with the nearest candidate, or an empty text.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> candidates);

/// Returns a message such as "unknown key `muu` (did you mean `mu`?)".
std::string unknown_key(std::string_view name, std::span<const std::string_view> known);

/// Appends a field of CSV. Quotes it if necessary (RFC 4180) and if it is empty: `""` is not NULL.
void append_csv_field(std::string& out, std::string_view text);

std::string joined(std::span<const std::string_view> names);

/// Returns 128 random bits in hexadecimal digits.
std::string random_id();

}  // namespace oblique::protocol
