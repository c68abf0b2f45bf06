#include "client/explore/outputs.h"

#include <cmath>
#include <cstdint>
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

}  // namespace oblique::client
