#include "server/query/plan.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <strings.h>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/expression.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"
#include "server/database/sqlite.h"
#include "server/query/columns.h"
#include "server/query/sql_text.h"
#include "server/store/schema.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using solver::InputError;
using Names = std::set<std::string, std::less<>>;

/// A clause of a query with its keyword.
struct Part {
  const char* flag;
  const char* keyword;
  std::string written;
  std::string sql{};  ///< translated for SQLite
};
using Parts = std::array<Part, 4>;

/// An expression about a list, which is replaced by SQL over the list's column: peaks[0].fn_N,
/// peaks[0], fn_peaks_N[-1], peaks.count or count_mode('SC SR'). Elements count from 0, like `seq`
/// in the views; -1 is the last element. A missing element is NULL.
struct Element {
  std::size_t tokens = 0;  ///< number of tokens; 0 if they do not form such an expression
  std::string column;
  std::string sql;
  std::string unit;
};

constexpr const char* kStoredPhases = "stored_phases";

int index_in(std::string_view list, std::string_view brackets) {
  const char* const end = brackets.data() + brackets.size() - 1;
  int index = 0;
  const auto [read, error] = std::from_chars(brackets.data() + 1, end, index);
  if (error != std::errc() || read != end) {
    throw InputError(fmt::format(
        "{}{} is not allowed: write a whole number in brackets, from 0, or -1 for the last", list,
        brackets));
  }
  return index;
}

/// Returns SQL for the kind, start or end of phase `index`. Compression comes first, kinds
/// alternate, and each phase starts at the end of the previous one. This is much faster than
/// reading the list of the view.
std::string phase_sql(int index, std::size_t member) {
  const std::string count = fmt::format("json_array_length({})", kStoredPhases);
  const std::string i = index < 0 ? fmt::format("({} - {})", count, -index) : std::to_string(index);
  const std::string value =
      member == 0   ? fmt::format("iif({} % 2, 'restitution', 'compression')", i)
      : member == 1 ? fmt::format("iif({0} = 0, 0.0, {1} ->> ({0} - 1))", i, kStoredPhases)
                    : fmt::format("{} ->> {}", kStoredPhases, i);
  return fmt::format("CASE WHEN {0} BETWEEN 0 AND {1} - 1 THEN {2} END", i, count, value);
}

/// Casts to a real number, because SQL would divide JSON's whole numbers as integers.
std::string as_real(const std::string& sql) {
  return fmt::format("CAST({} AS REAL)", sql);
}

Element indexed(SqlTokens tokens) {
  const std::string name(tokens[0].text);
  if (!is_list_column(name)) {
    throw InputError(fmt::format(
        "{0}{1} is not allowed: {0} is not a list; see `oblique columns` for elements of lists",
        name, tokens[1].text));
  }
  const int index = index_in(name, tokens[1].text);
  const std::string path = fmt::format("$[{}{}]", index < 0 ? "#" : "", index);
  const auto* list = solver::find_result_list(name);
  if (list == nullptr || tokens.size() < 4 || !tokens[2].is_sign(".")) {
    const std::string sql = fmt::format("({} ->> '{}')", name, path);
    return {2, name, is_list_of_numbers(name) ? as_real(sql) : sql, unit_of_column(name)};
  }
  const std::string member = name_of(tokens[3]);
  const auto found = std::ranges::find(list->members, member);
  if (found == list->members.end()) {
    throw InputError(fmt::format("{}{}.{} is not allowed: the elements of {} have {}{}", name,
                                 tokens[1].text, member, name, fmt::join(list->members, ", "),
                                 protocol::did_you_mean(member, list->members)));
  }
  const auto number = static_cast<std::size_t>(found - list->members.begin());
  const bool is_phase = name == "phases";
  const std::string sql =
      is_phase ? phase_sql(index, number) : fmt::format("({} ->> '{}[{}]')", name, path, number);
  const std::string unit = unit_of_member(member);
  return {4, is_phase ? kStoredPhases : name, unit.empty() ? sql : as_real(sql), unit};
}

