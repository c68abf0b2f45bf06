#include "client/verbs/completion/values.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/written/written_axis.h"
#include "server/asking/columns.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

using protocol::Offers;
using protocol::Typed;

/// What people write in a place, by the word that help has for it.
enum class Meaning {
  kColumns,
  kColumn,
  kCondition,
  kKey,
  kKeyIs,
  kDatabase,
  kStudyFile,
  kKeyFile,
  kSample
};

struct Word {
  std::string_view option;  ///< the name of a place or flag, or the type of its values
  Meaning meaning;
};
constexpr auto kWords = std::to_array<Word>({
    {"STUDY.toml", Meaning::kStudyFile},
    {"FILE.db", Meaning::kDatabase},
    {"FILES", Meaning::kDatabase},
    {"--db", Meaning::kDatabase},
    {"--keys", Meaning::kKeyFile},
    {"STATEMENT", Meaning::kColumns},
    {"EXPR", Meaning::kColumns},
    {"COLUMNS", Meaning::kColumns},
    {"X,Y", Meaning::kColumns},
    {"OUTPUT", Meaning::kColumns},
    {"COL", Meaning::kColumn},
    {"CONDITION", Meaning::kCondition},
    {"COLUMN", Meaning::kColumn},
    {"KEY=VALUE", Meaning::kKeyIs},
    {"--x", Meaning::kKey},
    {"--y", Meaning::kKey},
    {"--by", Meaning::kKey},
    {"SAMPLE", Meaning::kSample},
});

/// Of names, at the end of what is typed.
std::size_t begin_of_name(std::string_view text) {
  const auto is_of_name = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '.' || c == '[' || c == ']';
  };
  std::size_t begin = text.size();
  while (begin > 0 && is_of_name(static_cast<unsigned char>(text[begin - 1]))) {
    --begin;
  }
  return begin;
}

bool is_in_text(std::string_view expression) {
  return std::count(expression.begin(), expression.end(), '\'') % 2 == 1;
}

/// Offers `name` in the place of the one that is typed last in an expression.
void offer_name(Offers& offers, const Typed& typed, const std::string& name,
                const std::string& meaning, const std::string& end = {}) {
  const auto begin = begin_of_name(typed.value);
  if (std::string_view(name).starts_with(std::string_view(typed.value).substr(begin))) {
    offers.offers.push_back(
        {typed.word.substr(0, typed.word.size() - typed.value.size() + begin) + name + end, name,
         meaning});
  }
}

Offers columns(const Typed& typed) {
  Offers offers{.offers = {}, .goes_on = true};
  if (is_in_text(typed.value)) {
    return offers;
  }
  for (const auto& column : server::columns_and_functions()) {
    const bool is_function = column.kind == "function";
    const std::string name =
        is_function ? column.name.substr(0, column.name.find('(') + 1) : column.name;
    offer_name(
        offers, typed, name,
        column.unit.empty() ? column.meaning : fmt::format("{} [{}]", column.meaning, column.unit));
  }
  return offers;
}

/// Keys of points and models, as axes and conditions name them.
Offers keys(const Typed& typed, const std::string& end, bool goes_on) {
  Offers offers{.offers = {}, .goes_on = goes_on};
  for (const auto all : {solver::point_keys(), solver::model_keys()}) {
    for (const auto& key : all) {
      offer_name(offers, typed, std::string(key.name), std::string(key.meaning), end);
    }
  }
  return offers;
}

Offers sample_kinds(const Typed& typed) {
  Offers offers{.offers = {}, .goes_on = true};
  for (const auto kind : protocol::sample_names()) {
    offer_value(offers, typed, std::string(kind) + ':');
  }
  return offers;
}

Offers files(const char* ending) {
  return {.offers = {}, .files = protocol::FileNames{.ending = ending}};
}

std::optional<Meaning> meaning_of(const CLI::Option& option) {
  const auto has_name = [&option](const Word& word) {
    return option.check_name(std::string(word.option)) || option.get_type_name() == word.option;
  };
  const auto found = std::find_if(kWords.begin(), kWords.end(), has_name);
  return found == kWords.end() ? std::nullopt : std::optional(found->meaning);
}

}  // namespace

std::optional<Offers> values_of_verbs(const Typed& typed) {
  const auto meaning = meaning_of(*typed.option);
  if (!meaning) {
    return std::nullopt;
  }
  switch (*meaning) {
    case Meaning::kColumns:
      return columns(typed);
    case Meaning::kColumn: {
      Offers offers = columns(typed);
      offers.goes_on = false;
      return offers;
    }
    case Meaning::kCondition:
      return keys(typed, "", true);
    case Meaning::kKey:
      return keys(typed, "", false);
    case Meaning::kKeyIs:
      return keys(typed, "=", true);
    case Meaning::kDatabase:
      return files("db");
    case Meaning::kStudyFile:
      return files("toml");
    case Meaning::kKeyFile:
      return files("key");
    case Meaning::kSample:
      return sample_kinds(typed);
  }
  return std::nullopt;
}

}  // namespace oblique::client
