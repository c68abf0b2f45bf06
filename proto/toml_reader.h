#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <toml++/toml.h>

#include "worker/solver/model/errors.h"

namespace oblique::protocol {

/// Returns "a table", "a list", "a string", "a boolean", "a number" or "a date or time".
std::string kind_of(const toml::node& node);

/// Returns a value as written in the file, on one line and shortened, for a message.
std::string shown(const toml::node& node);

std::string toml_string(std::string_view text);

/// Reads TOML files: studies, keys and settings. Every error is a solver::InputError with the place
/// of the error, such as "study.toml:3:6": file, line and column.
class TomlReader {
 public:
  /// `file` is the name of the file in error messages.
  explicit TomlReader(std::string file) : file_(std::move(file)) {}

  const std::string& file() const { return file_; }

  /// Parses the text of the file. Refuses keys with more than 100 dotted parts.
  toml::table parse(std::string_view text) const;

  /// Throws an InputError with `message` and the place of the node or key `at`.
  template <typename At>
  [[noreturn]] void fail(const At& at, std::string_view message) const {
    throw solver::InputError({.text = std::string(message), .place = place(at.source())});
  }

  /// "study.toml:3:6"
  std::string place(const toml::source_region& at) const;

  /// Calls `work`. If that throws an InputError without a place, adds the place of the error's key
  /// in the table `at`, or else the place of `at`.
  template <typename Work>
  decltype(auto) located(const toml::node& at, Work work) const {
    try {
      return work();
    } catch (const solver::InputError& error) {
      const auto* table = at.as_table();
      const auto* value = table != nullptr ? table->get(error.fields().key) : nullptr;
      throw error.at(place((value != nullptr ? *value : at).source()));
    }
  }

  // Return the value of a node; throw if it has another type. Messages contain `key` and
  // `expected`.
  double number(std::string_view key, const toml::node& node, std::string_view expected) const;
  std::string text(std::string_view key, const toml::node& node, std::string_view expected) const;
  bool boolean(std::string_view key, const toml::node& node) const;
  const toml::table& table(std::string_view key, const toml::node& node,
                           std::string_view expected) const;

  /// Throws for a key of `table` that is not in `known`, with the message "`before`unknown key
  /// `muu` (did you mean `mu`?): `rule`".
  void refuse_unknown(const toml::table& table, std::span<const std::string_view> known,
                      std::string_view before, std::string_view rule) const;

 private:
  void require(bool is_expected, std::string_view key, const toml::node& node,
               std::string_view expected) const;

  std::string file_;
};

}  // namespace oblique::protocol
