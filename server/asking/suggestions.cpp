#include "server/asking/suggestions.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>

#include <spdlog/fmt/fmt.h>

#include "server/asking/columns.h"
#include "server/asking/elements.h"
#include "server/asking/sql/sql_functions.h"
#include "server/asking/sql/sql_tokens.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostSuggested = 3;

/// How far `word` is from `candidate`: a letter that was left out counts 1, a wrong one or one too
/// many 2.
std::size_t distance_to(std::string_view word, std::string_view candidate) {
  constexpr std::size_t kWrong = 2;
  std::vector<std::size_t> row(candidate.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (const char letter : word) {
    std::size_t diagonal = row[0];
    row[0] += kWrong;
    for (std::size_t j = 0; j < candidate.size(); ++j) {
      const bool is_same = same_but_case({&letter, 1}, candidate.substr(j, 1));
      const std::size_t replaced = diagonal + (is_same ? 0 : kWrong);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + kWrong});
    }
  }
  return row.back();
}

/// One thing that may have been meant: what is compared, and how it is written.
struct Candidate {
  std::string name;
  std::string form;
};

std::string suggestion(std::string_view word, const std::vector<Candidate>& candidates) {
  struct Near {
    std::size_t distance;
    std::string_view form;
  };
  std::vector<Near> found;
  const std::size_t farthest = std::max<std::size_t>(2, word.size());
  for (const Candidate& candidate : candidates) {
    const std::size_t distance = distance_to(word, candidate.name);
    if (distance <= farthest) {
      found.push_back({distance, candidate.form});
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Near& a, const Near& b) { return a.distance < b.distance; });
  std::string text;
  std::size_t count = 0;
  for (const Near& near : found) {
    if (near.distance > found.front().distance + 1 || count == kMostSuggested) {
      break;
    }
    text += fmt::format("{}`{}`", count++ == 0 ? "" : ", ", near.form);
  }
  if (const auto last = text.rfind(", "); last != std::string::npos) {
    text.replace(last, 2, " or ");
  }
  return text.empty() ? text : fmt::format(" (did you mean {}?)", text);
}

/// Functions with their arguments, as median(x).
std::vector<Candidate> functions() {
  std::vector<Candidate> functions;
  for (const DescribedFunction& described : described_functions()) {
    std::string_view rest = described.form;
    while (!rest.empty()) {
      const std::string_view form = rest.substr(0, rest.find(')') + 1);
      functions.push_back({std::string(form.substr(0, form.find('('))), std::string(form)});
      rest.remove_prefix(form.size());
      rest.remove_prefix(std::min(rest.size(), rest.find_first_not_of(", ")));
    }
  }
  return functions;
}

/// What may stand where a column may: of functions those whose name was written, brackets left out.
std::vector<Candidate> in_place_of_column(std::string_view wrong,
                                          const std::vector<std::string>& columns) {
  std::vector<Candidate> candidates;
  for (Candidate& function : functions()) {
    if (same_but_case(function.name, wrong)) {
      return {std::move(function)};
    }
  }
  for (const std::string& column : columns) {
    candidates.push_back({column, column});
  }
  for (const std::string& element : all_elements()) {
    candidates.push_back({element, element});
  }
  return candidates;
}

/// What follows `sign` in `message`; empty: nothing does.
std::string behind(const std::string& message, std::string_view sign) {
  const auto at = message.find(sign);
  return at == std::string::npos ? "" : message.substr(at + sign.size());
}

/// The column that SQLite did not find; empty: it has something else against the statement.
std::string missing_column(const std::string& message) {
  const std::string wrong = behind(message, "no such column: ");
  // From 3.42 on the name may be in quotes, with a remark behind it.
  const auto remark = wrong.find("\" - should this");
  return remark == std::string::npos ? wrong : wrong.substr(1, remark - 1);
}

}  // namespace

std::string did_you_mean_some(std::string_view word, std::span<const std::string> candidates) {
  std::vector<Candidate> named;
  for (const std::string& name : candidates) {
    named.push_back({name, name});
  }
  return suggestion(word, named);
}

std::string what_quotes_mean(const std::string& message, std::string_view sql) {
  const std::string wrong = missing_column(message);
  const bool is_quoted =
      !wrong.empty() && sql.find(fmt::format("\"{}\"", wrong)) != std::string_view::npos;
  if (!is_quoted) {
    return {};
  }
  const bool is_element = wrong.find_first_of("[.") != std::string::npos;
  return fmt::format("; in double quotes stands the name of a column, in single quotes a text{}",
                     is_element ? ", and an element of a list stands in none" : "");
}

std::string with_suggestions(const std::string& message, const std::vector<std::string>& columns) {
  constexpr std::string_view kListed = "; `oblique columns` lists all";
  if (const std::string wrong = behind(message, "no such function: "); !wrong.empty()) {
    if (same_but_case(wrong, "regexp") || same_but_case(wrong, "match")) {
      return fmt::format(
          "{}; patterns are those of GLOB, as mode GLOB 'SC*', and of LIKE, as mode LIKE '%sR%'",
          message);
    }
    return fmt::format("{}{}{}", message, suggestion(wrong, functions()), kListed);
  }
  const std::string wrong = missing_column(message);
  if (wrong.empty()) {
    return message;
  }
  return fmt::format("{}{}{}", message, suggestion(wrong, in_place_of_column(wrong, columns)),
                     kListed);
}

}  // namespace oblique::server
