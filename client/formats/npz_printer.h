#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/formats/npy_column.h"
#include "client/formats/row_printer.h"

namespace oblique::client {

/// An array of an archive for NumPy.
struct NamedColumn {
  std::string name;
  std::unique_ptr<NpyColumn> column;
};

/// Writes the archive of these arrays. Throws as NpyColumn::write does.
void write_npz(const std::vector<NamedColumn>& columns, Sink& sink);

/// See made_printer. Nothing goes to the sink before the end.
class NpzPrinter : public RowPrinter {
 public:
  /// Columns are kept in files without a name in `folder`; empty: in that for temporary files.
  /// `usual` as in PrinterSettings.
  NpzPrinter(Sink& sink, std::string folder, std::vector<protocol::CellKind> usual)
      : sink_(sink), folder_(std::move(folder)), usual_(std::move(usual)) {}

  void print(const protocol::QueryReply& chunk) override;
  void end() override;

 private:
  Sink& sink_;
  std::string folder_;
  std::vector<protocol::CellKind> usual_;
  std::vector<NamedColumn> columns_;
};

}  // namespace oblique::client
