#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/io/sink.h"
#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// Tables are for reading: numbers have six digits and are aligned at the point. CSV (RFC 4180, a
/// header line), JSON (an array of objects) and JSON lines (an object a line) hold every number as
/// the shortest text that reads back as the same bits; NULL is an empty field, respectively null.
/// In JSON the second of two columns of one name is called name_2, and lists that columns store as
/// text are arrays.
enum class Format { kTable, kCsv, kJson, kJsonLines };

/// `table`, `csv`, `json` and `jsonl`.
std::span<const std::string_view> format_names();
/// The format of that name. Throws solver::InputError for names that are not `allowed`.
Format format_named(std::string_view name,
                    std::span<const std::string_view> allowed = format_names());

/// The format that --format names or, where that is empty, the end of the file's name, as .csv;
/// `usual` for standard output (`file` empty) and for what is written in place. Throws
/// solver::InputError for other names and ends, and where the two contradict each other.
Format format_of_output(const std::string& flag, const std::string& file,
                        std::span<const std::string_view> allowed = format_names(),
                        Format usual = Format::kTable);

/// What the letters of modes mean.
inline constexpr const char* kModeLetters = "S stick, s slip; C compression, R restitution";

/// How tables show a column.
struct ShownColumn {
  std::string heading;    ///< its name, with the unit in brackets where that is not the SI one
  double per_unit = 1.0;  ///< shown value of 1 in SI units
};

struct OutputSettings {
  Format format = Format::kTable;
  std::string file = {};  ///< empty: standard output
  bool may_page = true;   ///< a long table on a terminal goes to a pager
  /// A table that does not fit the terminal lacks columns; else sentences in the last column are
  /// wrapped.
  bool may_leave_out = true;
  std::string way_to_all = "csv and json have all";  ///< how to see columns that were left out
  std::vector<ShownColumn> shown = {};  ///< of a table; columns after these by their names
  std::size_t width = 0;                ///< most characters of a line of a table; 0: no limit
  std::size_t first_rows = 1000;        ///< of a table, which determine the widths of columns
};

/// Formats the rows of one answer as they come. Its memory does not grow with them.
class RowPrinter {
 public:
  virtual ~RowPrinter() = default;
  /// Appends the rows of a sound chunk (proto/wire); the first one, with or without rows, names the
  /// columns.
  virtual void print(const protocol::QueryReply& chunk, std::string& out) = 0;
  /// Appends what follows the last row.
  virtual void end(std::string& out) = 0;
};
std::unique_ptr<RowPrinter> make_printer(const OutputSettings& settings);
std::unique_ptr<RowPrinter> make_table_printer(const OutputSettings& settings);

/// Number of characters of a UTF-8 text.
std::size_t width_of(std::string_view text);

/// A whole answer as text; of the settings those for `make_printer` matter.
std::string text_of(const std::vector<protocol::QueryReply>& chunks,
                    const OutputSettings& settings);

/// Where the rows of an answer go: standard output, a pager where that is a terminal, or a file,
/// which appears when all is written (AtomicFile).
///
/// For rows that are computed here: write them into a protocol::ChunkWriter, `print` what it gives
/// now and then, and `finish`.
class RowOutput {
 public:
  /// A terminal sets `width` and `first_rows`. Throws solver::InputError for a file that cannot be
  /// created.
  explicit RowOutput(OutputSettings settings);

  /// Throws ClosedPipe when the reader has ended, std::runtime_error for a failed write.
  void print(const protocol::QueryReply& chunk);
  /// All rows were printed. Throws likewise. Without it no file appears.
  void finish();

  /// Whether a pager shows it, which the user may leave at any time.
  bool is_paged() const;

 private:
  std::unique_ptr<Sink> sink_;
  std::unique_ptr<RowPrinter> printer_;
};

/// Appends a number as the shortest text that reads back as the same bits.
void append_number(std::string& out, double value);
void append_number(std::string& out, std::int64_t value);

/// Appends one field of CSV, in quotes where it needs them (RFC 4180); an empty text is quoted too,
/// because an empty field is NULL.
void append_csv_field(std::string& out, std::string_view text);

}  // namespace oblique::client
