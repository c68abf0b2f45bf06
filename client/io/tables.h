#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "client/io/row_output.h"
#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// How tables for people show the column of that name, whose SI unit is `unit` (empty: none, or
/// unknown): columns with small values in the units of `solve`'s report, as microseconds.
ShownColumn shown_column(const std::string& name, const std::string& unit = {});
/// The same for all columns of an answer.
std::vector<ShownColumn> shown_columns(const protocol::QueryReply& chunk);

/// Prints a whole table in one of the formats of made_printer.
void print(std::ostream& out, const protocol::Table& rows, Format format);
/// The same to standard output. In tables and on a terminal control characters are made visible
/// (proto/text.h); in JSON they are escaped; CSV in a file or a pipe holds texts byte for byte.
void print_out(const protocol::Table& rows, Format format);

/// Appends a cell to a row.
template <class T>
void add_value(protocol::Row& row, const T& value) {
  row.emplace_back(value);
}

}  // namespace oblique::client
