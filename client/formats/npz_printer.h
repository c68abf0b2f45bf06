#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/formats/npy_column.h"
#include "client/formats/row_printer.h"

namespace oblique::client {

/// See made_printer. Nothing goes to the sink before the end.
class NpzPrinter : public RowPrinter {
 public:
  /// Columns are kept in files without a name in `folder`; empty: in that for temporary files.
  NpzPrinter(Sink& sink, std::string folder) : sink_(sink), folder_(std::move(folder)) {}

  void print(const protocol::QueryReply& chunk) override;
  void end() override;

 private:
  Sink& sink_;
  std::string folder_;
  std::vector<std::string> names_;
  std::vector<std::unique_ptr<NpyColumn>> columns_;
};

}  // namespace oblique::client
