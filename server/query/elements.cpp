#include "server/query/elements.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/suggestion.h"
#include "server/query/sql_functions.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using Tokens = std::span<const SqlToken>;
using solver::ResultList;

std::string unit_of_member(std::string_view member) {
  return member.ends_with("_s") ? "s" : member.ends_with("_N") ? "N" : "";
}

/// The index in "[2]" or "[-1]".
int index_in(std::string_view list, std::string_view brackets) {
  constexpr double kMost = 1e6;
  const auto number = solver::number_of(brackets.substr(1, brackets.size() - 2));
  if (!number || std::abs(*number) > kMost || *number != std::floor(*number)) {
    throw solver::InputError(fmt::format(
        "{}{} is not allowed: in brackets stands a whole number, from 0, or -1 for the last", list,
        brackets));
  }
  return static_cast<int>(*number);
}

/// A path of SQLite's JSON functions to element `index`.
std::string path_of(int index) {
  return index < 0 ? fmt::format("$[#{}]", index) : fmt::format("$[{}]", index);
}

/// Member `member` of phase `index`, computed from the list of the ends of phases: kind, beginning
/// or end. Compression comes first, then the kinds alternate; each phase begins at the end of the
/// previous one.
std::string phase_sql(int index, std::size_t member) {
  const std::string count = fmt::format("json_array_length({})", kStoredPhases);
  const auto end_of = [](int i) { return fmt::format("{} ->> '{}'", kStoredPhases, path_of(i)); };
  if (member == 2) {
    return fmt::format("({})", end_of(index));
  }
  const std::string exists =
      index < 0 ? fmt::format("{} >= {}", count, -index) : fmt::format("{} > {}", count, index);
  const std::string number =
      index < 0 ? fmt::format("({} - {})", count, -index) : std::to_string(index);
  return member == 0
             ? fmt::format("CASE WHEN {} THEN iif({} % 2, 'restitution', 'compression') END",
                           exists, number)
             : fmt::format("CASE WHEN {} THEN {} END", exists,
                           index == 0
                               ? "0.0"
                               : fmt::format("iif({} = 0, 0.0, {})", number, end_of(index - 1)));
}

/// A member of element `index` of a list, as an expression over the columns of `results`.
std::string member_sql(const ResultList& list, int index, std::size_t member) {
  const std::string path = path_of(index);
  if (list.column == "phases") {
    return phase_sql(index, member);
  }
  if (list.column == "ft_peaks") {
    // If `ft_peaks` is NULL, they are the times and tangential forces of `peaks`.
    return fmt::format(
        "CASE WHEN {0} IS NULL THEN peaks ->> '{1}[{2}]' ELSE {0} ->> '{1}[{3}]' END",
        kStoredFtPeaks, path, 2 * member, member);
  }
  return fmt::format("({} ->> '{}[{}]')", list.column, path, member);
}

/// Element `index` with all its members.
std::string element_sql(const ResultList& list, int index) {
  if (list.column != "phases" && list.column != "ft_peaks") {
    return fmt::format("({} -> '{}')", list.column, path_of(index));
  }
  std::vector<std::string> members;
  for (std::size_t i = 0; i < list.members.size(); ++i) {
    members.push_back(member_sql(list, index, i));
  }
  return fmt::format("CASE WHEN {} IS NOT NULL THEN json_array({}) END", members[0],
                     fmt::join(members, ", "));
}

std::string count_sql(const ResultList& list) {
  return list.column == "phases" ? fmt::format("json_array_length({})", kStoredPhases)
         : list.column == "ft_peaks"
             ? fmt::format("json_array_length(coalesce({}, peaks))", kStoredFtPeaks)
             : fmt::format("json_array_length({})", list.column);
}

/// The unit of a column that is a list of numbers, or of pairs of them; none for others.
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
ElementReference indexed(Tokens tokens) {
  const std::string_view name = tokens[0].text;
  const std::string_view brackets = tokens[1].text;
  const auto* list = solver::find_result_list(name);
  if (const auto unit = unit_of_plain_list(name); list == nullptr && unit) {
    return {2, fmt::format("({} ->> '{}')", name, path_of(index_in(name, brackets))), *unit};
  }
  if (list == nullptr) {
    // After a space SQL reads the brackets as an alias of the column.
    if (name.end() == brackets.begin()) {
      refuse_as_list(name, brackets);
    }
    return {};
  }
  const int index = index_in(name, brackets);
  if (tokens.size() < 4 || !tokens[2].is_sign('.')) {
    return {2, element_sql(*list, index), std::string(list->unit)};
  }
  const std::string member = name_of(tokens[3]);
  const auto found = std::find(list->members.begin(), list->members.end(), member);
  if (found == list->members.end()) {
    throw solver::InputError(fmt::format(
        "{}{}.{} is not allowed: the elements of {} have {}{}", name, brackets, member, name,
        fmt::join(list->members, ", "), protocol::did_you_mean(member, list->members)));
  }
  return {4, member_sql(*list, index, static_cast<std::size_t>(found - list->members.begin())),
          unit_of_member(member)};
}

