#pragma once

#include <string>
#include <vector>

#include "client/formats/row_printer.h"

namespace oblique::client {

/// What the letters of modes mean.
inline constexpr const char* kModeLetters = "S stick, s slip; C compression, R restitution";

/// See made_printer. Widths are those of the first rows; a later value that is wider shifts the
/// rest of its line. Where lines would be too long, texts are shortened, then columns left out from
/// the right, which a line below the table says. Another one says what the letters of a
/// mode mean.
class TablePrinter : public RowPrinter {
 public:
  TablePrinter(Sink& sink, PrinterSettings settings)
      : sink_(sink), settings_(std::move(settings)) {}

  void print(const protocol::QueryReply& chunk) override;
  void end() override;

 private:
  struct Value {
    std::string text;
    bool is_number;
  };
  struct Column {
    std::string heading;
    double per_unit = 1.0;
    std::size_t width = 0;
    std::size_t before_point = 0;  // of numbers
    std::size_t after_point = 0;   // the point included
    bool has_numbers = false;
    bool is_left_out = false;
  };
  using Line = std::vector<Value>;

  void begin(const protocol::QueryReply& chunk);
  void widen(const Line& line);
  void fit();
  std::size_t line_width() const;
  bool wraps(const Column& column) const;
  void print_head();
  void print_first_rows();
  void print_line(const Line& line);
  void print_cells(const std::vector<std::string>& cells, const std::string& end = {});

  Sink& sink_;
  PrinterSettings settings_;
  std::vector<Column> columns_;
  std::vector<Line> first_;  // that are kept until the widths are known
  bool has_begun_ = false;
  bool has_head_ = false;
};

}  // namespace oblique::client
