#pragma once

#include "client/formats/row_printer.h"

namespace oblique::client {

/// See made_printer.
class CsvPrinter : public RowPrinter {
 public:
  explicit CsvPrinter(Sink& sink) : sink_(sink) {}

  void print(const protocol::QueryReply& chunk) override;
  void end() override {}

 private:
  Sink& sink_;
  bool has_header_ = false;
};

}  // namespace oblique::client
