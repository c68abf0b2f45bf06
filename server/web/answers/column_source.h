#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Where values of one column of `runs` stand, read as float32 by key from `packed_results`.
struct ColumnSource {
  std::string name;
  std::string unit;
  std::string sql;            ///< over packed_results AS p and models AS m
  double per_unit = 1.0;      ///< so many of what stands there are one `unit`
  bool is_of_model = false;   ///< `m` is needed
  bool is_of_failed = false;  ///< points that failed have it too
  bool is_category = false;   ///< what stands there is the number of a text
};

/// Nothing: the column is none of numbers or of categories.
std::optional<ColumnSource> column_source(std::string_view name);

/// What stands for a number where there is none: a NaN, whose bits say why. They are in README.md.
float no_result();
float failed_point();
float left_out();
float no_value();
float filtered_out();  ///< it is there, and does not meet the condition of who asks
/// By the bits; NaNs are never equal.
bool is_same_mark(float one, float other);

/// Reads values of points that follow each other.
class ColumnReader {
 public:
  ColumnReader(sqlite3* database, std::uint64_t study, const ColumnSource& source);

  /// Gives `take` each point from `first` to `last`, both in, that has a row, and its value,
  /// in the order of points.
  template <typename Take>
  void read(std::uint64_t first, std::uint64_t last, const Take& take) {
    begin(first, last);
    while (statement_.step()) {
      take(static_cast<std::uint64_t>(statement_.integer(0)), value());
    }
  }

 private:
  void begin(std::uint64_t first, std::uint64_t last);
  float value() const;

  std::uint64_t study_;
  double per_unit_;
  Statement statement_;
};

}  // namespace oblique::server
