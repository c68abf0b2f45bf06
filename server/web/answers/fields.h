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

/// Whether all fields are UTF-8, which messages to the service must be.
bool is_text(const Fields& fields);

/// Parses fields. Each function throws std::invalid_argument with the field and what is allowed.
class FieldReader {
 public:
  explicit FieldReader(const Fields& fields) : fields_(fields) {}

  std::optional<std::string> text(const std::string& name) const;
  std::optional<std::uint64_t> whole(const std::string& name) const;
  std::optional<double> number(const std::string& name) const;
  /// Number of cells along one side of a picture, from 1 to kMaxCells; `usual` if the field is
  /// missing.
  std::uint64_t cells(const std::string& name, std::uint64_t usual) const;
  /// The condition `where`, a complete SQL expression, or an empty text.
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
  bool is_category = false;  ///< a text with few values; otherwise a number
};

/// The column of that name; none if it is neither numeric nor a category.
std::optional<PictureColumn> find_picture_column(std::string_view name);

}  // namespace oblique::server
