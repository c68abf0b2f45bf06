#include "server/asking/units.h"

#include <algorithm>
#include <array>

#include "server/asking/columns.h"
#include "server/asking/elements.h"

namespace oblique::server {
namespace {

using UnitTokens = std::span<const SqlToken>;

bool keeps_unit(std::string_view function) {
  constexpr std::array<std::string_view, 11> kKeep{"avg",   "min",        "max",    "sum",
                                                   "total", "median",     "stddev", "abs",
                                                   "round", "percentile", "ifnull"};
  return std::any_of(kKeep.begin(), kKeep.end(),
                     [&](std::string_view known) { return same_but_case(known, function); });
}

/// Where a sum is taken apart: the first sign of `signs` outside brackets, behind an operand.
std::size_t split_at(UnitTokens tokens, std::string_view signs) {
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (tokens[i].is_sign('(')) {
      i = closing_bracket(tokens, i);
    } else if (i > 0 && tokens[i].kind == SqlToken::Kind::kSign &&
               signs.find(tokens[i].text.front()) != std::string_view::npos) {
      return i;
    }
  }
  return tokens.size();
}

std::string unit_of_tokens(UnitTokens tokens) {
  if (tokens.empty()) {
    return {};
  }
  if (tokens.size() == 1) {
    return tokens[0].is_name() ? unit_of_column(name_of(tokens[0])) : "";
  }
  const auto element = element_at(tokens);
  if (element.tokens == tokens.size()) {
    return element.unit.find(',') == std::string::npos ? element.unit : "";
  }
  const std::size_t sum = split_at(tokens, "+-");
  if (sum < tokens.size()) {
    const std::string left = unit_of_tokens(tokens.first(sum));
    return left == unit_of_tokens(tokens.subspan(sum + 1)) ? left : "";
  }
  if (split_at(tokens, "*/%<>=|&") < tokens.size()) {
    return {};
  }
  if (tokens[0].is_sign('(') && closing_bracket(tokens, 0) == tokens.size() - 1) {
    return unit_of_tokens(tokens.subspan(1, tokens.size() - 2));
  }
  if (tokens[1].is_sign('(') && closing_bracket(tokens, 1) == tokens.size() - 1) {
    const auto arguments = tokens.subspan(2, tokens.size() - 3);
    const std::size_t comma = split_at(arguments, ",");
    const std::string unit = unit_of_tokens(arguments.first(comma));
    if (is_word(tokens[0], "variance") && !unit.empty()) {
      return unit.find_first_of(" /^") == std::string::npos ? unit + "^2" : "(" + unit + ")^2";
    }
    return keeps_unit(tokens[0].text) ? unit : "";
  }
  return {};
}

}  // namespace

std::string unit_of(const SqlItem& item) {
  return unit_of_tokens(item.tokens);
}

}  // namespace oblique::server
