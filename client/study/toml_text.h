#pragma once

#include <string>
#include <string_view>

#include <toml++/toml.h>

// Values of a TOML file in sentences for people.
namespace oblique::client {

/// "a table", "a list", "a string", "a boolean", "a number" or "a date or time".
std::string kind_of(const toml::node& node);

/// A value as the file has it, shortened for a message.
std::string shown(const toml::node& node);

/// Throws solver::InputError, with the place, for a key of more than `kMostKeyParts` parts with
/// dots between them, also in the heading of a table: the parser would go as deep.
void check_keys(std::string_view text, const std::string& file);
inline constexpr int kMostKeyParts = 8;

bool is_number(const toml::node& node);

}  // namespace oblique::client
