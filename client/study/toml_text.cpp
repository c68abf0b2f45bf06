#include "client/study/toml_text.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <optional>
#include <sstream>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/errors.h"
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

namespace {

/// Goes through a TOML file as far as it takes to tell keys from texts and comments.
class KeyScan {
 public:
  explicit KeyScan(std::string_view text) : text_(text) {}

  /// Where a key begins that has too many parts; nothing: there is none.
  std::optional<std::size_t> too_long_key() {
    std::size_t begin = 0;  // of the word with dots at hand
    int parts = 1;
    while (at_ < text_.size()) {
      const char letter = text_[at_];
      if (letter == '"' || letter == '\'') {
        pass_text(letter);
      } else if (letter == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else {
        ++at_;
        if (letter == '.') {
          ++parts;
        } else if (!is_of_key(letter)) {
          parts = 1;
          begin = at_;
        }
      }
      if (parts > kMostKeyParts) {
        return begin;
      }
    }
    return std::nullopt;
  }

 private:
  static bool is_of_key(char letter) {
    return std::isalnum(static_cast<unsigned char>(letter)) != 0 || letter == '_' ||
           letter == '-' || letter == ' ' || letter == '\t' ||
           static_cast<unsigned char>(letter) >= 0x80;
  }
  /// Behind the text in quotes that begins here.
  void pass_text(char quote) {
    const std::string three(3, quote);
    const bool is_long = text_.substr(at_).starts_with(three);
    const std::string_view end = std::string_view(three).substr(0, is_long ? 3 : 1);
    for (at_ += end.size(); at_ < text_.size(); ++at_) {
      if (text_.substr(at_).starts_with(end)) {
        at_ += end.size();
        return;
      }
      if (!is_long && text_[at_] == '\n') {
        return;  // never closed, which the parser says
      }
      at_ += quote == '"' && text_[at_] == '\\' ? 1U : 0U;
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

void check_keys(std::string_view text, const std::string& file) {
  if (const auto found = KeyScan(text).too_long_key()) {
    std::size_t begin = std::min(text.find_first_not_of(" \t", *found), text.size());
    const auto before = text.substr(0, begin);
    const auto line = std::count(before.begin(), before.end(), '\n') + 1;
    const auto line_begin = before.rfind('\n');
    const std::size_t column =
        line_begin == std::string_view::npos ? begin + 1 : begin - line_begin;
    throw solver::InputError(
        fmt::format("{}:{}:{}: a key has more than {} parts with dots between them", file, line,
                    column, kMostKeyParts));
  }
}

bool is_number(const toml::node& node) {
  return node.is_integer() || node.is_floating_point();
}

}  // namespace oblique::client
