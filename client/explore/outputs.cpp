#include "client/explore/outputs.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <limits>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/query/columns.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

/// Parts of a list; commas inside quotes and brackets separate nothing.
std::vector<std::string> parts_of(std::string_view text) {
  std::vector<std::string> parts(1);
  char quote = '\0';
  int brackets = 0;
  for (const char letter : text) {
    if (quote == '\0' && brackets == 0 && letter == ',') {
      parts.emplace_back();
      continue;
    }
    if (quote != '\0') {
      quote = letter == quote ? '\0' : quote;
    } else if (letter == '\'' || letter == '"') {
      quote = letter;
    } else {
      brackets += letter == '(' ? 1 : letter == ')' ? -1 : 0;
    }
    if (letter != ' ' || !parts.back().empty()) {
      parts.back() += letter;
    }
  }
  return parts;
}

bool is_plain_name(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char letter) {
    return std::isalnum(letter) != 0 || letter == '_';
  });
}

/// The condition of `mode:'sC sR'`; empty for other texts.
std::string mode_condition(std::string_view text) {
  for (const std::string_view column : {"mode", "major_mode"}) {
    if (text.starts_with(column) && text.substr(column.size()).starts_with(':')) {
      auto mode = text.substr(column.size() + 1);
      if (mode.size() > 1 && mode.front() == '\'' && mode.ends_with('\'')) {
        mode = mode.substr(1, mode.size() - 2);
      }
      return fmt::format("{} = {}", column, server::sql_text(mode));
    }
  }
  return {};
}

void check_name(std::string_view flag, std::string_view name) {
  const server::Column* const column = server::find_column(name);
  if (column == nullptr) {
    std::vector<std::string_view> names;
    for (const auto& each : server::all_columns()) {
      names.push_back(each.name);
    }
    throw solver::InputError(fmt::format("{}: unknown output `{}`{}; `oblique columns` lists them",
                                         flag, protocol::excerpt(name),
                                         protocol::did_you_mean(name, names)));
  }
  if (server::is_list_column(name)) {
    throw solver::InputError(fmt::format(
        "{0}: the values of {1} are lists; take a number, as major_peak_1_N", flag, name));
  }
}

}  // namespace

std::vector<Output> outputs_of_flag(std::string_view flag, std::string_view text) {
  std::vector<Output> outputs;
  for (const std::string& part : parts_of(text)) {
    if (part.empty()) {
      throw solver::InputError(
          fmt::format("{} {}: an output is missing", flag, protocol::excerpt(text)));
    }
    std::string sql = mode_condition(part);
    if (sql.empty()) {
      sql = part;
      is_plain_name(part) ? check_name(flag, part) : server::check_sql_part(flag, part);
    }
    outputs.push_back({part, std::move(sql)});
  }
  return outputs;
}

bool has_texts(const Output& output) {
  return server::kind_of_values(output.name) == protocol::CellKind::kText;
}

void refuse_texts(std::string_view flag, const Output& output) {
  if (has_texts(output)) {
    throw solver::InputError(
        fmt::format("{0}: {1} has texts as values: give one of them (for example {1}:'sC sR'), or "
                    "another output with numbers",
                    flag, output.name));
  }
}

double number_of(const protocol::Value& value, std::string_view flag, const Output& output) {
  if (const auto* real = std::get_if<double>(&value)) {
    return *real;
  }
  if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    return static_cast<double>(*whole);
  }
  if (std::holds_alternative<std::string>(value)) {
    throw solver::InputError(
        fmt::format("{}: the values of {} are texts, not numbers", flag, output.name));
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace oblique::client
