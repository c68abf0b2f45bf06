#include "server/asking/question.h"

#include <spdlog/fmt/fmt.h>

#include "server/asking/grouping.h"
#include "server/asking/sql/sql_expression.h"

namespace oblique::server {
namespace {

constexpr const char* kWhere = "--where";
constexpr const char* kSelect = "--select";
constexpr const char* kGroup = "--group";
constexpr const char* kOrder = "--order";

}  // namespace

std::string selected_by(const protocol::StudyQuery& question) {
  if (question.select().empty()) {
    return question.group().empty() ? kUsualColumns : fmt::format("{}, count(*)", question.group());
  }
  return fmt::format("{}", fmt::join(question.select(), ", "));
}

void check(const protocol::StudyQuery& question) {
  for (const std::string& columns : question.select()) {
    check_sql_part(kSelect, columns, SqlPart::kColumns);
  }
  if (!question.where().empty()) {
    check_sql_part(kWhere, question.where(), SqlPart::kCondition);
  }
  if (!question.group().empty()) {
    check_sql_part(kGroup, question.group(), SqlPart::kGroup);
  }
  if (!question.order().empty()) {
    check_sql_part(kOrder, question.order(), SqlPart::kOrder);
  }
}

void check_columns(const protocol::StudyQuery& question, const std::vector<std::string>& columns) {
  const std::string selected = selected_by(question);
  const auto names_given = names_given_in(selected);
  check_case_of_columns(kSelect, selected, columns, names_given);
  check_case_of_columns(kWhere, question.where(), columns, names_given);
  check_case_of_columns(kGroup, question.group(), columns, names_given);
  check_case_of_columns(kOrder, question.order(), columns, names_given);
  check_numbers(kSelect, selected, {});
  check_numbers(kOrder, question.order(), names_given);
  if (question.group().empty()) {
    check_gathered_into_one(kSelect, selected, columns);
  } else {
    check_gathered(kSelect, selected, question.group(), columns, {});
    if (!question.order().empty()) {
      check_gathered(kOrder, question.order(), question.group(), columns, names_given);
    }
  }
}

}  // namespace oblique::server
