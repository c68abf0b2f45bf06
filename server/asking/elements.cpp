#include "server/asking/elements.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "server/asking/sql/sql_items.h"
#include "server/asking/sql/sql_literals.h"
#include "server/asking/suggestions.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using ElementTokens = std::span<const SqlToken>;

constexpr std::string_view kDuration = "duration_s";

/// A list as one speaks of a single element of it.
struct Single {
  std::string_view name;
  std::string_view list;
};
constexpr std::array<Single, 5> kSingles{{{"peak", "peaks"},
                                          {"ft_peak", "ft_peaks"},
                                          {"phase", "phases"},
                                          {"stick", "stick_intervals"},
                                          {"reaction_peak", "reaction_peaks"}}};

std::optional<std::size_t> number_of_member(const solver::ResultList& list, std::string_view name) {
  const auto found = std::find(list.members.begin(), list.members.end(), name);
  return found == list.members.end()
             ? std::nullopt
             : std::optional(static_cast<std::size_t>(found - list.members.begin()));
}

bool lasts(const solver::ResultList& list) {
  return number_of_member(list, "t0_s").has_value();
}

std::string unit_of_member(std::string_view member) {
  for (const std::string_view unit : {"s", "N"}) {
    if (member.ends_with(fmt::format("_{}", unit))) {
      return std::string(unit);
    }
  }
  return {};
}

std::vector<std::string> members_of(const solver::ResultList& list) {
  std::vector<std::string> members(list.members.begin(), list.members.end());
  if (lasts(list)) {
    members.emplace_back(kDuration);
  }
  return members;
}

[[noreturn]] void refuse(const solver::ResultList& list, std::string_view written,
                         std::string_view member) {
  const auto members = members_of(list);
  throw solver::InputError(fmt::format("{}.{} is not allowed: the elements of {} have {}{}",
                                       written, member, list.column, fmt::join(members, ", "),
                                       did_you_mean_some(member, members)));
}

/// A member of the element that `element` is in SQL.
ElementReference member_of(const solver::ResultList& list, std::string_view written,
                           std::string_view member, const std::string& element) {
  const auto value = [&](std::string_view name) {
    return fmt::format("({} ->> {})", element, *number_of_member(list, name));
  };
  if (member == kDuration && lasts(list)) {
    return {0, fmt::format("({} - {})", value("t1_s"), value("t0_s")), "s"};
  }
  if (!number_of_member(list, member)) {
    refuse(list, written, member);
  }
  return {0, value(member), unit_of_member(member)};
}

/// The number in "[2]"; -1 is the last. Throws for other texts.
std::int64_t number_in_brackets(std::string_view list, std::string_view brackets) {
  constexpr double kMost = 1e6;
  const auto number = solver::number_of(brackets.substr(1, brackets.size() - 2));
  if (!number || !(*number >= -kMost && *number <= kMost) ||
      *number != static_cast<double>(static_cast<std::int64_t>(*number))) {
    throw solver::InputError(fmt::format(
        "{}{} is not allowed: in brackets stands a whole number, from 0, or -1 for the last", list,
        brackets));
  }
  return static_cast<std::int64_t>(*number);
}

std::string place(std::int64_t number) {
  return number < 0 ? fmt::format("'$[#{}]'", number) : fmt::format("'$[{}]'", number);
}

/// Whether a column packs plain numbers, or pairs of them.
std::optional<std::string> unit_of_plain_list(std::string_view column) {
  const auto* field = solver::find_result_column(column);
  const auto* part = field == nullptr ? nullptr : std::get_if<solver::ListPart>(&field->value);
  if (part != nullptr && (!part->member.empty() || !part->list->has_names)) {
    return std::string(field->unit);
  }
  return column == "lengths_m" ? std::optional<std::string>("m") : std::nullopt;
}

/// peaks[0].fn_N, peaks[0], fn_peaks_N[0]
ElementReference numbered(ElementTokens tokens) {
  const std::string_view name = tokens[0].text;
  const auto* list = solver::find_result_list(name);
  const auto plain = unit_of_plain_list(name);
  if (list == nullptr && !plain) {
    return {};
  }
  const auto number = number_in_brackets(name, tokens[1].text);
  if (list == nullptr) {
    return {2, fmt::format("({} ->> {})", name, place(number)), *plain};
  }
  const std::string element = fmt::format("({} -> {})", name, place(number));
  if (tokens.size() < 4 || !tokens[2].is_sign('.')) {
    return {2, element, std::string(list->unit)};
  }
  auto reference =
      member_of(*list, fmt::format("{}{}", name, tokens[1].text), name_of(tokens[3]), element);
  reference.tokens = 4;
  return reference;
}

/// Whether a name and what stands in brackets behind it are meant to be an element: for SQL both
/// together are a column and another name for it.
bool is_meant_as_element(ElementTokens tokens) {
  const std::string_view brackets = tokens[1].text;
  const bool touches = tokens[0].text.data() + tokens[0].text.size() == brackets.data();
  const bool has_number =
      brackets.size() > 2 && brackets.find_first_not_of("-0123456789[]") == std::string_view::npos;
  return (touches && has_number) || (tokens.size() > 2 && tokens[2].is_sign('.'));
}