Element element_at(SqlTokens tokens) {
  if (tokens.size() < 2 || tokens[0].kind != SqlToken::Kind::kName) {
    return {};
  }
  // SQL reads "[0]" after a space as an alias and would return the whole list.
  const bool touches = tokens[0].text.end() == tokens[1].text.begin();
  if (tokens[1].text.front() == '[' && (touches || is_list_column(tokens[0].text))) {
    return indexed(tokens);
  }
  if (tokens.size() > 2 && tokens[1].is_sign(".") && tokens[2].text == "count" &&
      solver::find_result_list(tokens[0].text) != nullptr) {
    const std::string column(tokens[0].text == "phases" ? kStoredPhases : tokens[0].text);
    return {3, column, fmt::format("json_array_length({})", column), {}};
  }
  if (!is_word(tokens[0], "count_mode")) {
    return {};
  }
  if (tokens.size() < 4 || !tokens[1].is_sign("(") || !tokens[3].is_sign(")") ||
      tokens[2].text.front() != '\'') {
    throw InputError(
        "count_mode() needs one mode in single quotes, with ripples merged, as count_mode('SC "
        "SR')");
  }
  return {
      4, "major_mode", fmt::format("count(*) FILTER (WHERE major_mode = {})", tokens[2].text), {}};
}

SqlTokens arguments_of(SqlTokens tokens, std::size_t i) {
  const std::size_t end = std::min(closing_bracket(tokens, i + 1), tokens.size());
  return tokens.subspan(i + 2, end - i - 2);
}

bool is_text(const SqlToken& token) {
  return token.text.front() == '\'' || kind_of_values(token.text) == protocol::CellKind::kText;
}

/// Returns whether a number is the nearest double here, as in studies. SQLite 3.40 may read another
/// double, and keeps whole numbers beyond 2^53.
bool is_real(const SqlToken& token) {
  return token.kind == SqlToken::Kind::kLiteral && solver::number_of(token.text) &&
         (token.text.find_first_of(".eE") != std::string_view::npos || token.text.size() > 7);
}

/// Returns SQL that has the meaning of a number, operator or function in expressions of studies
/// (proto/recipe/README.md); an empty text if SQLite gives the token this meaning.
std::string as_in_studies(SqlTokens tokens, std::size_t i) {
  const SqlToken& token = tokens[i];
  const auto is_next = [&](std::string_view sign) {
    return i + 1 < tokens.size() && tokens[i + 1].is_sign(sign);
  };
  if (token.is_sign("^")) {
    throw InputError("write pow(a, b) instead of a ^ b in a query");
  }
  if (token.is_sign("|") && is_next("|") && i > 0 && i + 2 < tokens.size() &&
      !is_text(tokens[i - 1]) && !is_text(tokens[i + 2])) {
    throw InputError("write OR instead of || in a query, in which || joins texts");
  }
  if (token.is_sign("/")) {
    return "* 1.0 /";  // an integer divided by an integer is a double
  }
  if (is_real(token) || (token.text == "pi" && !is_next("("))) {
    return fmt::format("{}('{}')", kNumberFunction,
                       token.text == "pi" ? solver::exact_number(std::numbers::pi) : token.text);
  }
  if (token.is_name() && is_next("(")) {
    const std::string name = name_of(token);
    const std::size_t arguments = sql_items(arguments_of(tokens, i)).size();
    for (const auto& function : expressions::functions()) {
      if (function.arguments == arguments &&
          strcasecmp(name.c_str(), std::string(function.name).c_str()) == 0) {
        return fmt::format("{}{}", kExpressionPrefix, function.name);
      }
    }
  }
  return {};
}

/// Translates `tokens` for SQLite. Adds the columns and other names in them to `names`.
std::string in_sqlite(SqlTokens tokens, Names& names) {
  std::string result;
  const char* copied = text_over(tokens).data();
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    Element element = element_at(tokens.subspan(i));
    if (const auto sql = as_in_studies(tokens, i); element.tokens == 0 && !sql.empty()) {
      element = {1, {}, sql, {}};
    }
    if (element.tokens > 0) {
      names.insert(element.column);
      result.append(copied, tokens[i].text.begin()) += element.sql;
      i += element.tokens - 1;
      copied = tokens[i].text.end();
    } else if (tokens[i].is_name()) {
      names.insert(name_of(tokens[i]));
    }
  }
  return tokens.empty() ? result : result.append(copied, text_over(tokens).end());
}

