#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/formats/row_printer.h"
#include "client/formats/sink.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

struct OutputSettings {
  Format format = Format::kTable;
  std::string file = {};      ///< empty: standard output
  bool may_page = true;       ///< a long table on a terminal goes to a pager
  bool may_leave_out = true;  ///< a table that does not fit the terminal lacks columns
  std::string way_to_all = PrinterSettings().way_to_all;  ///< see PrinterSettings
  std::vector<ShownColumn> shown = {};                    ///< see PrinterSettings
};

/// Where the rows of an answer go: standard output, a pager where that is a terminal, or a file,
/// which appears whole, under its name, at the end only.
///
/// For rows that are computed here: write them into a protocol::ChunkWriter, `print` what it gives
/// now and then, and `finish`.
class RowOutput {
 public:
  /// Throws solver::InputError for a file that cannot be made.
  explicit RowOutput(OutputSettings settings);
  ~RowOutput();

  /// A chunk of rows (proto/wire); the first names the columns. Throws ClosedPipe when nobody reads
  /// any more, and std::runtime_error for what cannot be written.
  void print(const protocol::QueryReply& chunk);
  /// All rows were printed. Throws likewise. Without it what was printed is no answer, and a file
  /// does not appear.
  void finish();

  /// Whether a person reads it in a pager, and may leave that when he has seen enough.
  bool is_paged() const;

 private:
  std::unique_ptr<Sink> sink_;
  std::unique_ptr<RowPrinter> printer_;
};

}  // namespace oblique::client
