#include "proto/program/configuration/log_flags.h"

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>

#include "proto/program/choices.h"
#include "proto/suggestion.h"

namespace oblique::protocol {
namespace {

/// A check for one of `names`.
CLI::Validator one_of(std::span<const std::string_view> names) {
  return CLI::Validator(
      [names](const std::string& text) {
        return std::find(names.begin(), names.end(), text) != names.end()
                   ? std::string()
                   : "\"" + text + "\" is none of " + joined(names);
      },
      "");
}

constexpr std::array<std::string_view, 4> kLevels{"debug", "info", "warning", "error"};
constexpr std::array<std::string_view, 2> kFormats{"text", "json"};

}  // namespace

void add_log_flags(CLI::App& app, Configuration& configuration, LogSettings& settings) {
  auto* level = app.add_option("--log-level", settings.level,
                               "Lines of this level and above: debug, info, warning, error")
                    ->type_name("LEVEL")
                    ->capture_default_str()
                    ->check(one_of(kLevels));
  note_choices(level, kLevels);
  auto* format =
      app.add_option("--log-format", settings.format,
                     "text, or json: one object a line with time, level, program and message")
          ->type_name("FORMAT")
          ->capture_default_str()
          ->check(one_of(kFormats));
  note_choices(format, kFormats);
  const std::string meaning = "Log warnings and errors only: --log-level warning";
  configuration.add_short_form(app.add_flag("--quiet", meaning), level, "warning");
}

}  // namespace oblique::protocol