const SqlFunction* function_at(SqlTokens tokens, std::size_t i) {
  if (i + 1 >= tokens.size() || !tokens[i + 1].is_sign("(")) {
    return nullptr;
  }
  const auto functions = sql_functions();
  const auto found = std::ranges::find_if(
      functions, [&](const SqlFunction& each) { return is_word(tokens[i], each.name); });
  return found == functions.end() ? nullptr : &*found;
}

/// Returns whether an aggregate function is called at token `i`. min and max with several arguments
/// do not aggregate.
bool is_aggregate(SqlTokens tokens, std::size_t i) {
  const SqlFunction* const function = function_at(tokens, i);
  const bool compares = function != nullptr && (function->name == "min" || function->name == "max");
  return function != nullptr && function->aggregates &&
         (!compares || sql_items(arguments_of(tokens, i)).size() == 1);
}

/// Returns the index of the first token outside subqueries for which `is_it` is true, or the number
/// of tokens if `is_it` is true for none.
template <class Predicate>
std::size_t find_outside_subqueries(SqlTokens tokens, const Predicate& is_it) {
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (is_it(i)) {
      return i;
    }
    const bool is_subquery =
        tokens[i].is_sign("(") && i + 1 < tokens.size() && is_word(tokens[i + 1], "select");
    i = is_subquery ? closing_bracket(tokens, i) : i;
  }
  return tokens.size();
}

bool has_aggregate(SqlTokens tokens) {
  return find_outside_subqueries(tokens, [&](std::size_t i) { return is_aggregate(tokens, i); }) <
         tokens.size();
}

bool has_window(SqlTokens tokens) {
  return std::ranges::any_of(tokens, [](const SqlToken& token) { return is_word(token, "over"); });
}

Names aliases_of(SqlTokens tokens) {
  Names aliases;
  for (std::size_t i = 1; i < tokens.size(); ++i) {
    if (is_word(tokens[i - 1], "as") && tokens[i].is_name()) {
      aliases.insert(name_of(tokens[i]));
    }
  }
  return aliases;
}

/// Throws InputError for a name that differs from a column only in case, because SQL ignores case.
/// Does not check function names, aliases and names in `free`.
void check_letter_case(const Part& part, const Names& free) {
  const auto tokens = sql_tokens(part.written);
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const bool is_call = i + 1 < tokens.size() && tokens[i + 1].is_sign("(");
    if (!tokens[i].is_name() || is_call || (i > 0 && is_word(tokens[i - 1], "as"))) {
      continue;
    }
    const std::string name = name_of(tokens[i]);
    const auto column = std::ranges::find_if(all_columns(), [&](const Column& each) {
      return strcasecmp(each.name.c_str(), name.c_str()) == 0;
    });
    if (column != all_columns().end() && find_column(name) == nullptr && !free.contains(name)) {
      throw InputError(
          not_allowed(part.flag, part.written,
                      fmt::format("{0} is not a column, and SQL ignores case: write {1}{2}", name,
                                  column->name, name == "E" ? ", or E_Pa" : "")));
    }
  }
}

/// Throws InputError if a selected expression without an aggregate function names a column that is
/// not in --group: SQL would take its value from an arbitrary point. This also applies to
/// aggregates without --group.
void check_grouped(const Part& select, const Part& group) {
  const auto selected = sql_tokens(select.written);
  if (has_window(selected) || (group.written.empty() && !has_aggregate(selected))) {
    return;
  }
  Names keys;
  const auto group_tokens = sql_tokens(group.written);
  (void)in_sqlite(group_tokens, keys);
  for (const SqlTokens item : sql_items(selected)) {
    const bool is_all = item.size() == 1 && item[0].is_sign("*");
    const bool has_key_as_alias =
        !item.empty() && item.back().is_name() && keys.contains(name_of(item.back()));
    const std::size_t column = find_outside_subqueries(item, [&](std::size_t i) {
      return item[i].is_name() && find_column(name_of(item[i])) != nullptr &&
             !keys.contains(name_of(item[i]));
    });
    if (is_all || (column < item.size() && !has_key_as_alias && !has_aggregate(item))) {
      throw InputError(not_allowed(
          select.flag, select.written,
          fmt::format("{0} has many values in {1}: use an aggregate, as avg({0}), or add it to "
                      "--group",
                      is_all ? "*" : item[column].text,
                      keys.empty() ? "the one row of all points" : "a group")));
    }
  }
}

