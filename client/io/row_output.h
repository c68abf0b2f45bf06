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

/// The reader of the output has closed it, for example `head`. This is no failure and needs no
/// message.
class ClosedPipe : public std::runtime_error {
 public:
  ClosedPipe() : std::runtime_error("the reader of the output has ended") {}
};

class Sink {
 public:
  Sink() = default;
  virtual ~Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  /// Throws ClosedPipe, or std::runtime_error with the reason.
  virtual void append(std::string_view bytes) = 0;
  /// Ends the output. Throws as `append` does.
  virtual void finish() {}
};

/// Writes all bytes to a descriptor; errors call it `name`. Throws as Sink::append does.
void write_all(int descriptor, std::string_view bytes, const std::string& name);

/// Standard output, written after the contents of std::cout. On a terminal control characters are
/// made visible (proto/text.h). With `may_page`, text longer than the screen goes through a pager:
/// $OBLIQUE_PAGER, else $PAGER, else `less -FRSX`; an empty value or `cat` means none. `finish` and
/// the destructor wait until the user leaves the pager; Ctrl-C goes to the pager meanwhile.
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
  std::string pager_command_;  // empty: no pager
  std::string first_screen_;   // held back until it exceeds the screen
  std::unique_ptr<ChildProcess> pager_;
  Descriptor to_pager_;
};

/// Whether output to `path` is written directly, because it is a device, a pipe or /dev/stdout.
/// Throws solver::InputError for a folder and for links that form a circle.
bool is_written_in_place(const std::string& path);

/// A file that is written atomically: it appears under its name when finished; until then the
/// previous file stays. An unfinished file leaves nothing behind on file systems with unnamed files
/// (not NFS). A link stays and its target is replaced. Devices and pipes are written directly.
class AtomicFile : public Sink {
 public:
  /// Throws solver::InputError with the name of the flag if the file cannot be created.
  explicit AtomicFile(const std::string& path, std::string_view flag = "--out");
  ~AtomicFile() override;

  void append(std::string_view bytes) override;
  void finish() override;

 private:
  void open_draft();

  std::string name_;  // named in errors
  std::string path_;  // target of the links
  bool is_in_place_ = false;
  std::string draft_;      // temporary name beside the file
  bool has_name_ = false;  // the file is visible under its temporary name
  Descriptor descriptor_;
};

/// Tables are for reading: numbers have six digits and are aligned at the point. CSV (RFC 4180,
/// with a header line), JSON (an array of objects) and JSON lines (an object per line) contain
/// every number as the shortest text that reads back as the same bits; NULL is an empty field or
/// null. In JSON the second of two columns of one name is called name_2, and lists stored as text
/// become arrays.
enum class Format { kTable, kCsv, kJson, kJsonLines };

/// `table`, `csv`, `json` and `jsonl`.
std::span<const std::string_view> format_names();
/// Index of `name` in `allowed`. Throws solver::InputError with the flag and the nearest name if it
/// is not there.
std::size_t choice_of(std::string_view flag, std::string_view name,
                      std::span<const std::string_view> allowed);
/// The format called `name`. Throws solver::InputError if it is not in `allowed`.
Format format_named(std::string_view name,
                    std::span<const std::string_view> allowed = format_names());

/// The format of --format or, if that is empty, of the ending of `file`, such as .csv; `usual` for
/// standard output (`file` empty) and files that are written directly. Throws solver::InputError
/// for other names and endings, and if the two contradict each other.
Format format_of_output(const std::string& flag, const std::string& file,
                        std::span<const std::string_view> allowed = format_names(),
                        Format usual = Format::kTable);

/// Meaning of the letters in modes.
inline constexpr const char* kModeLetters = "S stick, s slip; C compression, R restitution";

struct ShownColumn {
  std::string heading;    ///< name, with the unit in brackets if it is not the SI unit
  double per_unit = 1.0;  ///< shown value of 1 in SI units
};
/// How tables show a column with SI unit `unit` (empty: none or unknown). Small values are shown in
/// the units of the report of `solve`, such as microseconds.
ShownColumn shown_column(const std::string& name, const std::string& unit = {});
/// How tables show all columns of an answer.
std::vector<ShownColumn> shown_columns(const protocol::QueryReply& chunk);

struct OutputSettings {
  Format format = Format::kTable;
  std::string file = {};  ///< empty: standard output
  bool may_page = true;   ///< a long table on a terminal goes through a pager
  /// True: columns of a table that do not fit the terminal are left out; false: the last column is
  /// wrapped.
  bool may_leave_out = true;
  std::string way_to_all = "csv and json have all";  ///< how to see the columns that were left out
  std::vector<ShownColumn> shown = {};  ///< for tables; later columns have their names as headings
  std::size_t width = 0;                ///< longest line of a table in characters; 0: no limit
  std::size_t first_rows = 1000;        ///< rows of a table that determine the widths of columns
};

/// Formats the rows of one answer as they arrive, in constant memory.
class RowPrinter {
 public:
  virtual ~RowPrinter() = default;
  /// Appends the rows of a valid chunk (proto/wire). The first chunk, which may be empty, names the
  /// columns.
  virtual void print(const protocol::QueryReply& chunk, std::string& out) = 0;
  /// Appends what follows the last row.
  virtual void end(std::string& out) = 0;
};
std::unique_ptr<RowPrinter> make_printer(const OutputSettings& settings);

/// A whole answer as text; uses the settings of `make_printer`.
std::string text_of(const std::vector<protocol::QueryReply>& chunks,
                    const OutputSettings& settings);

/// Writes the rows of an answer to standard output, a pager (on a terminal) or a file (AtomicFile).
/// For rows that are computed here: write them into a protocol::ChunkWriter, `print` its chunks,
/// and `finish`.
class RowOutput {
 public:
  /// On a terminal sets `width` and `first_rows`. Throws solver::InputError if the file cannot be
  /// created.
  explicit RowOutput(OutputSettings settings);

  /// Throws ClosedPipe when the reader has closed the output, std::runtime_error for a failed
  /// write.
  void print(const protocol::QueryReply& chunk);
  /// Ends the output. Throws as `print` does. Without it no file appears.
  void finish();

  /// Whether the output goes through a pager, which the user may leave at any time.
  bool is_paged() const;

 private:
  std::unique_ptr<Sink> sink_;
  std::unique_ptr<RowPrinter> printer_;
};

void print(std::ostream& out, const protocol::Table& rows, Format format);
/// Prints a whole table to standard output. In tables, and on a terminal, control characters are
/// made visible (proto/text.h); in JSON they are escaped; CSV in a file or pipe contains texts
/// unchanged.
void print_out(const protocol::Table& rows, Format format);

/// Appends a number as the shortest text that reads back as the same bits.
void append_number(std::string& out, double value);
void append_number(std::string& out, std::int64_t value);

/// Appends a field of CSV, quoted if necessary (RFC 4180). An empty text is quoted, too, because an
/// empty field means NULL.
void append_csv_field(std::string& out, std::string_view text);

}  // namespace oblique::client
