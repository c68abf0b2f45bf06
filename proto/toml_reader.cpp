#include "proto/toml_reader.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <optional>
#include <sstream>

#include <spdlog/fmt/fmt.h>

#include "proto/suggestion.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

constexpr int kMostKeyParts = 8;

/// A value of a list or table as the file has it; nested ones only by their kind.
std::string element(const toml::node& node) {
  if (const auto* number = node.as_floating_point()) {
    return solver::exact_number(number->get());
  }
  if (node.is_array() || node.is_table()) {
    return kind_of(node);
  }
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

std::string not_as_expected(std::string_view key, const toml::node& node,
                            std::string_view expected) {
  return fmt::format("{} = {} is {}: it must be {}", excerpt(key), shown(node), kind_of(node),
                     expected);
}

/// The last character of the string in quotes that begins at `begin`.
std::size_t end_of_string(std::string_view text, std::size_t begin) {
  const char quote = text[begin];
  const std::string three(3, quote);
  const bool is_long = text.substr(begin).starts_with(three);
  for (std::size_t at = begin + (is_long ? 3U : 1U); at < text.size(); ++at) {
    if (is_long ? text.substr(at).starts_with(three) : text[at] == quote || text[at] == '\n') {
      return at + (is_long ? 2U : 0U);
    }
    at += quote == '"' && text[at] == '\\' ? 1U : 0U;
  }
  return text.size();
}

/// Where a key with too many parts begins. Nothing is parsed: strings and comments are skipped.
std::optional<std::size_t> too_long_key(std::string_view text) {
  const auto is_of_key = [](char letter) {
    const auto byte = static_cast<unsigned char>(letter);
    return std::isalnum(byte) != 0 || byte >= 0x80 ||
           std::string_view("_- \t").find(letter) != std::string_view::npos;
  };
  std::size_t begin = 0;
  int parts = 1;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char letter = text[at];
    if (letter == '"' || letter == '\'') {
      at = end_of_string(text, at);
    } else if (letter == '.') {
      ++parts;
    } else if (!is_of_key(letter)) {
      at = letter == '#' ? std::min(text.find('\n', at), text.size()) : at;
      parts = 1;
      begin = at + 1;
    }
    if (parts > kMostKeyParts) {
      return std::min(text.find_first_not_of(" \t", begin), text.size());
    }
  }
  return std::nullopt;
}

}  // namespace

std::string kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::boolean:
      return "a boolean";
    case toml::node_type::integer:
    case toml::node_type::floating_point:
      return "a number";
    default:
      return "a date or time";
  }
}

std::string shown(const toml::node& node) {
  constexpr std::size_t kMost = 60;
  std::string line;
  if (const auto* list = node.as_array()) {
    for (const auto& value : *list) {
      line += (line.empty() ? "[" : ", ") + element(value);
    }
    line = list->empty() ? "[]" : line + "]";
  } else if (const auto* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      line += (line.empty() ? "{ " : ", ") + std::string(key.str()) + " = " + element(value);
    }
    line = table->empty() ? "{}" : line + " }";
  } else {
    line = element(node);
  }
  line = line.substr(0, line.find('\n'));
  return line.size() > kMost ? line.substr(0, kMost) + "..." : line;
}

toml::table TomlReader::parse(std::string_view text) const {
  constexpr std::size_t kLongestError = 150;  // a message of toml++ ends with a key
  if (const auto found = too_long_key(text)) {
    const std::string_view before = text.substr(0, *found);
    const auto line = std::count(before.begin(), before.end(), '\n') + 1;
    const std::size_t column = *found - before.rfind('\n');  // npos is -1
    throw solver::InputError(
        fmt::format("{}:{}:{}: a key has more than {} parts with dots between "
                    "them",
                    file_, line, column, kMostKeyParts));
  }
  try {
    return toml::parse(text, file_);
  } catch (const toml::parse_error& error) {
    fail_at(error.source(), excerpt(error.description(), kLongestError));
  }
}

std::string TomlReader::before(const toml::source_region& at) const {
  return fmt::format("{}:{}:{}: ", file_, at.begin.line, at.begin.column);
}

void TomlReader::fail_at(const toml::source_region& at, std::string_view message) const {
  throw solver::InputError(fmt::format("{}{}", before(at), message));
}

double TomlReader::number(std::string_view key, const toml::node& node,
                          std::string_view expected) const {
  if (!node.is_number()) {
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

std::string TomlReader::text(std::string_view key, const toml::node& node,
                             std::string_view expected) const {
  if (!node.is_string()) {
    fail(node, not_as_expected(key, node, expected));
  }
  return *node.value<std::string>();
}

bool TomlReader::yes(std::string_view key, const toml::node& node) const {
  if (!node.is_boolean()) {
    fail(node, not_as_expected(key, node, "true or false"));
  }
  return *node.value<bool>();
}

const toml::table& TomlReader::table(std::string_view key, const toml::node& node,
                                     std::string_view expected) const {
  if (!node.is_table()) {
    fail(node, not_as_expected(key, node, expected));
  }
  return *node.as_table();
}

void TomlReader::refuse_unknown(const toml::table& table, std::span<const std::string_view> known,
                                std::string_view before, std::string_view rule) const {
  for (const auto& [key, value] : table) {
    if (std::find(known.begin(), known.end(), key.str()) == known.end()) {
      fail(key, fmt::format("{}{}: {}", before, unknown_key(key.str(), known), rule));
    }
  }
}

}  // namespace oblique::protocol