/// Returns the unit of a column, an element, or a function that keeps the unit of its argument;
/// empty for pure numbers, texts and other expressions.
std::string unit_of(SqlTokens tokens) {
  if (tokens.size() > 2 && is_word(tokens[tokens.size() - 2], "as")) {
    tokens = tokens.first(tokens.size() - 2);
  }
  if (tokens.size() == 1 && tokens[0].is_name()) {
    return unit_of_column(name_of(tokens[0]));
  }
  const Element element = element_at(tokens);
  if (element.tokens > 0) {
    return element.tokens == tokens.size() ? element.unit : std::string();
  }
  const SqlFunction* const function = function_at(tokens, 0);
  const bool is_whole_call = function != nullptr && closing_bracket(tokens, 1) == tokens.size() - 1;
  return is_whole_call && function->keeps_unit ? unit_of(sql_items(arguments_of(tokens, 0)).front())
                                               : std::string();
}

/// Returns the names of all columns: first those of the view `runs` in its order, then all others.
std::vector<std::string> names_of_star(sqlite3* database) {
  std::vector<std::string> names;
  const StatementHandle view = prepare_query(database, "SELECT * FROM runs");
  for (int i = 0; i < sqlite3_column_count(view.get()); ++i) {
    const char* const name = sqlite3_column_name(view.get(), i);
    if (name != nullptr && find_column(name) != nullptr) {
      names.emplace_back(name);
    }
  }
  for (const Column& column : all_columns()) {
    if (std::ranges::find(names, column.name) == names.end()) {
      names.push_back(column.name);
    }
  }
  return names;
}

/// Returns the selected columns, and an SQL expression for each. Expands `*` to all columns.
std::pair<std::vector<PlannedColumn>, std::vector<std::string>> selected_columns(sqlite3* database,
                                                                                 SqlTokens tokens,
                                                                                 Names& names) {
  std::vector<PlannedColumn> columns;
  std::vector<std::string> sql;
  for (const SqlTokens item : sql_items(tokens)) {
    if (item.size() != 1 || !item[0].is_sign("*")) {
      columns.push_back({std::string(text_over(item)), unit_of(item)});
      sql.push_back(in_sqlite(item, names));
      continue;
    }
    for (const std::string& name : names_of_star(database)) {
      columns.push_back({name, unit_of_column(name)});
      sql.push_back(name);
      names.insert(name);
    }
  }
  return {std::move(columns), std::move(sql)};
}

// ---- Ranges of points ---------------------------------------------------------------------------

using Ranges = std::vector<PointRange>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Maximum number of ranges. Longer lists are merged into one range, because preparing the
/// statement would take long.
constexpr std::size_t kMaxRanges = 20'000;
/// Maximum nesting of a condition. Deeper conditions do not restrict the ranges.
constexpr int kDeepest = 50;

/// Returns the range from the first to the last point of `ranges`, which must not be empty.
Ranges hull(const Ranges& ranges) {
  return {{ranges.front().first, ranges.back().last}};
}

struct Interval {
  double low = -kInfinity;
  double high = kInfinity;
};
/// The allowed interval of each restricted column.
using Intervals = std::map<std::string, Interval, std::less<>>;

/// Returns the number in `tokens`, which may have a sign; none if they are not a single number.
std::optional<double> number_in(SqlTokens tokens) {
  const bool is_negative = !tokens.empty() && tokens[0].is_sign("-");
  if (is_negative || (!tokens.empty() && tokens[0].is_sign("+"))) {
    tokens = tokens.subspan(1);
  }
  const bool is_literal = tokens.size() == 1 && tokens[0].kind == SqlToken::Kind::kLiteral;
  const auto number = is_literal ? solver::number_of(tokens[0].text) : std::nullopt;
  return number && is_negative ? std::optional(-*number) : number;
}

void restrict_column(Intervals& intervals, SqlTokens column, std::optional<double> low,
                     std::optional<double> high) {
  if (column.size() == 1 && column[0].kind == SqlToken::Kind::kName && low && high) {
    Interval& known = intervals[std::string(column[0].text)];
    known = {std::max(known.low, *low), std::min(known.high, *high)};
  }
}

