#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include <toml++/toml.h>

#include "proto/keys/curve_key.h"
#include "proto/keys/role.h"

// How files of keys are read: errors name file, line and key, and never a secret.
namespace oblique::protocol {

/// A TOML file of at most 1 MiB.
class TomlFile {
 public:
  static constexpr std::size_t kMostBytes = std::size_t{1} << 20U;

  /// Throws solver::InputError when it cannot be read or is no TOML; `what` says what it should be.
  /// `prepare` may change the text before it is parsed.
  TomlFile(const std::string& path, std::string_view what,
           const std::function<void(std::string&)>& prepare = {});

  const toml::table& top() const { return top_; }

 private:
  toml::table top_;
};

/// The values of one table of a file. Each throws solver::InputError for one that is missing or
/// wrong.
class TomlFields {
 public:
  /// `table` must outlive this.
  TomlFields(std::string path, const toml::table& table) : path_(std::move(path)), table_(table) {}

  std::string text(std::string_view field) const;
  Role role(std::string_view field) const;
  CurveKey key(std::string_view field) const;
  std::string key_name(std::string_view field) const;
  /// `what` has these fields and no others.
  void refuse_unknown(std::span<const std::string_view> known, std::string_view what) const;
  /// Throws, with file and line of that field, or of the table where it is missing.
  [[noreturn]] void fail(std::string_view field, const std::string& message) const;

 private:
  std::string path_;
  const toml::table& table_;
};

}  // namespace oblique::protocol
