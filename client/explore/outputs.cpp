#include "client/explore/outputs.h"

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "client/explore/estimate.h"
#include "proto/text.h"
#include "server/query/columns.h"
#include "server/query/plan.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

void check_column(std::string_view flag, std::string_view name, bool allows_texts) {
  if (server::find_column(name) == nullptr) {
    std::vector<std::string_view> names;
    for (const auto& column : server::all_columns()) {
      names.push_back(column.name);
    }
    throw solver::InputError(fmt::format("{}: unknown output `{}`{}; `oblique columns` lists them",
                                         flag, protocol::excerpt(name),
                                         protocol::did_you_mean(name, names)));
  }
  if (server::is_list_column(name)) {
    throw solver::InputError(fmt::format(
        "{}: the values of {} are lists; name a number, such as major_peak_1_N", flag, name));
  }
  if (!allows_texts && server::kind_of_values(name) == protocol::CellKind::kText) {
    throw solver::InputError(fmt::format(
        "{0}: the values of {1} are texts; write a condition, such as {1} = 'sC sR'", flag, name));
  }
}

}  // namespace

std::vector<std::string> outputs_of_flag(std::string_view text, bool allows_texts,
                                         const char* flag) {
  std::vector<std::string> outputs;
  server::check_sql_part(flag, text);
  const auto tokens = server::sql_tokens(text);
  for (const auto part : server::sql_items(tokens)) {
    outputs.emplace_back(server::text_over(part));
    part.size() < 2 ? check_column(flag, outputs.back(), allows_texts)
                    : server::check_output(flag, outputs.back());
  }
  return outputs;
}

double number_in(const protocol::Value& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    return static_cast<double>(*whole);
  }
  const auto* real = std::get_if<double>(&value);
  return real == nullptr || std::isinf(*real) ? kNaN : *real;
}

std::string first_failure(Source& source, const std::string& study) {
  const auto found = source.query(fmt::format(
      "SELECT point, error FROM runs WHERE study = {} AND status = 'failed' ORDER BY point LIMIT 1",
      server::sql_text(study)));
  return found.rows.empty()
             ? ""
             : fmt::format(" Point {} failed: {}.", std::get<std::int64_t>(found.rows[0][0]),
                           protocol::visible(std::get<std::string>(found.rows[0][1])));
}

void ValueNotes::add(const std::string& output, std::uint64_t used, std::uint64_t all,
                     bool varies) {
  has_values = has_values || used > 0;
  if (used == 0) {
    notes.push_back(fmt::format("None of the {} rows has a number of {}.", all, output));
  } else if (used == 1 || 2 * used < all) {
    notes.push_back(fmt::format("{} has a value in only {} of the {} rows.", output, used, all));
  }
  if (used > 1 && !varies) {
    notes.push_back(fmt::format("{} is the same in all {} rows.", output, used));
  }
}

void ValueNotes::end(const std::string& first_failure) {
  if (!notes.empty()) {
    notes.back() += first_failure;
  }
  if (!has_values) {
    constexpr const char* kTexts = " A text needs a condition, such as mode = 'sC sR'.";
    throw std::runtime_error(notes.back() + (first_failure.empty() ? kTexts : ""));
  }
}

}  // namespace oblique::client