/// Narrows the interval of the column in conditions such as `column BETWEEN number AND number` or
/// `column < number`. Ignores other conditions.
void add_condition(Intervals& intervals, SqlTokens tokens) {
  if (tokens.size() > 2 && is_word(tokens[1], "between")) {
    const auto middle =
        std::ranges::find_if(tokens, [](const SqlToken& token) { return is_word(token, "and"); });
    if (middle != tokens.end()) {
      restrict_column(intervals, tokens.first(1), number_in({tokens.begin() + 2, middle}),
                      number_in({middle + 1, tokens.end()}));
    }
    return;
  }
  const bool is_comparison = tokens.size() > 2 && tokens[1].kind == SqlToken::Kind::kSign;
  const auto number = is_comparison ? number_in(tokens.subspan(2)) : std::nullopt;
  if (!number) {
    return;
  }
  const std::string_view sign = tokens[1].text;
  if (sign == "=" || sign == "==") {
    restrict_column(intervals, tokens.first(1), number, number);
  } else if (sign == "<" || sign == "<=") {
    restrict_column(intervals, tokens.first(1), -kInfinity, number);
  } else if (sign == ">" || sign == ">=") {
    restrict_column(intervals, tokens.first(1), number, kInfinity);
  }
}

/// Splits `tokens` at AND into conditions. Returns a single condition if it is not a conjunction.
std::vector<SqlTokens> conjuncts_of(SqlTokens tokens, int depth = 0) {
  const bool is_in_brackets =
      !tokens.empty() && tokens[0].is_sign("(") && closing_bracket(tokens, 0) == tokens.size() - 1;
  if (is_in_brackets && depth < kDeepest) {
    return conjuncts_of(tokens.subspan(1, tokens.size() - 2), depth + 1);
  }
  std::vector<SqlTokens> conjuncts;
  std::size_t begin = 0;
  std::size_t open_betweens = 0;
  for (std::size_t i = 0; i <= tokens.size(); ++i) {
    const bool is_end = i == tokens.size();
    if (!is_end && (is_word(tokens[i], "or") || is_word(tokens[i], "case"))) {
      return {tokens};  // not a conjunction
    }
    if (is_end || (is_word(tokens[i], "and") && open_betweens == 0)) {
      const SqlTokens part = tokens.subspan(begin, i - begin);
      const bool is_whole = part.size() == tokens.size();
      const auto inner = is_whole ? std::vector{part} : conjuncts_of(part, depth);
      conjuncts.insert(conjuncts.end(), inner.begin(), inner.end());
      begin = i + 1;
    } else if (is_word(tokens[i], "and")) {
      --open_betweens;
    } else if (is_word(tokens[i], "between")) {
      ++open_betweens;
    } else if (tokens[i].is_sign("(")) {
      i = std::min(closing_bracket(tokens, i), tokens.size() - 1);
    }
  }
  return conjuncts;
}

/// Returns whether the condition requires `error IS NOT NULL`, so only failed points can meet it.
bool requires_failure(std::string_view condition) {
  constexpr std::array<std::string_view, 4> kWords{"error", "is", "not", "null"};
  const auto tokens = sql_tokens(condition);
  return std::ranges::any_of(conjuncts_of(tokens), [&](SqlTokens conjunct) {
    return std::ranges::equal(conjunct, kWords, is_word);
  });
}

/// Returns the allowed interval of an axis; nullptr if it is not restricted or depends on other
/// axes.
const Interval* interval_of(const protocol::Axis& axis, const Intervals& intervals) {
  const auto found = intervals.find(column_of_key(axis.key()));
  // Excludes lengths, because an axis for one link also changes the column `length`. Excludes
  // `integrator`, because it is a text.
  const bool is_own = protocol::has_own_values(axis) && !axis.key().starts_with("length") &&
                      axis.key() != "integrator";
  return found == intervals.end() || !is_own ? nullptr : &found->second;
}

/// Returns the index of the first value of a range that is >= `value`; the number of values if all
/// are smaller.
std::uint64_t first_value_from(const protocol::Axis& axis, double value) {
  std::uint64_t first = 0;
  for (std::uint64_t end = axis.count(); first < end;) {
    const std::uint64_t middle = first + (end - first) / 2;
    if (protocol::axis_value(axis, middle) < value) {
      first = middle + 1;
    } else {
      end = middle;
    }
  }
  return first;
}

