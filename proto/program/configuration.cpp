#include "proto/program/configuration.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string_view>

#include <toml++/toml.h>

#include <spdlog/fmt/fmt.h>

#include "proto/program/usage.h"
#include "proto/small_file.h"
#include "proto/text.h"
#include "proto/toml_reader.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

constexpr std::array<std::string_view, 4> kLevels{"debug", "info", "warning", "error"};
constexpr std::array<std::string_view, 2> kFormats{"text", "json"};

/// Empty also for a variable that is set to nothing: containers and units set what they leave out.
std::string variable(const std::string& name) {
  const char* const value = name.empty() ? nullptr : std::getenv(name.c_str());
  return value == nullptr ? "" : value;
}

/// "--worker-port" as a key: "worker_port".
std::string key_of(const CLI::Option& option) {
  std::string key = option.get_name().substr(2);
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

bool is_switch(const CLI::Option& option) {
  return option.get_items_expected_max() == 0;
}
bool takes_list(const CLI::Option& option) {
  return option.get_items_expected_max() > 1;
}

/// Whether a flag gave the option a value, or another flag excludes values of weaker places.
bool is_typed(const CLI::Option& option) {
  const auto excluding = option.get_excludes();
  return option.count() > 0 || std::any_of(excluding.begin(), excluding.end(),
                                           [](const auto* other) { return other->count() > 0; });
}

/// The values of a key as they would be typed.
std::vector<std::string> typed_values(const TomlReader& file, std::string_view key,
                                      const toml::node& node) {
  if (const auto* list = node.as_array(); list != nullptr && !list->empty()) {
    std::vector<std::string> values;
    for (const toml::node& item : *list) {
      const auto value = typed_values(file, key, item);
      values.insert(values.end(), value.begin(), value.end());
    }
    return values;
  }
  const std::string value = node.is_string()                        ? *node.value<std::string>()
                            : node.is_number() || node.is_boolean() ? shown(node)
                                                                    : "";
  if (value.empty()) {
    file.fail(node, fmt::format("{} = {} is not allowed: it must be a number, true, false, a text "
                                "that is not empty, or a list of these",
                                excerpt(key), shown(node)));
  }
  return {value};
}

/// The value of an option, or its default; none when it has neither.
std::vector<std::string> effective_values(const CLI::Option& option) {
  if (option.count() > 0) {
    return option.results();
  }
  const std::string& by_default = option.get_default_str();
  if (is_switch(option)) {
    return {"false"};
  }
  if (takes_list(option) && by_default.starts_with('[')) {
    const std::string listed = by_default.substr(1, by_default.size() - 2);
    return listed.empty() ? std::vector<std::string>() : CLI::detail::split(listed, ',');
  }
  return by_default.empty() || by_default == "\"\"" ? std::vector<std::string>()
                                                    : std::vector{by_default};
}

/// A value as TOML. Numbers that would not read back as the same text are in quotes, which all
/// options take.
std::string toml_value(const CLI::Option& option, const std::string& value) {
  if (is_switch(option)) {
    return CLI::detail::to_flag_value(value) > 0 ? "true" : "false";
  }
  const auto number = solver::number_of(value);
  const bool is_whole = value.find_first_not_of("0123456789") == std::string::npos &&
                        value.size() < 19 && (value == "0" || !value.starts_with('0'));
  if (number && (is_whole || solver::exact_number(*number) == value)) {
    return value;
  }
  return toml_string(value);
}

CLI::Option* add_choice(CLI::App& app, const std::string& flag, std::string& value,
                        std::span<const std::string_view> choices, const std::string& meaning) {
  auto* option = app.add_option(flag, value, meaning)->capture_default_str();
  option->check(
      CLI::IsMember(std::vector<std::string>(choices.begin(), choices.end())).description(""));
  return note_choices(option, choices);
}

}  // namespace

std::string default_configuration_file(const std::string& name) {
  std::error_code unknown;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (unknown) {
    return {};
  }
  const auto prefix = program.parent_path().parent_path();
  return (prefix == "/usr" ? "/etc" : prefix / "etc") / "oblique" / name;
}

Configuration::Configuration(CLI::App& app, ConfigurationPlaces places)
    : app_(app), places_(std::move(places)) {
  auto* file = app.add_option("--config", file_,
                              fmt::format("TOML file with settings; without this, the environment "
                                          "variable {}CONFIG, or else {} when it exists",
                                          places_.environment_prefix, places_.default_file));
  file->type_name("FILE")->default_str("")->configurable(false);
  app.add_flag("--no-config", without_places_, "Use neither a file nor environment variables")
      ->configurable(false)
      ->excludes(file);
  app.add_flag("--print-config", print_, "Print the effective settings as such a file, and exit")
      ->configurable(false);
}

