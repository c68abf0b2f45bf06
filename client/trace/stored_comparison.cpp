#include "client/trace/stored_comparison.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

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
    const auto value = stored.value(std::string(field.column));
    const T* now = member.of(result);
    if (field.name != "wall_s" && value && *value != (now == nullptr ? Value() : Value(*now))) {
      differing.emplace_back(field.column);
    }
  });
}

}  // namespace

std::optional<Value> StoredRow::value(const std::string& column) const {
  const auto found = std::find(row_.columns.begin(), row_.columns.end(), column);
  return found == row_.columns.end() ? std::nullopt
                                     : std::optional(row_.rows.at(0).at(
                                           static_cast<std::size_t>(found - row_.columns.begin())));
}

std::string StoredRow::text(const std::string& column) const {
  const auto found = value(column);
  const auto* text = found ? std::get_if<std::string>(&*found) : nullptr;
  return text == nullptr ? std::string() : *text;
}

std::optional<StoredRow> stored_row(Source& source, const std::string& study, std::uint64_t point) {
  auto rows = source.query(fmt::format("SELECT * FROM runs WHERE study = {} AND point = {}",
                                       server::sql_text(study), point));
  return rows.rows.empty() ? std::nullopt : std::optional(StoredRow(std::move(rows)));
}

std::string differences_in_words(const StoredRow& stored, const solver::CaseResult& result) {
  std::vector<std::string> columns;
  compare_scalars<double>(stored, result, columns);
  compare_scalars<std::int64_t>(stored, result, columns);
  compare_scalars<std::string>(stored, result, columns);
  for (const solver::ResultList* list : solver::result_lists()) {
    const auto value = stored.value(std::string(list->column));
    if (value && !is_same_list(*value, *list, result)) {
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
