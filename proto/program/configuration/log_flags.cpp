#include "proto/program/configuration/log_flags.h"

#include <string>
#include <utility>
#include <vector>

namespace oblique::protocol {
namespace {

/// A check for one of `names`.
CLI::Validator one_of(std::vector<std::string> names) {
  return CLI::Validator(
      [names = std::move(names)](const std::string& text) {
        std::string allowed;
        for (const std::string& name : names) {
          if (name == text) {
            return std::string();
          }
          allowed += (allowed.empty() ? "" : ", ") + name;
        }
        return "\"" + text + "\" is none of " + allowed;
      },
      "");
}

}  // namespace

void add_log_flags(CLI::App& app, Configuration& configuration, LogSettings& settings) {
  auto* level = app.add_option("--log-level", settings.level,
                               "Lines of this level and above: debug, info, warning, error")
                    ->capture_default_str()
                    ->check(one_of({"debug", "info", "warning", "error"}));
  app.add_option("--log-format", settings.format,
                 "text, or json: one object a line with time, level, program and message")
      ->capture_default_str()
      ->check(one_of({"text", "json"}));
  const std::string meaning = "Log warnings and errors only: --log-level warning";
  configuration.add_short_form(app.add_flag("--quiet", meaning), level, "warning");
}

}  // namespace oblique::protocol
