#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/formats/packed_columns.h"
#include "client/formats/row_printer.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// See made_printer.
class JsonPrinter : public RowPrinter {
 public:
  enum class Shape { kArray, kLines };

  JsonPrinter(Sink& sink, Shape shape) : sink_(sink), shape_(shape) {}

  void print(const protocol::QueryReply& chunk) override;
  void end() override;

 private:
  struct Key {
    std::string text;  // as it stands before each value: "name":
    std::optional<PackedList> packed;
  };

  void begin(const protocol::QueryReply& chunk);
  static void append_value(std::string& out, const Key& key, const protocol::Cell& cell);

  Sink& sink_;
  Shape shape_;
  std::vector<Key> keys_;
  bool has_begun_ = false;
  bool has_rows_ = false;
};

}  // namespace oblique::client