/// count_mode('SC SR')
ElementReference counted_mode(Tokens tokens) {
  if (tokens.size() < 4 || !tokens[1].is_sign('(') || !tokens[3].is_sign(')') ||
      tokens[2].kind != SqlToken::Kind::kLiteral || tokens[2].text.front() != '\'') {
    throw solver::InputError(
        "count_mode() takes one mode in single quotes, ripples merged, as count_mode('SC SR')");
  }
  return {4, fmt::format("count(*) FILTER (WHERE major_mode = {})", tokens[2].text), {}};
}

/// Replaces tokens of `text`: `replacement(rest)` returns how many of the first tokens of `rest` to
/// replace, and the text for them.
template <typename Replacement>
std::string replaced(std::string_view text, const Replacement& replacement) {
  const auto tokens = sql_tokens(text);
  std::string result;
  const char* copied = text.data();
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const auto [count, sql] = replacement(Tokens(tokens).subspan(i));
    if (count > 0) {
      result.append(copied, tokens[i].text.begin());
      result += sql;
      i += count - 1;
      copied = tokens[i].text.end();
    }
  }
  return result.append(copied, text.end());
}

}  // namespace

ElementReference element_at(Tokens tokens) {
  if (tokens.size() < 2 || tokens[0].kind != SqlToken::Kind::kName) {
    return {};
  }
  if (is_word(tokens[0], "count_mode")) {
    return counted_mode(tokens);
  }
  if (tokens[1].text.front() == '[') {
    return indexed(tokens);
  }
  const auto* list = solver::find_result_list(tokens[0].text);
  if (list != nullptr && tokens.size() > 2 && tokens[1].is_sign('.') && tokens[2].text == "count") {
    return {3, count_sql(*list), {}};
  }
  return {};
}

std::string with_elements(std::string_view text) {
  return replaced(text, [](Tokens tokens) {
    ElementReference element = element_at(tokens);
    return std::pair(element.tokens, std::move(element.sql));
  });
}

std::string in_sqlite(std::string_view text) {
  return replaced(with_elements(text), [](Tokens tokens) {
    const SqlToken& token = tokens[0];
    // SQLite accepts only a literal before these words.
    const bool is_frame_offset =
        tokens.size() > 1 && (is_word(tokens[1], "preceding") || is_word(tokens[1], "following"));
    const bool is_decimal = !is_frame_offset && token.kind == SqlToken::Kind::kLiteral &&
                            token.text.find_first_of(".eE") != std::string_view::npos &&
                            decimal_number(token.text);
    return is_decimal
               ? std::pair(std::size_t{1}, fmt::format("{}('{}')", kNumberFunction, token.text))
               : std::pair(std::size_t{0}, std::string());
  });
}

std::string columns_in_sqlite(std::string_view text, std::span<const std::string> all_columns) {
  const auto tokens = sql_tokens(text);
  std::vector<std::string> columns;
  for (const SqlItem& item : sql_items(tokens)) {
    const bool is_distinct = item.tokens.size() > 1 && is_word(item.tokens[0], "distinct");
    const std::string_view expression(
        item.tokens.empty() ? item.text.begin() : item.tokens[is_distinct ? 1 : 0].text.begin(),
        item.text.end());
    const char* const distinct = is_distinct ? "DISTINCT " : "";
    if (expression == "*") {
      columns.push_back(fmt::format("{}{}", distinct, fmt::join(all_columns, ", ")));
      continue;
    }
    const std::string sql = in_sqlite(expression);
    columns.push_back(sql == expression
                          ? std::string(item.whole)
                          : fmt::format("{}{} AS {}", distinct, sql,
                                        sql_name(item.alias.empty() ? expression : item.alias)));
  }
  return fmt::format("{}", fmt::join(columns, ", "));
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