/// Returns the indices of an axis's first and last value in `interval`; none if no value is in it.
/// If the axis is a range, the result is one value wider at each end.
std::optional<PointRange> numbers_in(const protocol::Axis& axis, const Interval& interval) {
  if (axis.count() > 0) {
    if (interval.low > interval.high) {
      return std::nullopt;
    }
    const std::uint64_t first = first_value_from(axis, interval.low);
    const std::uint64_t last = first_value_from(axis, interval.high) + 1;
    return PointRange{first - std::min<std::uint64_t>(first, 1), std::min(last, axis.count() - 1)};
  }
  std::optional<PointRange> found;
  for (int i = 0; i < axis.values_size(); ++i) {
    if (axis.values(i) >= interval.low && axis.values(i) <= interval.high) {
      const auto number = static_cast<std::uint64_t>(i);
      found = {found ? found->first : number, number};
    }
  }
  return found;
}

/// Returns the ranges of a block's points that may be in `intervals`. The block's first point is 0.
/// Loops over the axes from the last, which varies fastest, to the first.
Ranges ranges_in(const protocol::Block& block, const Intervals& intervals) {
  const std::uint64_t points = protocol::points_of_block(block);
  if (points == 0) {
    return {};
  }
  if (block.has_sample() || block.zip()) {
    return {{0, points - 1}};
  }
  Ranges ranges{{0, 0}};  // ranges over axis `a` and all later axes
  std::uint64_t stride = 1;
  for (int a = block.axes_size(); a-- > 0;) {
    const protocol::Axis& axis = block.axes(a);
    const std::uint64_t size = protocol::axis_size(axis);
    const Interval* const interval = interval_of(axis, intervals);
    const auto numbers =
        interval == nullptr ? PointRange{0, size - 1} : numbers_in(axis, *interval);
    if (!numbers) {
      return {};
    }
    const PointRange all = hull(ranges).front();
    const bool is_whole = ranges.size() == 1 && all == PointRange{0, stride - 1};
    if (is_whole || numbers->last - numbers->first >= kMaxRanges / ranges.size()) {
      ranges = {{numbers->first * stride + all.first, numbers->last * stride + all.last}};
    } else {
      Ranges copies;
      for (std::uint64_t i = numbers->first; i <= numbers->last; ++i) {
        for (const PointRange& range : ranges) {
          copies.push_back({i * stride + range.first, i * stride + range.last});
        }
      }
      ranges = std::move(copies);
    }
    stride *= size;
  }
  return ranges;
}

struct QueriedStudy {
  std::string name;
  std::int64_t study_id = 0;
  std::uint64_t points = 0;
  protocol::Recipe recipe{};  ///< has no blocks if the stored bytes are invalid
};

QueriedStudy find_study(sqlite3* database, const std::string& name) {
  Statement study(database, "SELECT study_id, points, recipe FROM studies WHERE name = ?1");
  study.bind(1, name);
  if (!study.step()) {
    throw NoSuchStudy(no_such_study(database, name));
  }
  QueriedStudy found{name, study.integer(0), study.number(1)};
  if (!protocol::parse_recipe(study.bytes(2), found.recipe)) {
    found.recipe.Clear();
  }
  return found;
}

/// SQL for rows of a study: all rows that meet the condition, and possibly others.
struct Rows {
  std::string sql;
  bool are_sorted = false;  ///< true if rows come in order of points without ORDER BY
};

