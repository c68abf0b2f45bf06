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

/// The reader of the output, for example `head`, has closed it. This is no failure.
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
  /// Ends the output. Throws the same errors as `append`.
  virtual void finish() {}
};

/// Writes all bytes to a descriptor that error messages call `name`. Throws the same errors as
/// Sink::append.
void write_all(int descriptor, std::string_view bytes, const std::string& name);

/// Standard output, written after the contents of std::cout. On a terminal, control characters are
/// made visible (proto/text.h). With `may_page`, text longer than the screen goes through a pager:
/// $OBLIQUE_PAGER, else $PAGER, else `less -FRSX`; an empty value or `cat` means no pager. `finish`
/// and the destructor wait until the user quits the pager; until then Ctrl-C goes to the pager.
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
  std::string first_screen_;   // text held back until it exceeds the screen
  std::unique_ptr<ChildProcess> pager_;
  Descriptor to_pager_;
};

/// Whether output to `path` is written directly, because it is a device, a pipe or /dev/stdout.
/// Throws solver::InputError for a folder and for circular links.
bool is_written_in_place(const std::string& path);

/// A file that is written atomically: it appears under its name when finished; until then the
/// previous file remains. An unfinished file leaves nothing behind, except on file systems without
/// unnamed files (NFS). A symbolic link is kept and its target replaced. Devices and pipes are
/// written directly.
class AtomicFile : public Sink {
 public:
  /// Throws solver::InputError, which names the flag, if the file cannot be created.
  explicit AtomicFile(const std::string& path, std::string_view flag = "--out");
  ~AtomicFile() override;

  void append(std::string_view bytes) override;
  void finish() override;

 private:
  void open_draft();

  std::string name_;  // name in error messages
  std::string path_;  // path after following symbolic links
  bool is_in_place_ = false;
  std::string draft_;      // path of the temporary file, in the same folder
  bool has_name_ = false;  // the temporary file is visible under its name
  Descriptor descriptor_;
};

/// Output formats. Tables are for people: numbers have six digits and are aligned at the decimal
/// point. CSV (RFC 4180, with a header line), JSON (an array of objects) and JSON lines (an object
/// per line) are for programs: each number is the shortest text that reads back as the same bits;
/// NULL is an empty field or null. In JSON, if two columns have the same name, the second is called
/// name_2, and lists stored as text become arrays.
enum class Format { kTable, kCsv, kJson, kJsonLines };

/// Returns `table`, `csv`, `json` and `jsonl`.
std::span<const std::string_view> format_names();
/// Returns the index of `name` in `allowed`. Throws solver::InputError, with the flag and the
/// nearest allowed name, if there is none.
std::size_t choice_of(std::string_view flag, std::string_view name,
                      std::span<const std::string_view> allowed);
/// Returns the format called `name`. Throws solver::InputError if it is not in `allowed`.
Format format_named(std::string_view name,
                    std::span<const std::string_view> allowed = format_names());

/// Returns the format that --format names. Without --format, the ending of `file`, such as .csv,
/// gives the format. Standard output (`file` is empty) and files that are written directly then
/// have the format `usual`. Throws solver::InputError for other names and endings, and if the flag
/// contradicts the ending.
Format format_of_output(const std::string& flag, const std::string& file,
                        std::span<const std::string_view> allowed = format_names(),
                        Format usual = Format::kTable);

/// Explains the letters of modes.
inline constexpr const char* kModeLetters = "S stick, s slip; C compression, R restitution";

struct ShownColumn {
  std::string heading;    ///< name, with the unit in brackets unless it is the SI unit
  double per_unit = 1.0;  ///< factor from SI units to shown units
};
/// Returns how tables show a column with SI unit `unit` (empty: none or unknown). Small values have
/// the units of the report that `solve` prints, such as microseconds.
ShownColumn shown_column(const std::string& name, const std::string& unit = {});
/// Returns how tables show the columns of an answer.
std::vector<ShownColumn> shown_columns(const protocol::QueryReply& chunk);

struct OutputSettings {
  Format format = Format::kTable;
  std::string file = {};  ///< empty: standard output
  bool may_page = true;   ///< long tables on a terminal may go through a pager
  /// True: a table omits columns that do not fit the terminal. False: it wraps the last column.
  bool may_leave_out = true;
  std::string way_to_all = "csv and json have all";  ///< advice on how to see omitted columns
  /// How tables show the columns. Columns beyond this list have their names as headings.
  std::vector<ShownColumn> shown = {};
  std::size_t width = 0;          ///< maximum length of a table line in characters; 0: no limit
  std::size_t first_rows = 1000;  ///< the first rows of a table, which set its column widths
};

/// Formats the rows of one answer as they arrive. Needs constant memory.
class RowPrinter {
 public:
  virtual ~RowPrinter() = default;
  /// Appends the rows of a valid chunk (proto/wire) to `out`. The first chunk, which may have no
  /// rows, names the columns.
  virtual void print(const protocol::QueryReply& chunk, std::string& out) = 0;
  /// Appends the text after the last row to `out`.
  virtual void end(std::string& out) = 0;
};
std::unique_ptr<RowPrinter> make_printer(const OutputSettings& settings);

/// Formats a whole answer as text; the settings are those of `make_printer`.
std::string text_of(const std::vector<protocol::QueryReply>& chunks,
                    const OutputSettings& settings);

/// Writes the rows of an answer to standard output, a pager (on a terminal) or a file (AtomicFile).
/// A caller that computes rows itself writes them into a protocol::ChunkWriter, passes its chunks
/// to `print`, and calls `finish`.
class RowOutput {
 public:
  /// Sets `width` and `first_rows` for a terminal. Throws InputError if the file cannot be created.
  explicit RowOutput(OutputSettings settings);

  /// Throws ClosedPipe if the reader closed the output, std::runtime_error if writing fails.
  void print(const protocol::QueryReply& chunk);
  /// Ends the output. A file appears only after this call. Throws the same errors as `print`.
  void finish();

  /// Whether the output goes through a pager, which the user may quit at any time.
  bool is_paged() const;

 private:
  std::unique_ptr<Sink> sink_;
  std::unique_ptr<RowPrinter> printer_;
};

void print(std::ostream& out, const protocol::Table& rows, Format format);
/// Prints a whole table to standard output. Control characters are made visible (proto/text.h) in
/// tables and on a terminal, and escaped in JSON; CSV in a file or pipe contains texts unchanged.
void print_out(const protocol::Table& rows, Format format);

/// Appends a number as the shortest text that reads back as the same bits.
void append_number(std::string& out, double value);
void append_number(std::string& out, std::int64_t value);

}  // namespace oblique::client