[[noreturn]] void refuse_as_list(ElementTokens tokens) {
  std::vector<std::string> lists{"lengths_m"};
  for (const auto* list : solver::result_lists()) {
    lists.emplace_back(list->column);
  }
  for (const solver::ResultField& field : solver::result_fields()) {
    if (unit_of_plain_list(field.column)) {
      lists.emplace_back(field.column);
    }
  }
  throw solver::InputError(
      fmt::format("{0}{1} is not allowed: {0} is no list{2}; `oblique columns` lists elements",
                  tokens[0].text, tokens[1].text, did_you_mean_some(tokens[0].text, lists)));
}

/// The one element of a list that is the first of some order.
std::string element_by(std::string_view list, const std::string& order) {
  return fmt::format("(SELECT item.value FROM json_each({}) AS item ORDER BY {} LIMIT 1)", list,
                     order);
}

/// first_stick.t0_s, last_peak.fn_N, longest_phase.t1_s, largest_peak.t_s
ElementReference chosen(ElementTokens tokens) {
  const std::string_view written = tokens[0].text;
  const auto choice = written.substr(0, written.find('_'));
  const auto rest = written.substr(std::min(written.size(), choice.size() + 1));
  const auto single = std::find_if(kSingles.begin(), kSingles.end(),
                                   [&](const Single& known) { return known.name == rest; });
  if (single == kSingles.end()) {
    return {};
  }
  const auto& list = *solver::find_result_list(single->list);
  std::string element;
  if (choice == "first" || choice == "last") {
    element = fmt::format("({} -> {})", list.column, place(choice == "first" ? 0 : -1));
  } else if (choice == "longest" && lasts(list)) {
    element = element_by(
        list.column, fmt::format("(item.value ->> {}) - (item.value ->> {}) DESC, item.key",
                                 *number_of_member(list, "t1_s"), *number_of_member(list, "t0_s")));
  } else if (choice == "largest" && !lasts(list)) {
    // Forces follow the instant.
    element = element_by(list.column, "(item.value ->> 1) DESC, item.key");
  } else {
    return {};
  }
  auto reference = member_of(list, written, name_of(tokens[2]), element);
  reference.tokens = 3;
  return reference;
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

}  // namespace

ElementReference element_at(ElementTokens tokens) {
  if (tokens.size() < 2 || tokens[0].kind != SqlToken::Kind::kName) {
    return {};
  }
  if (is_word(tokens[0], "count_mode")) {
    return counted_mode(tokens);
  }
  if (tokens[1].text.front() == '[') {
    auto reference = numbered(tokens);
    if (reference.tokens == 0 && is_meant_as_element(tokens)) {
      refuse_as_list(tokens);
    }
    return reference;
  }
  if (tokens.size() < 3 || !tokens[1].is_sign('.') || !tokens[2].is_name()) {
    return {};
  }
  const bool is_list = solver::find_result_list(tokens[0].text) != nullptr;
  if (is_list && tokens[2].text == "count") {
    return {3, fmt::format("json_array_length({})", tokens[0].text), {}};
  }
  return chosen(tokens);
}

std::string in_sqlite(sqlite3* database, std::string_view text) {
  const auto tokens = sql_tokens(text);
  std::string sql;
  std::size_t copied = 0;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const auto reference = element_at(ElementTokens(tokens).subspan(i));
    if (reference.tokens == 0) {
      continue;
    }
    const auto begin = static_cast<std::size_t>(tokens[i].text.data() - text.data());
    sql += text.substr(copied, begin - copied);
    sql += reference.sql;
    i += reference.tokens - 1;
    copied = static_cast<std::size_t>(tokens[i].text.data() + tokens[i].text.size() - text.data());
  }
  sql += text.substr(copied);
  return with_exact_numbers(database, sql);
}

std::string columns_in_sqlite(sqlite3* database, std::string_view text) {
  const auto tokens = sql_tokens(text);
  std::string columns;
  for (const SqlItem& item : sql_items(tokens)) {
    const std::string sql = in_sqlite(database, item.text);
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

std::vector<std::string> all_elements() {
  std::vector<std::string> elements;
  for (const Single& single : kSingles) {
    const auto& list = *solver::find_result_list(single.list);
    elements.push_back(fmt::format("{}.count", list.column));
    for (const std::string& member : members_of(list)) {
      elements.push_back(fmt::format("{}[0].{}", list.column, member));
      for (const std::string_view choice : {"first", "last", lasts(list) ? "longest" : "largest"}) {
        elements.push_back(fmt::format("{}_{}.{}", choice, single.name, member));
      }
    }
  }
  return elements;
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
  forms.push_back({"first_stick.t0_s", "s",
                   "the same of the first element; first_ and last_ with peak, ft_peak, phase, "
                   "stick, reaction_peak"});
  forms.push_back({"longest_phase.duration_s", "s",
                   "of the element that lasts longest; longest_phase, longest_stick"});
  forms.push_back({"largest_peak.t_s", "s",
                   "of the element with the largest force; largest_peak, largest_ft_peak, "
                   "largest_reaction_peak"});
  return forms;
}

}  // namespace oblique::server
