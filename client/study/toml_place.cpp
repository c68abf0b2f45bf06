#include "client/study/toml_place.h"

#include <spdlog/fmt/fmt.h>

#include "client/study/toml_text.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

std::string not_as_expected(std::string_view key, const toml::node& node,
                            std::string_view expected) {
  return fmt::format("{} = {} is {}: it must be {}", protocol::excerpt(key), shown(node),
                     kind_of(node), expected);
}

}  // namespace

std::string TomlPlace::before(const toml::source_region& at) const {
  return fmt::format("{}:{}:{}: ", file_, at.begin.line, at.begin.column);
}

void TomlPlace::fail(const toml::source_region& at, std::string_view message) const {
  throw solver::InputError(fmt::format("{}{}", before(at), message));
}

double TomlPlace::number(std::string_view key, const toml::node& node,
                         std::string_view expected) const {
  if (!is_number(node)) {
    fail(node, not_as_expected(key, node, expected));
  }
  const auto value = node.value<double>();
  if (!value) {
    fail(node, fmt::format("{} = {} has more digits than a number here keeps: write it with an "
                           "exponent, as 1e18",
                           key, shown(node)));
  }
  return *value;
}

std::string TomlPlace::text(std::string_view key, const toml::node& node,
                            std::string_view expected) const {
  if (!node.is_string()) {
    fail(node, not_as_expected(key, node, expected));
  }
  return *node.value<std::string>();
}

bool TomlPlace::yes(std::string_view key, const toml::node& node) const {
  if (!node.is_boolean()) {
    fail(node, not_as_expected(key, node, "true or false"));
  }
  return *node.value<bool>();
}

const toml::table& TomlPlace::table(std::string_view key, const toml::node& node,
                                    std::string_view expected) const {
  if (!node.is_table()) {
    fail(node, not_as_expected(key, node, expected));
  }
  return *node.as_table();
}

}  // namespace oblique::client
