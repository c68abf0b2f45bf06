#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "client/output/printer.h"
#include "client/service/source.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// Adds --format.
void add_format_flag(CLI::App& verb, std::string& format);

/// Where and how a long answer is printed.
struct OutputFlags {
  std::string format;  // empty: as the file's name ends, or a table
  std::string file;
  bool no_pager = false;
};
/// Adds --format, --out and --no-pager.
void add_output_flags(CLI::App& verb, OutputFlags& flags);

/// What they name; throws solver::InputError as format_of_output does.
Format format_of(const OutputFlags& flags);

/// Prints an answer as it comes, tables for people in the units that people read if
/// `in_shown_units`; `way_to_all` as in PrinterSettings. Gives the exit code. Throws what the
/// source throws, and what RowOutput does.
int print_stream(RowStream& stream, const OutputFlags& flags, bool in_shown_units,
                 const std::string& way_to_all = "csv and json have all");

/// `text` as one word of a shell.
std::string shell_word(const std::string& text);

/// Prints the first rows of a study, given in chunks, as a table in the units that people read.
/// When there are more `points`, says so on standard error.
void print_first(const std::vector<protocol::QueryReply>& chunks, std::uint64_t points);

}  // namespace oblique::client
