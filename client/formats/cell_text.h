#pragma once

#include <string>
#include <string_view>

#include "proto/wire/chunk.h"

namespace oblique::client {

/// Appends a number as the shortest text that reads back as the same bits.
void append_number(std::string& out, double value);
void append_number(std::string& out, std::int64_t value);

/// Appends one field of CSV, in quotes where it needs them (RFC 4180); an empty text is quoted too,
/// for an empty field is NULL.
void append_csv_field(std::string& out, std::string_view text);

/// Appends a text as JSON has it, in quotes. Characters that a terminal would act on are written as
/// \u...., and bytes that are not UTF-8 become U+FFFD.
void append_json_text(std::string& out, std::string_view text);

/// Appends a finite number so that readers of JSON take it for a real one: 7.0. Else `null`.
void append_json_real(std::string& out, double value);

/// A value as tables for people show it, on one line: six digits, NULL as a dash.
std::string table_cell(const protocol::Cell& cell);

/// Columns of a terminal that a text takes: its characters, each as wide as any other.
std::size_t width_of(std::string_view text);

}  // namespace oblique::client
