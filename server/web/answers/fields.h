#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "worker/solver/model/errors.h"

namespace oblique::server {

/// Decoded fields of a request's query string.
using Fields = std::map<std::string, std::string>;

/// Returns whether all fields are UTF-8. Messages to the service must be UTF-8.
bool is_text(const Fields& fields);

/// Reads fields. Functions throw std::invalid_argument with the field and what is allowed.
class FieldReader {
 public:
  explicit FieldReader(const Fields& fields) : fields_(fields) {}

  std::optional<std::string> text(const std::string& name) const;
  std::optional<std::uint64_t> whole(const std::string& name) const;
  std::optional<double> number(const std::string& name) const;
  /// Returns the number of cells along a side, from 1 to kMaxCells; `usual` if the field is
  /// missing.
  std::uint64_t cells(const std::string& name, std::uint64_t usual) const;
  /// Returns the field `where`, a complete SQL expression, or an empty text.
  std::string condition() const;

  static constexpr std::uint64_t kMaxCells = 256;

 private:
  const Fields& fields_;
};

/// Calls `parse` and turns its solver::InputError into std::invalid_argument.
template <typename Parse>
auto parse_request(const Parse& parse) {
  try {
    return parse();
  } catch (const solver::InputError& error) {
    throw std::invalid_argument(error.what());
  }
}

/// A column that a picture can show.
struct PictureColumn {
  std::string name;
  std::string unit;
  bool is_category = false;  ///< true for a text with few different values, false for a number
};

/// Returns the column of that name; nothing if it is neither numeric nor a category.
std::optional<PictureColumn> find_picture_column(std::string_view name);

}  // namespace oblique::server
