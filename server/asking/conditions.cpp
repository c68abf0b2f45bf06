#include "server/asking/conditions.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "server/asking/sql/sql_items.h"
#include "server/asking/sql/sql_tokens.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::server {
namespace {

using Tokens = std::span<const SqlToken>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// More boxes than this, or more values of one column, are one without limits.
constexpr std::size_t kMostBoxes = 64;
constexpr std::size_t kMostRanges = 1000;
constexpr std::size_t kDeepest = 50;

Boxes anything() {
  return {Box()};
}

bool is_input(std::string_view column) {
  const auto points = solver::point_keys();
  const bool is_point_key = std::any_of(points.begin(), points.end(),
                                        [&](const auto& key) { return key.name == column; });
  return column == "point" || column == "E_Pa" || is_point_key ||
         (column != "E" && column != "integrator" && solver::find_model_key(column) != nullptr);
}

/// The number that the tokens write, with a sign or without; nothing where SQLite might read
/// another one.
std::optional<double> number_in(Tokens tokens) {
  constexpr std::size_t kMostDigitsOfInteger = 15;
  const bool has_sign = tokens.size() == 2 && (tokens[0].is_sign('-') || tokens[0].is_sign('+'));
  if (tokens.size() != (has_sign ? 2U : 1U) || tokens.back().kind != SqlToken::Kind::kLiteral) {
    return std::nullopt;
  }
  std::string text(tokens.back().text);
  const bool is_integer = text.find_first_not_of("0123456789") == std::string::npos;
  const bool is_decimal = text.find_first_not_of("0123456789.eE+-") == std::string::npos;
  if (!is_decimal || (is_integer && text.size() > kMostDigitsOfInteger)) {
    return std::nullopt;
  }
  if (text.front() == '.') {
    text.insert(0, 1, '0');
  }
  const auto number = solver::number_of(text);
  return has_sign && tokens[0].is_sign('-') && number ? std::optional(-*number) : number;
}

Boxes where(std::string_view column, ValueSet values) {
  return {Box{{std::string(column), std::move(values)}}};
}

std::optional<ValueSet> compared(std::string_view sign, double number) {
  if (sign == "=" || sign == "==") {
    return ValueSet({number, number});
  }
  if (sign == "<" || sign == "<=") {
    return ValueSet({-kInfinity, number, false, sign == "<"});
  }
  if (sign == ">" || sign == ">=") {
    return ValueSet({number, kInfinity, sign == ">", false});
  }
  return std::nullopt;
}

/// The same comparison with its sides exchanged.
std::string turned(std::string sign) {
  for (char& c : sign) {
    c = c == '<' ? '>' : c == '>' ? '<' : c;
  }
  return sign;
}

/// A column and numbers with a sign of comparison between them.
Boxes comparison(Tokens tokens) {
  const auto is_part = [](const SqlToken& token) {
    return token.is_sign('<') || token.is_sign('=') || token.is_sign('>');
  };
  const auto begin = std::find_if(tokens.begin(), tokens.end(), is_part);
  const auto end = std::find_if_not(begin, tokens.end(), is_part);
  // A sign's characters are tokens of their own; apart from each other they are none.
  std::string sign;
  for (auto token = begin; token != end; ++token) {
    const bool follows = token == begin || (token - 1)->text.end() == token->text.begin();
    sign += follows ? std::string(token->text) : std::string(" ");
  }
  Tokens left(tokens.begin(), begin);
  Tokens right(end, tokens.end());
  if (number_in(left)) {
    std::swap(left, right);
    sign = turned(sign);
  }
  const auto number = number_in(right);
  if (!number || left.size() != 1 || left[0].kind != SqlToken::Kind::kName ||
      !is_input(left[0].text)) {
    return anything();
  }
  auto values = compared(sign, *number);
  return values ? where(left[0].text, std::move(*values)) : anything();
}

Boxes between(Tokens tokens) {
  const auto middle = std::find_if(tokens.begin() + 2, tokens.end(),
                                   [](const SqlToken& token) { return is_word(token, "and"); });
  if (middle == tokens.end()) {
    return anything();
  }
  const auto low = number_in({tokens.begin() + 2, middle});
  const auto high = number_in({middle + 1, tokens.end()});
  return low && high ? where(tokens[0].text, ValueSet({*low, *high})) : anything();
}

/// IN and a list of numbers.
Boxes listed(Tokens tokens) {
  if (tokens.size() < 5 || !tokens[2].is_sign('(') || !tokens.back().is_sign(')')) {
    return anything();
  }
  ValueSet values;
  auto begin = tokens.begin() + 3;
  const auto last = tokens.end() - 1;
  while (begin <= last) {
    const auto end =
        std::find_if(begin, last, [](const SqlToken& token) { return token.is_sign(','); });
    const auto number = number_in({begin, end});
    if (!number || values.ranges().size() >= kMostRanges) {
      return anything();
    }
    values.unite(ValueSet({*number, *number}));
    begin = end + 1;
  }
  return where(tokens[0].text, std::move(values));
}

/// All points that meet both.
Boxes both(const Boxes& a, const Boxes& b) {
  if (a.size() * b.size() > kMostBoxes) {
    return a.size() < b.size() ? a : b;
  }
  Boxes common;
  for (const Box& first : a) {
    for (const Box& second : b) {
      Box box = first;
      for (const auto& [column, values] : second) {
        const auto [known, is_new] = box.try_emplace(column, values);
        if (!is_new) {
          known->second.intersect(values);
        }
      }
      common.push_back(std::move(box));
    }
  }
  return common;
}

/// All points that meet one.
Boxes either(Boxes a, const Boxes& b) {
  const auto restricts_one = [](const Boxes& boxes) {
    return boxes.size() == 1 && boxes.front().size() == 1;
  };
  if (restricts_one(a) && restricts_one(b) &&
      a.front().begin()->first == b.front().begin()->first) {
    ValueSet& values = a.front().begin()->second;
    values.unite(b.front().begin()->second);
    return values.ranges().size() <= kMostRanges ? a : anything();
  }
  a.insert(a.end(), b.begin(), b.end());
  return a.size() <= kMostBoxes ? a : anything();
}

class Parser {
 public:
  Boxes disjunction(Tokens tokens, std::size_t depth) const {
    if (depth > kDeepest) {
      return anything();
    }
    Boxes boxes;
    for (std::size_t i = 0; const Tokens part : parts(tokens, "or")) {
      Boxes next = conjunction(part, depth);
      boxes = i++ == 0 ? std::move(next) : either(std::move(boxes), next);
    }
    return boxes;
  }

