#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "proto/program/configuration/configuration_file.h"

// Options of a program as they stand in a file.
namespace oblique::protocol {

/// What a value of the option is in a file. An option is a number when its type name says so.
ValueKind kind_of(const CLI::Option& option);

/// Whether the option takes several values.
bool takes_list(const CLI::Option& option);

/// A line "key = value  # origin" that sets the option to what it is; a comment when it has no
/// value.
std::string printed_setting(const CLI::Option& option, const std::string& key,
                            const std::string& origin);

/// The text made visible (text.h), for a comment.
std::string one_line(const std::string& text);

}  // namespace oblique::protocol
