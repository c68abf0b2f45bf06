#include "proto/program/configuration.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <span>
#include <sstream>
#include <string_view>

#include <toml++/toml.h>

#include <spdlog/fmt/fmt.h>

#include "proto/program/usage.h"
#include "proto/small_file.h"
#include "proto/suggestion.h"
#include "proto/text.h"
#include "proto/toml_reader.h"
#include "worker/solver/model/errors.h"

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
std::string key_form(std::string flag) {
  flag.erase(0, 2);
  std::replace(flag.begin(), flag.end(), '-', '_');
  return flag;
}

/// The same as a variable: "WORKER_PORT".
std::string variable_form(const std::string& flag) {
  std::string name = key_form(flag);
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return name;
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

/// The value of a key as it would be typed.
std::string typed_value(const TomlReader& file, std::string_view key, const toml::node& node) {
  const std::string value = node.is_string()                        ? *node.value<std::string>()
                            : node.is_number() || node.is_boolean() ? shown(node)
                                                                    : "";
  if (value.empty()) {
    file.fail(node, fmt::format("{} = {} is not allowed: it must be a number, true, false, a text "
                                "that is not empty, or a list of these",
                                excerpt(key), shown(node)));
  }
  return value;
}

std::vector<std::string> typed_values(const TomlReader& file, std::string_view key,
                                      const toml::node& node) {
  std::vector<std::string> values;
  if (const auto* list = node.as_array(); list != nullptr && !list->empty()) {
    for (const toml::node& item : *list) {
      values.push_back(typed_value(file, key, item));
    }
  } else {
    values.push_back(typed_value(file, key, node));
  }
  return values;
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

/// An option is a number in the file when the name of its type says so.
std::string toml_value(const CLI::Option& option, const std::string& value) {
  constexpr std::array<std::string_view, 6> kNumbers{"INT",   "UINT",    "FLOAT",
                                                     "BYTES", "SECONDS", "MILLISECONDS"};
  if (is_switch(option)) {
    return CLI::detail::to_flag_value(value) > 0 ? "true" : "false";
  }
  // CLI11 appends descriptions of checks behind a colon.
  const std::string type = option.get_type_name();
  if (std::find(kNumbers.begin(), kNumbers.end(), type.substr(0, type.find(':'))) !=
      kNumbers.end()) {
    return value;
  }
  std::ostringstream quoted;
  quoted << toml::toml_formatter(toml::value<std::string>(value), toml::format_flags::none);
  return quoted.str();
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
  // The flags alone, for --help, --config and their own errors.
  if (const auto exit_code = parse_command_line(app_, argc, argv)) {
    return exit_code;
  }
  try {
    std::vector<std::string> words;
    if (!without_places_) {
      read_file();
      read_environment();
    }
    for (const Setting& setting : settings_) {
      for (const std::string& value : setting.values) {
        if (!is_typed(*setting.option)) {
          words.push_back(fmt::format("{}={}", setting.option->get_name(), value));
        }
      }
    }
    for (const char* const* word = argv + 1; word < argv + argc; ++word) {
      words.push_back(quiet_ != nullptr && quiet_->check_name(*word) ? "--log-level=warning"
                                                                     : *word);
    }
    std::reverse(words.begin(), words.end());  // as CLI11 takes them
    app_.parse(words);
    return std::nullopt;
  } catch (const solver::InputError& error) {
    return tell_wrong_usage(app_.get_name(), error.what());
  } catch (const CLI::ParseError& error) {
    return tell_wrong_usage(app_.get_name(), located(objection_of(app_, app_, error)));
  }
}

/// Also gives --help its footer, with an option of several words as example.
void Configuration::find_settings() {
  for (CLI::Option* option : app_.get_options()) {
    if (option->get_configurable()) {
      settings_.push_back({option, key_of(option->get_name()), option->get_envname()});
      option->envname("");  // CLI11 would give the file precedence over it
    }
  }
  const auto example = std::find_if(settings_.begin(), settings_.end(), [](const Setting& setting) {
    return !is_switch(*setting.option) && setting.key.find('_') != std::string::npos;
  });
  if (example != settings_.end()) {
    const std::string flag = example->option->get_name();
    app_.footer(fmt::format(
        "Every option may also be an environment variable ({}: {}{}) or a key of the file ({});\n"
        "--print-config shows the effective settings.",
        flag, places_.environment_prefix, variable_form(flag), example->key));
  }
}

std::string Configuration::key_of(const std::string& flag) const {
  std::string key = key_form(flag);
  for (const std::string& table : places_.tables) {
    if (key.starts_with(table + "_")) {
      key[table.size()] = '.';
    }
  }
  return key;
}

std::string Configuration::file_to_read() const {
  if (without_places_ || !file_.empty()) {
    return file_;
  }
  if (std::string named = variable(places_.environment_prefix + "CONFIG"); !named.empty()) {
    return named;
  }
  std::error_code unknown;
  const bool exists = std::filesystem::exists(places_.default_file, unknown);
  return exists || unknown ? places_.default_file : "";
}

void Configuration::read_file() {
  const std::string path = file_to_read();
  if (path.empty()) {
    return;
  }
  constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
  const TomlReader file(path);
  const toml::table top = file.parse(read_small_file(path, "the configuration file", kMostBytes));
  const auto take = [&](const std::string& name, const toml::key& key, const toml::node& node) {
    std::vector<std::string_view> known;
    for (Setting& setting : settings_) {
      if (setting.key == name) {
        setting.values = typed_values(file, name, node);
        setting.place = file.before(key.source());
        return;
      }
      known.emplace_back(setting.key);
    }
    file.fail(key,
              fmt::format("there is no setting {}{}", excerpt(name), did_you_mean(name, known)));
  };
  for (const auto& [key, node] : top) {
    const std::string name(key.str());
    if (std::find(places_.tables.begin(), places_.tables.end(), name) == places_.tables.end()) {
      take(name, key, node);
      continue;
    }
    for (const auto& [inner, value] : file.table(name, node, "a table")) {
      take(name + "." + std::string(inner.str()), inner, value);
    }
  }
}

void Configuration::read_environment() {
  for (Setting& setting : settings_) {
    const std::string own = places_.environment_prefix + variable_form(setting.option->get_name());
    for (const std::string& name : {setting.shared_variable, own}) {
      if (const std::string value = variable(name); !value.empty()) {
        setting.values = {value};
        setting.place = fmt::format("environment variable {}: ", name);
      }
    }
  }
}

/// The error with the place of the value that it is about, unless that was typed.
std::string Configuration::located(const std::string& error) const {
  for (const Setting& setting : settings_) {
    const std::string flag = setting.option->get_name();
    const auto at = error.find(flag);
    if (at != std::string::npos && !setting.place.empty() &&
        std::string("-_abcdefghijklmnopqrstuvwxyz").find(error[at + flag.size()]) ==
            std::string::npos) {
      return setting.place + error;
    }
  }
  return error;
}

std::string Configuration::printed() const {
  const std::string path = file_to_read();
  std::string top = fmt::format("# {}: the effective settings; {}\n", app_.get_name(),
                                path.empty() ? "no file was read" : "read from " + visible(path));
  std::map<std::string, std::string> tables;
  for (const Setting& setting : settings_) {
    const CLI::Option& option = *setting.option;
    const auto dot = setting.key.find('.');
    std::string& text = dot == std::string::npos ? top : tables[setting.key.substr(0, dot)];
    const std::string name = setting.key.substr(dot + 1);  // npos is -1
    std::vector<std::string> values = effective_values(option);
    for (std::string& value : values) {
      value = toml_value(option, value);
    }
    text += values.empty()       ? fmt::format("# {} is not set\n", name)
            : takes_list(option) ? fmt::format("{} = [{}]\n", name, fmt::join(values, ", "))
                                 : fmt::format("{} = {}\n", name, values.back());
  }
  for (const auto& [table, lines] : tables) {
    top += fmt::format("\n[{}]\n{}", table, lines);
  }
  return top;
}

}  // namespace oblique::protocol
