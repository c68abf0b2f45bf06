#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/wire/cell.h"

namespace oblique::client {

/// Bytes that are kept in a file without a name, which goes with this.
class ScratchFile {
 public:
  /// Made in `folder`; empty: in that for temporary files. Throws std::runtime_error.
  explicit ScratchFile(const std::string& folder);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  void append(std::string_view bytes);
  /// Gives all that was appended, some at a time, in pieces of `unit` bytes or several of those.
  void read(std::size_t unit, const std::function<void(std::string_view)>& take);

 private:
  void flush();

  int descriptor_ = -1;
  std::string held_;
  std::uint64_t bytes_ = 0;  // in the file
};

/// One column on its way into an array of NumPy, whose kind is known only when all values are:
/// int64 while all are integers; float64 with a real number or a NULL, which is nan, among them
/// (integers beyond 2^53 are rounded then); text of fixed width, in which NULL is empty, when one
/// is a text. Without any value it is of the kind that its values would have. Values are kept in a
/// file.
class NpyColumn {
 public:
  /// `folder` as for ScratchFile. `row_shape`: the sizes of an array that stands in each row,
  /// whose values are added one after the other, the last index fastest; empty: one value. `usual`
  /// is what values would be, kNull where that is not known.
  explicit NpyColumn(std::string folder, std::vector<std::uint64_t> row_shape = {},
                     protocol::CellKind usual = protocol::CellKind::kNull)
      : folder_(std::move(folder)), row_shape_(std::move(row_shape)), usual_(usual) {}

  void add(const protocol::Cell& cell);

  std::uint64_t bytes_in_all();
  /// Gives the bytes of the .npy file, some at a time. Throws solver::InputError when a text is too
  /// long for an array, in which each takes as much as the longest.
  void write(const std::function<void(std::string_view)>& take);

 private:
  enum class Kind { kNull, kInteger, kReal, kText };

  void become(Kind kind);
  void put(std::int64_t value);
  void put(double value);
  void put(std::string_view text);
  Kind kind_in_file() const;
  std::string header() const;
  std::uint64_t item_bytes() const;
  void write_texts(const std::function<void(std::string_view)>& take);

  std::string folder_;
  std::vector<std::uint64_t> row_shape_;
  protocol::CellKind usual_;
  Kind kind_ = Kind::kNull;
  std::unique_ptr<ScratchFile> values_;  // none while all are NULL
  std::uint64_t rows_ = 0;     // of values: each row of the array has as many as its shape says
  std::uint64_t longest_ = 1;  // characters of a text
};

}  // namespace oblique::client