/// Returns SQL for the rows with the columns in `names`. Reads the table `results` if it has all
/// these columns, because looking up model and worker for each row is slow. A user's condition
/// cannot reach rows of other studies.
Rows rows_of(const QueriedStudy& study, const std::string& where, const Names& names) {
  std::string selected = "runs.point AS point";
  bool are_stored = true;
  for (const Column& column : all_columns()) {
    if (names.contains(column.name) && column.name != "point") {
      selected += fmt::format(
          ", {} AS {}", column.name == "study" ? sql_text(study.name) : column.sql, column.name);
      are_stored = are_stored && column.is_stored;
    }
  }
  if (names.contains(kStoredPhases)) {
    selected += fmt::format(
        ", {} AS {}",
        are_stored ? "runs.phases"
                   : "(SELECT phases FROM results AS stored WHERE stored.study_id = runs.study_id "
                     "AND stored.point = runs.point)",
        kStoredPhases);
  }
  const auto ranges = point_ranges(study.recipe, where);
  std::string join;
  std::string condition;
  if (study.recipe.blocks().empty() || points_in(ranges) == study.points) {
    // Without a range, SQLite can look up the points that the user's condition names.
    condition = "1";
  } else if (ranges.size() < 2) {
    condition = ranges.empty()
                    ? "0"
                    : fmt::format("runs.point BETWEEN {} AND {}", ranges[0].first, ranges[0].last);
  } else {
    // SQLite reads a JSON list faster than it compiles VALUES. CROSS JOIN makes it read the ranges
    // one after another, and the rows of each range by their key.
    for (const PointRange& range : ranges) {
      join += fmt::format("{}\"{}\":{}", join.empty() ? "" : ",", range.first, range.last);
    }
    join = fmt::format("json_each('{{{}}}') AS span CROSS JOIN ", join);
    condition = "runs.point BETWEEN CAST(span.key AS INTEGER) AND span.value";
  }
  if (requires_failure(where)) {
    condition += fmt::format(
        " AND runs.point IN (SELECT point FROM results INDEXED BY failed_points WHERE study_id = {}"
        " AND error IS NOT NULL)",
        study.study_id);
  }
  return {fmt::format("(SELECT {} FROM {}{} AS runs WHERE runs.study_id = {} AND {}) AS picked",
                      selected, join, are_stored ? "results" : "runs", study.study_id, condition),
          ranges.size() > 1};
}

std::string statement_of(std::span<const Part> parts, const std::string& rows) {
  std::string sql = fmt::format("{} {} FROM {}", parts[0].keyword, parts[0].sql, rows);
  for (const Part& part : parts.subspan(1)) {
    sql += part.sql.empty() ? std::string() : fmt::format(" {} {}", part.keyword, part.sql);
  }
  return sql;
}

/// Returns a hint if SQLite's message is about an unknown column or function; else an empty text.
std::string name_hint(const std::string& message) {
  const auto colon = message.rfind(": ");
  if (!message.starts_with("no such ") || colon == std::string::npos) {
    return {};
  }
  std::vector<std::string_view> names;  // names without brackets
  const auto columns = columns_and_functions();
  for (const Column& column : columns) {
    names.push_back(std::string_view(column.name).substr(0, column.name.find('(')));
  }
  return protocol::did_you_mean(message.substr(colon + 2), names) +
         "; `oblique columns` lists columns and functions; write texts in single quotes";
}

/// Throws InputError for a statement that SQLite refuses. The error names the first clause that
/// SQLite refuses, because SQLite's message about the whole statement may quote text that the user
/// did not write.
[[noreturn]] void refuse(sqlite3* database, const Parts& parts, const std::string& rows) {
  for (std::size_t count = 1; count <= parts.size(); ++count) {
    const Part& last = parts[count - 1];
    try {
      (void)prepare_query(database, statement_of(std::span(parts).first(count), rows));
    } catch (const StatementError& error) {
      throw InputError(
          not_allowed(last.flag, last.written, error.what() + name_hint(error.what())));
    }
  }
  throw InputError("the query is too long");
}

/// Returns the clauses of `question`; selects the default columns if `question` selects none.
/// Throws InputError for a clause that check_sql_part refuses.
Parts parts_of(const protocol::StudyQuery& question, const protocol::Recipe& recipe) {
  std::string select = fmt::format("{}", fmt::join(question.select(), ", "));
  if (select.empty()) {
    select = question.group().empty() ? fmt::format("{}", fmt::join(usual_columns(recipe), ", "))
                                      : question.group() + ", count(*)";
  }
  Parts parts{{{"--select", "SELECT", std::move(select)},
               {"--where", "WHERE", question.where()},
               {"--group", "GROUP BY", question.group()},
               {"--order", "ORDER BY", question.order()}}};
  for (const Part& part : parts) {
    if (!part.written.empty()) {
      check_sql_part(part.flag, part.written);
    }
  }
  return parts;
}

}  // namespace