 private:
  Boxes conjunction(Tokens tokens, std::size_t depth) const {
    Boxes boxes = anything();
    for (const Tokens part : parts(tokens, "and")) {
      boxes = both(boxes, predicate(part, depth));
    }
    return boxes;
  }

  Boxes predicate(Tokens tokens, std::size_t depth) const {
    if (tokens.size() < 3) {
      return anything();
    }
    if (tokens.front().is_sign('(') && closing_bracket(tokens, 0) == tokens.size() - 1) {
      return disjunction(tokens.subspan(1, tokens.size() - 2), depth + 1);
    }
    const bool begins_with_input =
        tokens[0].kind == SqlToken::Kind::kName && is_input(tokens[0].text);
    if (begins_with_input && is_word(tokens[1], "between")) {
      return between(tokens);
    }
    if (begins_with_input && is_word(tokens[1], "in")) {
      return listed(tokens);
    }
    return comparison(tokens);
  }

  /// What stands between the words `word` outside brackets. An AND after BETWEEN is part of that.
  static std::vector<Tokens> parts(Tokens tokens, std::string_view word) {
    std::vector<Tokens> found;
    std::size_t begin = 0;
    std::size_t open_betweens = 0;
    for (std::size_t i = 0; i < tokens.size(); ++i) {
      if (tokens[i].is_sign('(')) {
        i = closing_bracket(tokens, i);
      } else if (is_word(tokens[i], "between")) {
        ++open_betweens;
      } else if (is_word(tokens[i], "and") && open_betweens > 0) {
        --open_betweens;
      } else if (is_word(tokens[i], word)) {
        found.push_back(tokens.subspan(begin, i - begin));
        begin = i + 1;
      }
    }
    found.push_back(tokens.subspan(begin));
    return found;
  }
};

}  // namespace

Boxes boxes_of(std::string_view condition) {
  const auto tokens = sql_tokens(condition);
  // The ANDs and ORs inside CASE and the comparisons behind NOT mean something else.
  const bool has_case = std::any_of(tokens.begin(), tokens.end(),
                                    [](const SqlToken& token) { return is_word(token, "case"); });
  return tokens.empty() || has_case ? anything() : Parser().disjunction(tokens, 0);
}

}  // namespace oblique::server
