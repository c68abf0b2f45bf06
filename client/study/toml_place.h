#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <toml++/toml.h>

#include "worker/solver/model/errors.h"

namespace oblique::client {

/// Where a value stands: its file, line and column, for what is wrong with it.
class TomlPlace {
 public:
  /// `file` is what errors call it.
  explicit TomlPlace(std::string file) : file_(std::move(file)) {}

  const std::string& file() const { return file_; }

  /// Throws solver::InputError: "study.toml:3:6: " and the message.
  [[noreturn]] void fail(const toml::node& at, std::string_view message) const {
    fail(at.source(), message);
  }
  [[noreturn]] void fail(const toml::key& at, std::string_view message) const {
    fail(at.source(), message);
  }
  [[noreturn]] void fail(const toml::source_region& at, std::string_view message) const;

  /// "study.toml:3:6: "
  std::string before(const toml::source_region& at) const;

  /// Runs `work` and puts the place before an InputError that it throws.
  template <typename At, typename Work>
  decltype(auto) located(const At& at, Work work) const {
    try {
      return work();
    } catch (const solver::InputError& error) {
      fail(at, error.what());
    }
  }

  // The value of a node that must be of that type; `key` and `expected` are for the message.
  double number(std::string_view key, const toml::node& node, std::string_view expected) const;
  std::string text(std::string_view key, const toml::node& node, std::string_view expected) const;
  bool yes(std::string_view key, const toml::node& node) const;
  const toml::table& table(std::string_view key, const toml::node& node,
                           std::string_view expected) const;

 private:
  std::string file_;
};

}  // namespace oblique::client
