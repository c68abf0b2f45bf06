#include "proto/toml_reader.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <sstream>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

/// Returns a value as written in the file. Nested lists and tables are shown only by their kind.
std::string element(const toml::node& node, bool is_nested) {
  std::vector<std::string> parts;
  if (is_nested && (node.is_array() || node.is_table())) {
    return kind_of(node);
  }
  if (const auto* list = node.as_array()) {
    for (const auto& value : *list) {
      parts.push_back(element(value, true));
    }
    return fmt::format("[{}]", fmt::join(parts, ", "));
  }
  if (const auto* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      parts.push_back(fmt::format("{} = {}", key.str(), element(value, true)));
    }
    return parts.empty() ? "{}" : fmt::format("{{ {} }}", fmt::join(parts, ", "));
  }
  if (const auto* number = node.as_floating_point()) {
    return solver::exact_number(number->get());
  }
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

}  // namespace

std::string kind_of(const toml::node& node) {
  constexpr std::string_view kDate = "a date or time";
  // By toml::node_type.
  constexpr std::array<std::string_view, 10> kKinds{"nothing",  "a table",  "a list",    "a string",
                                                    "a number", "a number", "a boolean", kDate,
                                                    kDate,      kDate};
  return std::string(kKinds.at(static_cast<std::size_t>(node.type())));
}

std::string shown(const toml::node& node) {
  constexpr std::size_t kMax = 60;
  const std::string all = element(node, false);
  const std::string line = all.substr(0, all.find('\n'));
  return line.size() > kMax ? line.substr(0, kMax) + "..." : line;
}

std::string toml_string(std::string_view text) {
  std::ostringstream quoted;
  quoted << toml::toml_formatter(toml::value<std::string>(std::string(text)),
                                 toml::format_flags::none);
  return quoted.str();
}

toml::table TomlReader::parse(std::string_view text) const {
  constexpr std::size_t kLongestError = 150;  // messages of toml++ may contain long keys
  constexpr std::size_t kMaxKeyParts = 100;
  // A key with many parts makes deeply nested tables, whose destructors recurse. This check runs
  // before parsing, so it counts dots in other text too, up to a comma, '=', bracket or line end.
  std::size_t parts = 1;
  std::size_t line = 1;
  std::size_t word = 0;  // where the current word begins
  char quote = '\n';     // the sign that began the current text or comment; a line break: none
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '.' && c != '+' && c != '-') {
      // toml++ reads 1e-400 as 0.
      const auto number = text.substr(word, i - word);
      if (const auto advice = solver::why_no_number(number); quote == '\n' && !advice.empty()) {
        throw solver::InputError({.text = fmt::format("{} is not a number{}", number, advice),
                                  .place = fmt::format("{}:{}", file_, line)});
      }
      word = i + 1;
    }
    const bool may_open = quote == '\n' && (c == '"' || c == '\'' || c == '#');
    quote = may_open ? c : c == quote || c == '\n' ? '\n' : quote;
    line += c == '\n' ? 1 : 0;
    const bool is_end = std::string_view("=,[]{}\n").find(c) != std::string_view::npos;
    parts = is_end ? 1 : parts + (c == '.' ? 1 : 0);
    if (parts > kMaxKeyParts) {
      throw solver::InputError(
          {.text = fmt::format("more than {} parts with dots between them", kMaxKeyParts),
           .place = fmt::format("{}:{}", file_, line)});
    }
  }
  try {
    return toml::parse(text, file_);
  } catch (const toml::parse_error& error) {
    fail(error, excerpt(error.description(), kLongestError));
  }
}

std::string TomlReader::place(const toml::source_region& at) const {
  return fmt::format("{}:{}:{}", file_, at.begin.line, at.begin.column);
}

void TomlReader::require(bool is_expected, std::string_view key, const toml::node& node,
                         std::string_view expected) const {
  if (!is_expected) {
    fail(node, fmt::format("{} = {} is {}: it must be {}", excerpt(key), shown(node), kind_of(node),
                           expected));
  }
}

double TomlReader::number(std::string_view key, const toml::node& node,
                          std::string_view expected) const {
  require(node.is_number(), key, node, expected);
  const auto value = node.value<double>();
  if (!value) {
    fail(node, fmt::format("{} = {} has more digits than a number can hold: write it with an "
                           "exponent, as 1e18",
                           key, shown(node)));
  }
  return *value + 0.0;  // never -0
}

std::string TomlReader::text(std::string_view key, const toml::node& node,
                             std::string_view expected) const {
  require(node.is_string(), key, node, expected);
  return *node.value<std::string>();
}

bool TomlReader::boolean(std::string_view key, const toml::node& node) const {
  require(node.is_boolean(), key, node, "true or false");
  return *node.value<bool>();
}

const toml::table& TomlReader::table(std::string_view key, const toml::node& node,
                                     std::string_view expected) const {
  require(node.is_table(), key, node, expected);
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
