#include "server/asking/suggestions.h"

#include <spdlog/fmt/fmt.h>

#include "proto/suggestion.h"
#include "server/asking/elements.h"
#include "server/asking/sql/sql_functions.h"
#include "server/asking/sql/sql_tokens.h"

namespace oblique::server {
namespace {

/// What follows `sign` in `message`; empty: the sign is not in it.
std::string behind(const std::string& message, std::string_view sign) {
  const auto at = message.find(sign);
  return at == std::string::npos ? "" : message.substr(at + sign.size());
}

/// The column that SQLite did not find; empty: the message is another one.
std::string missing_column(const std::string& message) {
  const std::string wrong = behind(message, "no such column: ");
  // From 3.42 on the name may be in quotes, with a remark behind it.
  const auto remark = wrong.find("\" - should this");
  return remark == std::string::npos ? wrong : wrong.substr(1, remark - 1);
}

/// " (did you mean `x`?)" with the nearest of `names` and of the functions.
std::string did_you_mean(std::string_view wrong, std::vector<std::string_view> names) {
  for (const SqlFunction& function : sql_functions()) {
    if (same_but_case(function.name, wrong) && !function.form.empty()) {
      return fmt::format(" (did you mean `{}`?)", function.form);  // without its brackets
    }
    names.push_back(function.name);
  }
  const auto nearest = protocol::nearest(wrong, names);
  const SqlFunction* const function = find_sql_function(nearest);
  return nearest.empty()
             ? ""
             : fmt::format(" (did you mean `{}`?)", function != nullptr && !function->form.empty()
                                                        ? function->form
                                                        : nearest);
}

}  // namespace

std::string what_quotes_mean(const std::string& message, std::string_view sql) {
  const std::string wrong = missing_column(message);
  if (wrong.empty() || sql.find(fmt::format("\"{}\"", wrong)) == std::string_view::npos) {
    return {};
  }
  return "; in double quotes stands the name of a column, in single quotes a text";
}

std::string with_suggestions(const std::string& message, const std::vector<std::string>& columns) {
  constexpr std::string_view kListed = "; `oblique columns` lists all";
  if (const std::string wrong = behind(message, "no such function: "); !wrong.empty()) {
    return same_but_case(wrong, "regexp") || same_but_case(wrong, "match")
               ? message +
                     "; patterns are those of GLOB, as mode GLOB 'SC*', and of LIKE, as mode "
                     "LIKE '%sR%'"
               : fmt::format("{}{}{}", message, did_you_mean(wrong, {}), kListed);
  }
  const std::string wrong = missing_column(message);
  if (wrong.empty()) {
    return message;
  }
  const auto elements = element_forms();
  std::vector<std::string_view> names(columns.begin(), columns.end());
  for (const WrittenForm& element : elements) {
    names.push_back(element.form);
  }
  return fmt::format("{}{}{}", message, did_you_mean(wrong, std::move(names)), kListed);
}

}  // namespace oblique::server
