#pragma once

#include <span>
#include <string>
#include <string_view>

namespace oblique::protocol {

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
