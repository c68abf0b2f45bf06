#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::protocol {

/// `text` with everything written out that would steer a terminal, forge a line of a log or not be
/// seen: control characters (C0, DEL and C1), the marks that turn the direction of writing,
/// zero-width characters, Unicode's line and paragraph separators, and bytes that are not UTF-8.
/// ESC becomes \x1b, U+202E \u202e, a line break \n. All other text stays as it is. For whatever
/// people read that comes from outside: names, values of a database, keys of files, messages of
/// other processes.
std::string visible(std::string_view text);

/// The same, but line breaks stay: for messages of several lines.
std::string visible_lines(std::string_view text);

/// Whether `visible` leaves `text` as it is.
bool is_visible(std::string_view text);

/// Whether `text` is UTF-8 from end to end.
bool is_utf8(std::string_view text);

/// The beginning of a UTF-8 text, at most `bytes` long, without half a character at its end.
std::string shortened(const std::string& text, std::size_t bytes);

/// At most `bytes` of `text` as `visible` writes it, for an error; "..." stands for the rest.
std::string excerpt(std::string_view text, std::size_t bytes = 80);

/// The parts of `text` between separators: one more than there are separators, empty ones too.
std::vector<std::string_view> split(std::string_view text, char separator);

/// Length in bytes of the UTF-8 character at the start of `text`, and its code point; length 0 when
/// there is none.
struct Character {
  std::size_t bytes;
  char32_t code;
};
Character first_character(std::string_view text);

/// The candidate that differs least from `word` by insertions, deletions and replacements of
/// letters, capitals alike; empty when none is near enough to be what was meant.
std::string_view nearest(std::string_view word, std::span<const std::string_view> candidates);

/// " (did you mean `x`?)" with the nearest candidate, or nothing.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> candidates);

/// "unknown key `muu` (did you mean `mu`?)", for the beginning of a sentence.
std::string unknown_key(std::string_view name, std::span<const std::string_view> known);

/// Names for a sentence: "a, b, c".
std::string joined(std::span<const std::string_view> names);

}  // namespace oblique::protocol
