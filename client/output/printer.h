#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "client/io/row_output.h"
#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// Prints columns and rows that are there already, in one of the formats of made_printer.
void print(std::ostream& out, const protocol::Table& rows, Format format);

/// The same to standard output. In tables and on a terminal texts from outside are made visible
/// (proto/text.h); in JSON their characters are escaped as JSON does. CSV in a file or a
/// pipe holds them byte for byte. Throws solver::InputError for NumPy's archive on a terminal.
void print_out(const protocol::Table& rows, Format format);

/// One field of CSV, in quotes where it needs them.
std::string csv_field(std::string_view text);

/// Pads headings and texts of these columns from the left to one width: numbers that are texts
/// already.
void align_right(protocol::Table& rows, const std::vector<std::string>& columns);

/// Appends one value to a row of an answer.
void add_value(protocol::Row& row, const std::string& text);
void add_value(protocol::Row& row, double value);
void add_value(protocol::Row& row, std::int64_t value);

}  // namespace oblique::client
