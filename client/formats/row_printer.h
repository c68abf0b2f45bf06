#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/formats/sink.h"
#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

enum class Format { kTable, kCsv, kJson, kJsonLines };

/// The format of that name: `table`, `csv`, `json` or `jsonl`. Throws solver::InputError for
/// other names.
Format format_named(std::string_view name);
/// Names of all.
std::span<const std::string_view> format_names();

/// The format that --format names or, where that is empty, the end of the file's name: .csv, .json
/// or .jsonl; a table for standard output (`file` empty), and for what is written in
/// place, as /dev/stdout. Throws solver::InputError for names and ends of no format, and for a name
/// that ends as another format than the flag names.
Format format_of_output(const std::string& flag, const std::string& file);

/// The sentence for a file whose name ends as format `ending` while --format names `flag`; empty
/// where both are one.
std::string contradiction(std::string_view flag, std::string_view ending, const std::string& file);

/// How tables for people show a column.
struct ShownColumn {
  std::string heading;    ///< its name, with the unit in brackets where that is not the SI one
  double per_unit = 1.0;  ///< so much is shown for 1 in SI units
};

/// Prints the rows of one answer as they come. What it holds does not grow with them.
class RowPrinter {
 public:
  virtual ~RowPrinter() = default;

  /// The rows of a sound chunk (proto/wire); the first one, with or without rows, names the
  /// columns.
  virtual void print(const protocol::QueryReply& chunk) = 0;
  /// There are no more rows. What was printed is nothing whole before.
  virtual void end() = 0;
};

struct PrinterSettings {
  /// Of a table: a line has so many characters at most; 0: as many as it takes.
  std::size_t width = 0;
  /// Of a table with such a width: no column is left out. Texts of the last one, where they are
  /// sentences, go on in further lines.
  bool keeps_all = false;
  /// Of a table: how to see columns that were left out.
  std::string way_to_all = "csv and json have all";
  /// Of a table: widths of columns are those of so many rows at its beginning.
  std::size_t first_rows = 1000;
  /// Of a table: how each column is shown; where there is none, by its name.
  std::vector<ShownColumn> shown = {};
};

/// Prints to `sink`, which must outlive it.
///
/// Tables are for reading: numbers have six digits and are aligned at the point. CSV (RFC 4180, a
/// header line), JSON (an array of objects) and JSON lines (an object a line) hold every number as
/// the shortest text that reads back as the same bits; NULL is an empty field, respectively null.
/// In JSON the second of two columns of one name is called name_2, and lists that columns pack as
/// text are arrays; see packed_columns.h.
std::unique_ptr<RowPrinter> made_printer(Format format, Sink& sink, PrinterSettings settings = {});

/// A key stands for one value only: of equal names the second becomes name_2, and so on.
std::vector<std::string> distinct_names(const protocol::QueryReply& chunk);

}  // namespace oblique::client
