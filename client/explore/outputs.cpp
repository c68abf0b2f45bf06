#include "client/explore/outputs.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "client/explore/estimate.h"
#include "proto/text.h"
#include "server/query/columns.h"
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
                                         std::string_view flag) {
  std::vector<std::string> outputs;
  for (std::string_view part : protocol::split(text, ',')) {
    part.remove_prefix(std::min(part.find_first_not_of(' '), part.size()));
    const bool is_name = std::all_of(part.begin(), part.end(), [](unsigned char letter) {
      return std::isalnum(letter) != 0 || letter == '_';
    });
    is_name ? check_column(flag, part, allows_texts) : server::check_sql_part(flag, part);
    outputs.emplace_back(part);
  }
  return outputs;
}

double number_in(const protocol::Value& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    return static_cast<double>(*whole);
  }
  const auto* real = std::get_if<double>(&value);
  return real == nullptr ? kNaN : *real;
}

}  // namespace oblique::client
