#include "proto/keys/toml_fields.h"

#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "proto/keys/key_file.h"
#include "proto/small_file.h"
#include "proto/suggestion.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {

TomlFile::TomlFile(const std::string& path, std::string_view what,
                   const std::function<void(std::string&)>& prepare) {
  std::string text = read_small_file(path, what, kMostBytes);
  if (prepare) {
    prepare(text);
  }
  try {
    top_ = toml::parse(text, path);
  } catch (const toml::parse_error& error) {
    throw solver::InputError(fmt::format("{}:{}: {}", path, error.source().begin.line,
                                         excerpt(error.description(), kLongestParseError)));
  }
}

void TomlFields::fail(std::string_view field, const std::string& message) const {
  const toml::node* node = table_.get(field);
  const auto line = (node != nullptr ? node->source() : table_.source()).begin.line;
  throw solver::InputError(
      fmt::format("{}:{}: {}", path_, std::max<toml::source_index>(line, 1), message));
}

std::string TomlFields::text(std::string_view field) const {
  const toml::node* node = table_.get(field);
  if (node == nullptr) {
    fail(field, fmt::format("`{}` is missing", field));
  }
  if (!node->is_string()) {
    fail(field, fmt::format("`{}` must be a text in quotes", field));
  }
  return *node->value<std::string>();
}

Role TomlFields::role(std::string_view field) const {
  const auto role = role_named(text(field));
  if (!role) {
    fail(field,
         fmt::format("`{}` must be \"server\", \"client\", \"worker\" or \"reader\"", field));
  }
  return *role;
}

CurveKey TomlFields::key(std::string_view field) const {
  const auto key = key_of_z85(text(field));
  if (!key) {
    fail(field,
         fmt::format("`{}` is no key: one has {} characters, as `oblique keygen` writes them",
                     field, kKeyCharacters));
  }
  return *key;
}

std::string TomlFields::key_name(std::string_view field) const {
  std::string name = text(field);
  if (const std::string objection = objection_to_key_name(name); !objection.empty()) {
    fail(field, fmt::format("`{}`: {}", field, objection));
  }
  return name;
}

void TomlFields::refuse_unknown(std::span<const std::string_view> known,
                                std::string_view what) const {
  for (const auto& [field, value] : table_) {
    if (std::find(known.begin(), known.end(), field.str()) == known.end()) {
      fail(field.str(),
           fmt::format("{}: {} has {}", unknown_key(field.str(), known), what, joined(known)));
    }
  }
}

}  // namespace oblique::protocol
