#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "server/web/answers/column_source.h"

namespace oblique::server {

/// Whether all of them are UTF-8: messages to the service have nothing else.
bool is_text(const std::map<std::string, std::string>& fields);

/// What follows the question mark of a request, read field by field. Each throws
/// std::invalid_argument, naming the field and what is allowed.
class FieldReader {
 public:
  explicit FieldReader(const std::map<std::string, std::string>& fields) : fields_(fields) {}

  std::optional<std::string> text(const std::string& name) const;
  std::optional<std::uint64_t> whole(const std::string& name) const;
  std::optional<double> number(const std::string& name) const;
  /// From 1 to the most pixels of a side.
  std::uint64_t pixels(const std::string& name, std::uint64_t usual) const;

  static constexpr std::uint64_t kMostPixels = 1024;

 private:
  const std::map<std::string, std::string>& fields_;
};

/// The column that a field names. Throws std::invalid_argument unless it is one of numbers, or,
/// where it may be, of categories.
ColumnSource picture_column(const FieldReader& fields, const std::string& name,
                            bool may_be_category);

}  // namespace oblique::server
