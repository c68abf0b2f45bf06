#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>

#include "proto/oblique.pb.h"

namespace oblique::client {

enum class Format { kTable, kCsv, kJson, kMarkdown };

/// The format of that name: `table`, `csv`, `json` or `markdown`. Throws solver::InputError for
/// other names.
Format format_named(std::string_view name);

/// Whether it is for reading, not for other programs.
inline bool is_for_people(Format format) {
  return format == Format::kTable || format == Format::kMarkdown;
}

/// Prints columns and rows. Tables, plain or in Markdown, are for reading: numbers of
/// six digits, aligned. CSV (RFC 4180,
/// a header line) and JSON (an array of objects) hold every number so that it reads back as the
/// same bits; NULL is an empty field, respectively null. In JSON the second of two columns of one
/// name is called name_2, and lists that columns pack as text are arrays; see packed_columns.h.
void print(std::ostream& out, const protocol::QueryReply& rows, Format format);

/// The same to standard output. In tables and on a terminal texts from outside are made visible
/// (proto/text.h); in JSON their characters are escaped as JSON does. CSV in a file or a
/// pipe holds them byte for byte.
void print_out(const protocol::QueryReply& rows, Format format);

/// One field of CSV, in quotes where it needs them.
std::string csv_field(std::string_view text);

/// Appends one value to a row of an answer.
void add_value(protocol::Row& row, const std::string& text);
void add_value(protocol::Row& row, double value);
void add_value(protocol::Row& row, std::int64_t value);

}  // namespace oblique::client
