#include "proto/program/completion/offers.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "proto/program/choices.h"

namespace oblique::protocol {
namespace {

Offers verbs(const Typed& typed) {
  Offers all;
  for (const auto* verb : typed.verb->get_subcommands([](const CLI::App*) { return true; })) {
    offer_value(all, typed, verb->get_name(), verb->get_description());
  }
  return all;
}

/// `--length12`, one of many such, is not offered before `--length` is typed.
bool comes_later(const Typed& typed, const std::string& flag) {
  const auto digits = flag.find_last_not_of("0123456789") + 1;
  const std::string name = flag.substr(0, digits);
  return digits < flag.size() && typed.word.size() < digits &&
         typed.verb->get_option_no_throw(name + "1") != nullptr &&
         typed.verb->get_option_no_throw(name + "2") != nullptr;
}

bool may_follow(const Typed& typed, CLI::Option& option) {
  const bool may_repeat = option.get_items_expected_max() > 1;
  const auto excludes = option.get_excludes();
  return (may_repeat || !typed.given.contains(&option)) &&
         std::none_of(excludes.begin(), excludes.end(),
                      [&](const CLI::Option* other) { return typed.given.contains(other); });
}

Offers flags(const Typed& typed) {
  Offers all;
  for (auto* option : typed.verb->get_options()) {
    for (const auto& name : option->get_lnames()) {
      const std::string flag = "--" + name;
      if (may_follow(typed, *option) && !comes_later(typed, flag)) {
        offer_value(all, typed, flag, option->get_description());
      }
    }
  }
  return all;
}

/// In help: the place itself, or what stands behind the flag.
bool is_called(const CLI::Option& option, const std::string& word) {
  return option.get_type_name() == word || (option.get_positional() && option.check_name(word));
}

Offers values_of(const Typed& typed) {
  Offers all;
  for (const auto& choice : choices_of(*typed.option)) {
    offer_value(all, typed, choice);
  }
  const bool is_folder = is_called(*typed.option, "DIR");
  if (all.offers.empty() && (is_folder || is_called(*typed.option, "FILE"))) {
    all.files = FileNames{.ending = {}, .are_folders = is_folder};
  }
  return all;
}

}  // namespace

void offer_value(Offers& offers, const Typed& typed, const std::string& value,
                 const std::string& meaning) {
  if (value.starts_with(typed.value)) {
    const auto before = typed.word.size() - typed.value.size();
    offers.offers.push_back({typed.word.substr(0, before) + value, value, meaning});
  }
}

Offers offers_for(const Typed& typed, const ValuesOf& values) {
  switch (typed.kind) {
    case Typed::Kind::kVerb:
      return verbs(typed);
    case Typed::Kind::kFlag:
      return flags(typed);
    case Typed::Kind::kValue: {
      auto found = values ? values(typed) : std::nullopt;
      return found ? *std::move(found) : values_of(typed);
    }
    case Typed::Kind::kNothing:
      break;
  }
  return {};
}

}  // namespace oblique::protocol
