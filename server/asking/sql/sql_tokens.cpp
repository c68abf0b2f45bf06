#include "server/asking/sql/sql_tokens.h"

#include <algorithm>
#include <cstddef>
#include <string>

#include <spdlog/fmt/fmt.h>

namespace oblique::server {
namespace {

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool begins_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
         static_cast<unsigned char>(c) >= 0x80;
}
bool continues_name(char c) {
  return begins_name(c) || is_digit(c) || c == '$';
}
bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\f' || c == '\r';
}
/// As SQLite compares names: in ASCII only.
char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

/// Cuts a text into tokens as SQLite does. Throws NotSqlPart at what no part may contain.
class Tokenizer {
 public:
  explicit Tokenizer(std::string_view text) : text_(text) {}

  std::vector<SqlToken> all() {
    std::vector<SqlToken> tokens;
    for (skip_space(); at_ < text_.size(); skip_space()) {
      const std::size_t begin = at_;
      const SqlToken::Kind kind = take();
      tokens.push_back({kind, text_.substr(begin, at_ - begin)});
    }
    return tokens;
  }

 private:
  char here(std::size_t ahead = 0) const {
    return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0';
  }
  void skip_space() {
    while (at_ < text_.size() && is_space(text_[at_])) {
      ++at_;
    }
  }

  SqlToken::Kind take() {
    using Kind = SqlToken::Kind;
    refuse_what_no_part_has();
    switch (here()) {
      case '\'':
        take_quoted('\'');
        return Kind::kLiteral;
      case '"':
      case '`':
        take_quoted(here());
        return Kind::kQuotedName;
      case '[':
        take_until(']');
        return Kind::kQuotedName;
      default:
        break;
    }
    if ((here() == 'x' || here() == 'X') && here(1) == '\'') {
      ++at_;
      take_quoted('\'');
      return Kind::kLiteral;
    }
    if (is_digit(here()) || (here() == '.' && is_digit(here(1)))) {
      take_number();
      return Kind::kLiteral;
    }
    if (begins_name(here())) {
      while (continues_name(here())) {
        ++at_;
      }
      return Kind::kName;
    }
    ++at_;
    return Kind::kSign;
  }

  void refuse_what_no_part_has() const {
    const char c = here();
    if ((c == '-' && here(1) == '-') || (c == '/' && here(1) == '*')) {
      throw NotSqlPart(fmt::format("it has a comment ({}{})", c, here(1)));
    }
    if (c == '?' || c == ':' || c == '@' || c == '$' || c == '#') {
      throw NotSqlPart(fmt::format("it has a parameter ({}), which has no value", c));
    }
    if (c == ';') {
      throw NotSqlPart("it has a semicolon");
    }
    if (c == '\0') {
      throw NotSqlPart("it has a zero byte");
    }
  }

  /// A doubled quote stands for itself.
  void take_quoted(char quote) {
    do {
      take_until(quote);
    } while (here() == quote);
  }
  void take_until(char end) {
    const std::size_t found = text_.find(end, at_ + 1);
    if (found == std::string_view::npos) {
      throw NotSqlPart(fmt::format("the quote {} is not closed", here()));
    }
    at_ = found + 1;
  }

  /// 1, 1.5, .5, 1e-5, 0x1F; whatever clings to it belongs to it, for SQLite to refuse.
  void take_number() {
    while (continues_name(here()) || here() == '.') {
      const bool is_exponent = lower(here()) == 'e' && (here(1) == '+' || here(1) == '-');
      at_ += std::size_t{is_exponent && is_digit(here(2)) ? 2U : 1U};
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

std::vector<SqlToken> sql_tokens(std::string_view text) {
  return Tokenizer(text).all();
}

bool same_but_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

}  // namespace oblique::server
