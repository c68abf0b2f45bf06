#include "server/asking/elements.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "proto/suggestion.h"
#include "server/asking/sql/sql_functions.h"
#include "server/asking/sql/sql_items.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using ElementTokens = std::span<const SqlToken>;

std::string unit_of_member(std::string_view member) {
  return member.ends_with("_s") ? "s" : member.ends_with("_N") ? "N" : "";
}

/// The path of an element in JSON, from "[2]"; "[-1]" is the last.
std::string path_of(std::string_view list, std::string_view brackets) {
  constexpr double kMost = 1e6;
  const auto number = solver::number_of(brackets.substr(1, brackets.size() - 2));
  const auto whole =
      number && std::abs(*number) <= kMost ? static_cast<std::int64_t>(*number) : std::int64_t{0};
  if (!number || static_cast<double>(whole) != *number) {
    throw solver::InputError(fmt::format(
        "{}{} is not allowed: in brackets stands a whole number, from 0, or -1 for the last", list,
        brackets));
  }
  return whole < 0 ? fmt::format("'$[#{}]'", whole) : fmt::format("'$[{}]'", whole);
}

/// The unit of a column that is a list of plain numbers, or of pairs of them; none for others.
std::optional<std::string> unit_of_plain_list(std::string_view column) {
  const auto* field = solver::find_result_column(column);
  const auto* part = field == nullptr ? nullptr : std::get_if<solver::ListPart>(&field->value);
  if (part != nullptr && (!part->member.empty() || !part->list->has_names)) {
    return std::string(field->unit);
  }
  return column == "lengths_m" ? std::optional<std::string>("m") : std::nullopt;
}

[[noreturn]] void refuse_as_list(std::string_view name, std::string_view brackets) {
  std::vector<std::string_view> lists{"lengths_m"};
  for (const auto* list : solver::result_lists()) {
    lists.push_back(list->column);
  }
  for (const solver::ResultField& field : solver::result_fields()) {
    if (unit_of_plain_list(field.column)) {
      lists.push_back(field.column);
    }
  }
  throw solver::InputError(
      fmt::format("{0}{1} is not allowed: {0} is no list{2}; `oblique columns` lists elements",
                  name, brackets, protocol::did_you_mean(name, lists)));
}

/// peaks[0].fn_N, peaks[0] or fn_peaks_N[0]
ElementReference numbered(ElementTokens tokens) {
  const std::string_view name = tokens[0].text;
  const std::string_view brackets = tokens[1].text;
  const auto* list = solver::find_result_list(name);
  const auto plain = unit_of_plain_list(name);
  if (list == nullptr && !plain) {
    // Apart from the name, brackets are another name for the column.
    if (name.data() + name.size() == brackets.data()) {
      refuse_as_list(name, brackets);
    }
    return {};
  }
  const std::string path = path_of(name, brackets);
  if (list == nullptr) {
    return {2, fmt::format("({} ->> {})", name, path), *plain};
  }
  if (tokens.size() < 4 || !tokens[2].is_sign('.')) {
    return {2, fmt::format("({} -> {})", name, path), std::string(list->unit)};
  }
  const std::string member = name_of(tokens[3]);
  const auto found = std::find(list->members.begin(), list->members.end(), member);
  if (found == list->members.end()) {
    const std::vector<std::string_view> members(list->members.begin(), list->members.end());
    throw solver::InputError(fmt::format("{}{}.{} is not allowed: the elements of {} have {}{}",
                                         name, brackets, member, name, fmt::join(members, ", "),
                                         protocol::did_you_mean(member, members)));
  }
  return {4, fmt::format("({} -> {} ->> {})", name, path, found - list->members.begin()),
          unit_of_member(member)};
}

/// count_mode('SC SR')
ElementReference counted_mode(ElementTokens tokens) {
  if (tokens.size() < 4 || !tokens[1].is_sign('(') || !tokens[3].is_sign(')') ||
      tokens[2].kind != SqlToken::Kind::kLiteral || tokens[2].text.front() != '\'') {
    throw solver::InputError(
        "count_mode() takes one mode in single quotes, ripples merged, as count_mode('SC SR')");
  }
  return {4, fmt::format("count(*) FILTER (WHERE major_mode = {})", tokens[2].text), {}};
}

