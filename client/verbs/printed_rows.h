#pragma once

#include <cstdint>
#include <string>

#include <CLI/CLI.hpp>

#include "client/output/printer.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// Adds --format.
void add_format_flag(CLI::App& verb, std::string& format);

/// Prints rows to standard output. When the source cut them off, says so on standard error and
/// gives kFailed, else kDone.
int print_whole(const protocol::QueryReply& rows, Format format);

/// `text` as one word of a shell.
std::string shell_word(const std::string& text);

/// Prints the first rows of a study as a table, in the units that people read. When there are more
/// `points`, says so on standard error.
void print_first(const protocol::QueryReply& rows, std::uint64_t points);

}  // namespace oblique::client