void Configuration::add_log_options(LogSettings& settings) {
  auto* level = add_choice(app_, "--log-level", settings.level, kLevels,
                           "Lines of this level and above: debug, info, warning, error");
  level->type_name("LEVEL");
  add_choice(app_, "--log-format", settings.format, kFormats,
             "text, or json: one object a line with time, level, program and message")
      ->type_name("FORMAT");
  const std::string meaning = "Log warnings and errors only: --log-level warning";
  quiet_ = app_.add_flag("--quiet", meaning);
  quiet_->configurable(false)->excludes(level);
}

std::optional<int> Configuration::parse(int argc, const char* const* argv) {
  find_settings();
  if (const auto exit_code = parse_command_line(app_, argc, argv)) {
    return exit_code;
  }
  std::string place;  // of the values that are set
  const auto set = [](CLI::Option& option, const std::vector<std::string>& values) {
    option.clear();
    for (const std::string& value : values) {
      option.add_result(value);
    }
    option.run_callback();
  };
  try {
    const Given given = without_places_ ? Given() : values_of_places();
    for (const Setting& setting : settings_) {
      const auto found = given.find(setting.key);
      if (found != given.end() && !is_typed(*setting.option)) {
        place = found->second.place;
        set(*setting.option, found->second.values);
      }
    }
    if (quiet_ != nullptr && quiet_->count() > 0) {
      set(*app_.get_option("--log-level"), {"warning"});
    }
    return std::nullopt;
  } catch (const solver::InputError& error) {
    return tell_wrong_usage(app_.get_name(), error.what());
  } catch (const CLI::ParseError& error) {
    return tell_wrong_usage(app_.get_name(), place + objection_of(app_, app_, error));
  }
}

void Configuration::find_settings() {
  for (CLI::Option* option : app_.get_options()) {
    if (option->get_configurable()) {
      settings_.push_back({option, key_of(*option), option->get_envname()});
      option->envname("");  // CLI11 would give it precedence over the program's own variable
    }
  }
  app_.footer(fmt::format(
      "Every option may also be an environment variable (--log-level: {}LOG_LEVEL) or a key of\n"
      "the file (log_level); --print-config shows the effective settings.",
      places_.environment_prefix));
}

/// The file to read; empty: none.
std::string Configuration::file_to_read() const {
  std::string path = file_.empty() ? variable(places_.environment_prefix + "CONFIG") : file_;
  std::error_code unknown;
  const bool takes_default =
      path.empty() && (std::filesystem::exists(places_.default_file, unknown) || unknown);
  return takes_default ? places_.default_file : path;
}

/// The values of the file, and those of variables, which replace them.
Configuration::Given Configuration::values_of_places() const {
  Given given;
  if (const std::string path = file_to_read(); !path.empty()) {
    read_file(path, given);
  }
  for (const Setting& setting : settings_) {
    std::string own = setting.key;
    std::transform(own.begin(), own.end(), own.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    for (const std::string& name : {setting.shared_variable, places_.environment_prefix + own}) {
      if (const std::string value = variable(name); !value.empty()) {
        given[setting.key] = {{value}, fmt::format("environment variable {}: ", name)};
      }
    }
  }
  return given;
}

void Configuration::read_file(const std::string& path, Given& given) const {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
  const TomlReader file(path);
  const toml::table top = file.parse(read_small_file(path, "the configuration file", kMostBytes));
  std::vector<std::string_view> known;
  for (const Setting& setting : settings_) {
    known.emplace_back(setting.key);
  }
  const auto take = [&](const std::string& name, const toml::key& key, const toml::node& node) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      file.fail(key,
                fmt::format("there is no setting {}{}", excerpt(name), did_you_mean(name, known)));
    }
    if (given.contains(name)) {
      file.fail(key, fmt::format("{} is given twice", name));
    }
    given[name] = {typed_values(file, name, node), file.place(key.source()) + ": "};
  };
  for (const auto& [key, node] : top) {
    const std::string name(key.str());
    if (!node.is_table()) {
      take(name, key, node);
      continue;
    }
    for (const auto& [inner, value] : *node.as_table()) {
      take(name + "_" + std::string(inner.str()), inner, value);
    }
  }
}

std::string Configuration::printed() const {
  const std::string path = without_places_ ? "" : file_to_read();
  std::string text = fmt::format("# {}: the effective settings; {}\n", app_.get_name(),
                                 path.empty() ? "no file was read" : "read from " + visible(path));
  for (const Setting& setting : settings_) {
    const CLI::Option& option = *setting.option;
    std::vector<std::string> values = effective_values(option);
    for (std::string& value : values) {
      value = toml_value(option, value);
    }
    text += values.empty()       ? fmt::format("# {} is not set\n", setting.key)
            : takes_list(option) ? fmt::format("{} = [{}]\n", setting.key, fmt::join(values, ", "))
                                 : fmt::format("{} = {}\n", setting.key, values.back());
  }
  return text;
}

}  // namespace oblique::protocol
