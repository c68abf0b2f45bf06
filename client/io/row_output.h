#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <ostream>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "client/io/child_process.h"
#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// The reader of the output has ended, as `head` does. This is no failure and needs no message.
class ClosedPipe : public std::runtime_error {
 public:
  ClosedPipe() : std::runtime_error("the reader of the output has ended") {}
};

/// Receives the bytes of an output.
class Sink {
 public:
  Sink() = default;
  virtual ~Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  /// Throws ClosedPipe, or std::runtime_error with the reason.
  virtual void append(std::string_view bytes) = 0;
  /// The output is complete. Throws as `append` does.
  virtual void finish() {}
};

/// Writes all bytes to a descriptor, called `name` in errors. Throws as Sink::append.
void write_all(int descriptor, std::string_view bytes, const std::string& name);

/// Standard output, after what std::cout was given. On a terminal control characters are made
/// visible (proto/text.h) and, with `may_page`, text longer than the screen goes through a pager:
/// $OBLIQUE_PAGER, else $PAGER, else `less -FRSX`; none where that is empty or `cat`. `finish` and
/// the destructor wait until the user has left the pager, which gets Ctrl-C meanwhile.
class StandardOutput : public Sink {
 public:
  explicit StandardOutput(bool may_page = false);
  ~StandardOutput() override;

  void append(std::string_view bytes) override;
  void finish() override;
  bool is_paged() const { return pager_ != nullptr; }

 private:
  void start_pager();
  void wait_for_pager();

  bool is_terminal_;
  std::string pager_command_;  // empty: text is written at once
  std::string first_screen_;   // held back until it is known to be longer than the screen
  std::unique_ptr<ChildProcess> pager_;
  Descriptor to_pager_;
};

/// Whether output to that name is written as it comes: to a device, a pipe or /dev/stdout. Throws
/// solver::InputError for a folder and for links that form a circle.
bool is_written_in_place(const std::string& path);

/// A file that appears under its name when it is finished. Until then, and if that never happens,
/// the previous file stays, and nothing is left beside it on file systems that have nameless files
/// (NFS has none). A link stays, and its target is the file. What is no regular file is written in
/// place.
class AtomicFile : public Sink {
 public:
  /// Throws solver::InputError, which says that `flag` named it, when it cannot be created.
  explicit AtomicFile(const std::string& path, std::string_view flag = "--out");
  ~AtomicFile() override;

  void append(std::string_view bytes) override;
  void finish() override;

 private:
  void open_draft();

  std::string name_;  // in errors
  std::string path_;  // behind the links
  bool is_in_place_ = false;
  std::string draft_;      // temporary name beside the file
  bool has_name_ = false;  // the draft has its temporary name
  Descriptor descriptor_;
};

/// Tables are for reading: numbers have six digits and are aligned at the point. CSV (RFC 4180, a
/// header line), JSON (an array of objects) and JSON lines (an object a line) hold every number as
/// the shortest text that reads back as the same bits; NULL is an empty field, respectively null.
/// In JSON the second of two columns of one name is called name_2, and lists that columns store as
/// text are arrays.
enum class Format { kTable, kCsv, kJson, kJsonLines };

/// `table`, `csv`, `json` and `jsonl`.
std::span<const std::string_view> format_names();
/// The index of `name` among `allowed`. Throws solver::InputError, which names the flag and the
/// nearest, for another name.
std::size_t choice_of(std::string_view flag, std::string_view name,
                      std::span<const std::string_view> allowed);
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
/// The column of that name, whose SI unit is `unit` (empty: none, or unknown): columns with small
/// values are shown in the units of `solve`'s report, as microseconds.
ShownColumn shown_column(const std::string& name, const std::string& unit = {});
/// The same for all columns of an answer.
std::vector<ShownColumn> shown_columns(const protocol::QueryReply& chunk);

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

/// Prints a whole table.
void print(std::ostream& out, const protocol::Table& rows, Format format);
/// The same to standard output. In tables and on a terminal control characters are made visible
/// (proto/text.h); in JSON they are escaped; CSV in a file or a pipe holds texts byte for byte.
void print_out(const protocol::Table& rows, Format format);

/// Appends a number as the shortest text that reads back as the same bits.
void append_number(std::string& out, double value);
void append_number(std::string& out, std::int64_t value);

/// Appends one field of CSV, in quotes where it needs them (RFC 4180); an empty text is quoted too,
/// because an empty field is NULL.
void append_csv_field(std::string& out, std::string_view text);

}  // namespace oblique::client