/// Appends what `text` has from `copied` to the beginning of `part`, which is a part of it, and
/// moves `copied` behind `part`.
void copy_before(std::string_view text, std::string_view part, std::size_t& copied,
                 std::string& to) {
  const auto begin = static_cast<std::size_t>(part.data() - text.data());
  to += text.substr(copied, begin - copied);
  copied = begin + part.size();
}

}  // namespace

ElementReference element_at(ElementTokens tokens) {
  if (tokens.size() < 2 || tokens[0].kind != SqlToken::Kind::kName) {
    return {};
  }
  if (is_word(tokens[0], "count_mode")) {
    return counted_mode(tokens);
  }
  if (tokens[1].text.front() == '[') {
    return numbered(tokens);
  }
  if (tokens.size() > 2 && tokens[1].is_sign('.') && tokens[2].text == "count" &&
      solver::find_result_list(tokens[0].text) != nullptr) {
    return {3, fmt::format("json_array_length({})", tokens[0].text), {}};
  }
  return {};
}

std::string with_elements(std::string_view text) {
  const auto tokens = sql_tokens(text);
  std::string sql;
  std::size_t copied = 0;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const auto reference = element_at(ElementTokens(tokens).subspan(i));
    if (reference.tokens > 0) {
      const std::size_t last = i + reference.tokens - 1;
      copy_before(text, tokens[i].text, copied, sql);
      sql += reference.sql;
      copied = static_cast<std::size_t>(tokens[last].text.data() - text.data()) +
               tokens[last].text.size();
      i = last;
    }
  }
  return sql += text.substr(copied);
}

std::string in_sqlite(std::string_view text) {
  const std::string sql = with_elements(text);
  std::string exact;
  std::size_t copied = 0;
  const auto tokens = sql_tokens(sql);
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const SqlToken& token = tokens[i];
    // SQLite takes only a literal before these words.
    const bool is_frame_offset = i + 1 < tokens.size() && (is_word(tokens[i + 1], "preceding") ||
                                                           is_word(tokens[i + 1], "following"));
    if (!is_frame_offset && token.kind == SqlToken::Kind::kLiteral &&
        token.text.find_first_of(".eE") != std::string_view::npos && decimal_number(token.text)) {
      copy_before(sql, token.text, copied, exact);
      exact += fmt::format("{}('{}')", kNumberFunction, token.text);
    }
  }
  return exact += std::string_view(sql).substr(copied);
}

std::string columns_in_sqlite(std::string_view text) {
  const auto tokens = sql_tokens(text);
  std::string columns;
  for (const SqlItem& item : sql_items(tokens)) {
    const std::string sql = in_sqlite(item.text);
    columns += columns.empty() ? "" : ", ";
    if (sql == item.text) {
      columns += item.whole;
      continue;
    }
    const bool is_distinct = is_word(item.tokens[0], "distinct") && item.tokens.size() > 1;
    const auto begin = is_distinct ? item.tokens[1].text.data() - item.text.data() : 0;
    std::string name = item.name.empty()
                           ? std::string(item.text.substr(static_cast<std::size_t>(begin)))
                           : item.name;
    for (std::size_t quote = name.find('"'); quote != std::string::npos;
         quote = name.find('"', quote + 2)) {
      name.insert(quote, 1, '"');
    }
    columns += fmt::format("{} AS \"{}\"", sql, name);
  }
  return columns;
}

std::vector<WrittenForm> element_forms() {
  std::vector<WrittenForm> forms;
  for (const auto* list : solver::result_lists()) {
    const std::string_view member = list->members.back() == "major" ? "fn_N" : list->members.back();
    forms.push_back({fmt::format("{}[0].{}", list->column, member), unit_of_member(member),
                     fmt::format("{} of the first element; -1 is the last{}. Members: {}", member,
                                 list->column == "peaks" ? ", and ripples count: major_peak_1_N "
                                                           "is the first peak that is none"
                                                         : "",
                                 fmt::join(list->members, ", "))});
    forms.push_back({fmt::format("{}.count", list->column), "", "number of elements"});
  }
  return forms;
}

}  // namespace oblique::server
