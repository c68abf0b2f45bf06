#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace oblique::solver {

/// Error for an input value that is not allowed.
class InputError : public std::runtime_error {
 public:
  struct Fields {
    std::string text;                         ///< names the key, the value and the allowed range
    std::string key = {};                     ///< of the model, or "where" or "sample"
    std::string expression = {};              ///< the wrong expression
    std::optional<std::size_t> block = {};    ///< block number from 0, if there are several
    std::optional<std::uint64_t> point = {};  ///< point number in the study
    std::string place = {};                   ///< "study.toml:3:6" or "--mu 0.4"
  };

  explicit InputError(std::string text) : InputError(Fields{std::move(text)}) {}
  InputError(std::string_view key, std::string text)
      : InputError(Fields{std::move(text), std::string(key)}) {}
  explicit InputError(Fields fields)
      : runtime_error(sentence(fields)), fields_(std::move(fields)) {}

  const Fields& fields() const { return fields_; }

  /// Copies the error with another key.
  InputError with_key(std::string_view key) const {
    Fields fields = fields_;
    fields.key = key;
    return InputError(std::move(fields));
  }

  /// Copies the error, with `place` unless it has a place.
  InputError at(const std::string& place) const {
    Fields fields = fields_;
    fields.place = fields.place.empty() ? place : fields.place;
    return InputError(std::move(fields));
  }

 private:
  /// `study.toml:3:6: block 2: point 7: mu = "k": ...`. The expression is left out if the place
  /// ends with it.
  static std::string sentence(const Fields& fields) {
    std::string line = fields.place.empty() ? "" : fields.place + ": ";
    line += fields.block ? "block " + std::to_string(*fields.block + 1) + ": " : "";
    line += fields.point ? "point " + std::to_string(*fields.point) + ": " : "";
    if (!fields.expression.empty() && !fields.place.ends_with(fields.expression)) {
      line += fields.key + " = \"" + fields.expression + "\": ";
    }
    return line + fields.text;
  }

  Fields fields_;
};

/// Calls `work`, and adds the key to an InputError that it throws.
template <typename Work>
decltype(auto) with_key(std::string_view key, Work work) {
  try {
    return work();
  } catch (const InputError& error) {
    throw error.with_key(key);
  }
}

/// Error for a point without an answer, such as a contact that does not end.
class SolveError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace oblique::solver
