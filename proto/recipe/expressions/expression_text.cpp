#include "proto/recipe/expressions/expression_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/expressions/functions.h"
#include "proto/suggestion.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::expressions {
namespace {

using solver::InputError;

constexpr std::array<std::string_view, 17> kSigns{"<=", ">=", "==", "!=", "&&", "||", "<", ">", "+",
                                                  "-",  "*",  "/",  "^",  "!",  "(",  ")", ","};

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool begins_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
bool is_comparison(std::string_view sign) {
  return sign == "<" || sign == ">" || sign == "<=" || sign == ">=" || sign == "==" || sign == "!=";
}

bool is_function(std::string_view name) {
  const auto all = functions();
  return std::any_of(all.begin(), all.end(), [&](const Function& f) { return f.name == name; });
}

/// Takes a text apart, token by token.
class Reading {
 public:
  explicit Reading(std::string_view text) : rest_(text) {}

  ExpressionText read() {
    while (skip_space(), !rest_.empty()) {
      if (is_digit(rest_[0]) || rest_[0] == '.') {
        read_number();
      } else if (begins_name(rest_[0])) {
        read_name();
      } else {
        read_sign();
      }
    }
    if (has_comparison_.size() > 1) {
      throw InputError("a bracket is open at its end");
    }
    if (read_.canonical.empty()) {
      throw InputError("it is empty");
    }
    return std::move(read_);
  }

 private:
  void skip_space() { rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t"), rest_.size())); }

  void read_number() {
    double value = 0.0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc() || !std::isfinite(value)) {
      throw InputError("it has a number that cannot be read");
    }
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    if (!rest_.empty() && (begins_name(rest_[0]) || is_digit(rest_[0]) || rest_[0] == '.')) {
      throw InputError("a number runs into what follows it: put an operator or a space between");
    }
    add(solver::exact_number(value), true);
  }

  void read_name() {
    const auto end = std::find_if_not(rest_.begin(), rest_.end(),
                                      [](char c) { return begins_name(c) || is_digit(c); });
    const std::string_view name(rest_.data(), static_cast<std::size_t>(end - rest_.begin()));
    rest_.remove_prefix(name.size());
    if (name == "and" || name == "or" || name == "not") {
      add_sign(name == "and" ? "&&" : name == "or" ? "||" : "!");
      return;
    }
    skip_space();
    const bool is_called = !rest_.empty() && rest_[0] == '(';
    if (is_called && !is_function(name)) {
      const auto known = function_names();
      throw InputError(fmt::format("there is no function `{}`{}; there are {}",
                                   name.substr(0, kLongestQuoted),
                                   protocol::did_you_mean(name, known), protocol::joined(known)));
    }
    if (!is_called && is_function(name)) {
      throw InputError(fmt::format("`{}` is a function: its arguments stand in brackets", name));
    }
    if (!is_called && name != kPiName &&
        std::find(read_.names.begin(), read_.names.end(), name) == read_.names.end()) {
      read_.names.emplace_back(name);
    }
    add(std::string(name), true);
  }

  void read_sign() {
    const auto sign = std::find_if(kSigns.begin(), kSigns.end(),
                                   [&](std::string_view s) { return rest_.starts_with(s); });
    if (sign == kSigns.end()) {
      throw_foreign();
    }
    rest_.remove_prefix(sign->size());
    add_sign(*sign);
  }

  [[noreturn]] void throw_foreign() const {
    if (rest_[0] == '=') {
      throw InputError("`=` is no operator: `==` compares, and nothing is assigned");
    }
    if (rest_[0] == '?') {
      throw InputError("`?` means nothing in it: write if(e > 0.5, 0.4, 0.6) to choose");
    }
    const bool is_plain = rest_[0] > ' ' && rest_[0] <= '~';
    throw InputError(is_plain ? fmt::format("`{}` means nothing in it", rest_[0])
                              : std::string("it has a character that means nothing in it"));
  }

  /// Watches brackets and comparisons on the way.
  void add_sign(std::string_view sign) {
    const auto compared = has_comparison_.end() - 1;
    if (sign == "(") {
      has_comparison_.push_back(false);
      if (has_comparison_.size() > kDeepestBrackets + 1) {
        throw InputError(
            fmt::format("its brackets stand more than {} deep in each other", kDeepestBrackets));
      }
    } else if (sign == ")") {
      if (has_comparison_.size() == 1) {
        throw InputError("it has a closing bracket without an opening one");
      }
      has_comparison_.pop_back();
    } else if (sign == "&&" || sign == "||" || sign == ",") {
      *compared = false;
    } else if (is_comparison(sign)) {
      if (*compared) {
        throw InputError("a comparison is of two values: write a < b && b < c");
      }
      *compared = true;
    }
    add(std::string(sign), false);
  }

  void add(const std::string& token, bool is_word) {
    if (is_word && last_is_word_) {
      throw InputError(
          fmt::format("an operator is missing before `{}`", token.substr(0, kLongestQuoted)));
    }
    last_is_word_ = is_word;
    read_.canonical += token;
  }

  static constexpr std::size_t kLongestQuoted = 40;

  std::string_view rest_;
  ExpressionText read_;
  bool last_is_word_ = false;
  /// Outside of brackets and in each open one: a comparison came since the last && or ||.
  std::vector<bool> has_comparison_{false};
};

}  // namespace

std::vector<std::string_view> function_names() {
  std::vector<std::string_view> names;
  for (const Function& function : functions()) {
    names.push_back(function.name);
  }
  return names;
}

ExpressionText read_expression(std::string_view text) {
  if (text.size() > kLongestText) {
    throw InputError(fmt::format("it has {} bytes, more than {}", text.size(), kLongestText));
  }
  return Reading(text).read();
}

}  // namespace oblique::expressions
