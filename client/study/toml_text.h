#pragma once

#include <string>

#include <toml++/toml.h>

// Values of a TOML file in sentences for people.
namespace oblique::client {

/// "a table", "a list", "a string", "a boolean", "a number" or "a date or time".
std::string kind_of(const toml::node& node);

/// A value as the file has it, shortened for a message.
std::string shown(const toml::node& node);

bool is_number(const toml::node& node);

}  // namespace oblique::client
