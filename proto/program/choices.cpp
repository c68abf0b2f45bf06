#include "proto/program/choices.h"

#include "proto/text.h"

namespace oblique::protocol {
namespace {

/// A check that checks nothing and that help does not show: CLI11 keeps no other notes with
/// options.
constexpr const char* kNote = "choices";

}  // namespace

CLI::Option* note_choices(CLI::Option* option, std::span<const std::string_view> choices) {
  std::string listed;
  for (const auto choice : choices) {
    listed += (listed.empty() ? "" : "\n") + std::string(choice);
  }
  return option->check(CLI::Validator(listed).name(kNote).active(false));
}

std::vector<std::string> choices_of(CLI::Option& option) {
  try {
    const std::string listed = option.get_validator(kNote)->active().get_description();
    option.get_validator(kNote)->active(false);
    const auto parts = split(listed, '\n');
    return {parts.begin(), parts.end()};
  } catch (const CLI::OptionNotFound&) {
    return {};
  }
}

}  // namespace oblique::protocol
