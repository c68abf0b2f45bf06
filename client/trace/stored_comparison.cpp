#include "client/trace/stored_comparison.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "server/query/sql_text.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client {
namespace {

using nlohmann::json;
using protocol::Value;

/// A database keeps 8 digits of numbers in lists.
bool is_kept_as(const json& stored, const solver::Cell& cell) {
  constexpr double kHalfOfTheLastDigit = 5.1e-8;
  if (const auto* text = std::get_if<std::string_view>(&cell)) {
    return stored == *text;
  }
  const bool* const flag = std::get_if<bool>(&cell);
  const double value = flag != nullptr ? static_cast<double>(*flag) : std::get<double>(cell);
  return stored.is_number() &&
         std::abs(stored.get<double>() - value) <= kHalfOfTheLastDigit * std::abs(value);
}

bool is_same_list(const Value& stored, const solver::ResultList& list,
                  const solver::CaseResult& result) {
  // A list without elements may be NULL.
  const auto* text = std::get_if<std::string>(&stored);
  const json elements = text != nullptr ? json::parse(*text, nullptr, false) : json::array();
  if (!elements.is_array()) {
    return false;
  }
  std::size_t elements_seen = 0;
  bool is_same = true;
  list.each(result, [&](std::span<const solver::Cell> element) {
    const json kept = elements_seen < elements.size() ? elements[elements_seen] : json();
    is_same = is_same && kept.is_array() &&
              std::equal(kept.begin(), kept.end(), element.begin(), element.end(), is_kept_as);
    ++elements_seen;
  });
  return is_same && elements_seen == elements.size();
}

template <class T>
void compare_scalars(const StoredRow& stored, const solver::CaseResult& result,
                     std::vector<std::string>& differing) {
  solver::for_each_sent<T>([&](const solver::ResultField& field, const solver::Member<T>& member) {
    const auto before = stored.values.find(std::string(field.column));
    const T* now = member.of(result);
    if (field.name != "wall_s" && before != stored.values.end() &&
        before->second != (now == nullptr ? Value() : Value(*now))) {
      differing.emplace_back(field.column);
    }
  });
}

}  // namespace

std::string StoredRow::text(const std::string& column) const {
  const auto found = values.find(column);
  const auto* text = found == values.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text == nullptr ? std::string() : *text;
}

std::optional<StoredRow> stored_row(Source& source, const std::string& study, std::uint64_t point) {
  const auto table = source.query(fmt::format("SELECT * FROM runs WHERE study = {} AND point = {}",
                                              server::sql_text(study), point));
  if (table.rows.empty()) {
    return std::nullopt;
  }
  StoredRow row;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    row.values.emplace(table.columns[i], table.rows[0].at(i));
  }
  return row;
}

std::string differences_in_words(const StoredRow& stored, const solver::CaseResult& result) {
  std::vector<std::string> columns;
  compare_scalars<double>(stored, result, columns);
  compare_scalars<std::int64_t>(stored, result, columns);
  compare_scalars<std::string>(stored, result, columns);
  for (const solver::ResultList* list : solver::result_lists()) {
    const auto before = stored.values.find(std::string(list->column));
    if (before != stored.values.end() && !is_same_list(before->second, *list, result)) {
      columns.emplace_back(list->column);
    }
  }
  if (columns.empty()) {
    return {};
  }
  const std::string before = stored.text("solver_version");
  const std::string& now = result.solver.version;
  return fmt::format("{}: {}", fmt::join(columns, ", "),
                     before == now ? fmt::format("both by solver {}", now)
                                   : fmt::format("stored by solver {}, now by {}", before, now));
}

}  // namespace oblique::client