std::vector<PointRange> point_ranges(const protocol::Recipe& recipe, std::string_view condition) {
  const auto tokens = sql_tokens(condition);
  Intervals intervals;
  for (const SqlTokens conjunct : conjuncts_of(tokens)) {
    add_condition(intervals, conjunct);
  }
  Ranges ranges;
  std::uint64_t points = 0;
  for (const protocol::Block& block : recipe.blocks()) {
    for (const PointRange& range : ranges_in(block, intervals)) {
      if (!ranges.empty() && ranges.back().last + 1 == points + range.first) {
        ranges.back().last = points + range.last;
      } else {
        ranges.push_back({points + range.first, points + range.last});
      }
    }
    if (ranges.size() > kMaxRanges) {
      ranges = hull(ranges);
    }
    points += protocol::points_of_block(block);
  }
  return ranges;
}

std::uint64_t points_in(const std::vector<PointRange>& ranges) {
  std::uint64_t points = 0;
  for (const PointRange& range : ranges) {
    points += range.last - range.first + 1;
  }
  return points;
}

std::string no_such_study(sqlite3* database, const std::string& name) {
  constexpr std::size_t kMaxCompared = 10'000;
  Statement list(database, "SELECT name FROM studies");
  std::vector<std::string> names;
  while (names.size() < kMaxCompared && list.step()) {
    names.push_back(list.text(0));
  }
  return fmt::format(
      "there is no study called \"{}\"{}", name,
      protocol::did_you_mean(name, std::vector<std::string_view>(names.begin(), names.end())));
}

namespace {

/// Plans the query of a study. Errors call the selected columns `select_flag`.
Plan plan_of(sqlite3* database, const QueriedStudy& study, const protocol::StudyQuery& question,
             const char* select_flag) {
  Parts parts = parts_of(question, study.recipe);
  parts[0].flag = select_flag;
  auto& [select, where, group, order] = parts;
  const auto tokens = sql_tokens(select.written);
  for (const Part& part : parts) {
    // In ORDER BY, SQL looks a name up among the aliases first. So aliases are allowed there.
    check_letter_case(part, &part == &order ? aliases_of(tokens) : Names());
  }
  check_grouped(select, group);
  Names names;
  for (Part* part : {&where, &group, &order}) {
    const auto part_tokens = sql_tokens(part->written);
    part->sql = in_sqlite(part_tokens, names);
  }
  const bool is_distinct = tokens.size() > 1 && is_word(tokens[0], "distinct");
  auto [columns, columns_sql] =
      selected_columns(database, SqlTokens(tokens).subspan(is_distinct ? 1 : 0), names);
  select.sql = fmt::format("{}{}", is_distinct ? "DISTINCT " : "", fmt::join(columns_sql, ", "));
  const Rows rows = rows_of(study, where.written, names);
  if (order.sql.empty() && (!group.sql.empty() || !rows.are_sorted || has_window(tokens))) {
    order.sql = group.sql.empty() ? "picked.point" : group.sql;
  }
  Plan plan{statement_of(parts, rows.sql), {nullptr, nullptr}, std::move(columns)};
  if (question.has_limit()) {
    plan.sql += fmt::format(" LIMIT {}", std::min<std::uint64_t>(question.limit(), INT64_MAX));
  }
  try {
    plan.statement = prepare_query(database, plan.sql);
  } catch (const StatementError&) {
    refuse(database, parts, rows.sql);
  }
  // SQLite names a column after its alias or, without an alias, after its SQL, which may be a
  // translation of the user's text. Only aliases become names here.
  for (std::size_t i = 0; i < plan.columns.size(); ++i) {
    const char* name = sqlite3_column_name(plan.statement.get(), static_cast<int>(i));
    if (name != nullptr && name != columns_sql[i]) {
      plan.columns[i].name = name;
    }
  }
  return plan;
}

}  // namespace

Plan plan(sqlite3* database, const protocol::StudyQuery& question) {
  return plan_of(database, find_study(database, question.study()), question, "--select");
}

void check_output(const char* flag, const std::string& text) {
  if (has_aggregate(sql_tokens(text))) {
    throw InputError(not_allowed(flag, text, "it has one value for all points, not one for each"));
  }
  const DatabaseHandle database = open_database(":memory:", SQLITE_OPEN_READWRITE);
  create_tables(database.get());
  restrict_to_reading(database.get());
  protocol::StudyQuery question;
  question.add_select(fmt::format("({})", text));  // `*` and several columns are invalid here
  plan_of(database.get(), {}, question, flag);
}

}  // namespace oblique::server
