#include "client/study/toml_text.h"

#include <sstream>

#include "worker/solver/model/number.h"

namespace oblique::client {

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

namespace {

/// A value of a list or table as the file has it, or nearly; nested ones only by their kind.
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

}  // namespace

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

bool is_number(const toml::node& node) {
  return node.is_integer() || node.is_floating_point();
}

}  // namespace oblique::client
