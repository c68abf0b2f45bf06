#include "proto/program/configuration.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include <toml++/toml.h>

#include <spdlog/fmt/fmt.h>

#include "proto/program/process.h"
#include "proto/program/usage.h"
#include "proto/small_file.h"
#include "proto/text.h"
#include "proto/toml_reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

constexpr std::array<std::string_view, 4> kLevels{"debug", "info", "warning", "error"};
constexpr std::array<std::string_view, 2> kFormats{"text", "json"};

/// Returns the key of an option: "worker_port" for "--worker-port".
std::string key_of(const CLI::Option& option) {
  std::string key = option.get_name().substr(2);
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

void set(CLI::Option& option, const std::vector<std::string>& values) {
  option.clear();
  option.add_result(values);
  option.run_callback();
}

/// Returns the kind of an option's values in TOML, by the name of its type in the help.
std::string kind_taken_by(const CLI::Option& option) {
  constexpr std::array<std::string_view, 4> kNumbers{"INT", "UINT", "FLOAT", "SECONDS"};
  const auto is_type = [&](auto type) { return option.get_type_name().starts_with(type); };
  return option.get_items_expected_max() == 0     ? "a boolean"
         : std::ranges::any_of(kNumbers, is_type) ? "a number"
                                                  : "a string";
}

/// Returns the values of a key in the form in which they would be typed on the command line.
std::vector<std::string> typed_values(const TomlReader& file, std::string_view key,
                                      const toml::node& node, const CLI::Option& option) {
  std::vector<std::string> values;
  const auto take = [&](const toml::node& item) {
    const bool is_size = item.is_number() && option.get_type_name().starts_with("SIZE");
    values.push_back(item.is_string() ? *item.value<std::string>() : shown(item));
    if (values.back().empty() || (kind_of(item) != kind_taken_by(option) && !is_size)) {
      file.fail(item, fmt::format("{} = {} is not allowed: it must be {}{}", excerpt(key),
                                  shown(item), kind_taken_by(option),
                                  values.back().empty() ? " that is not empty" : ""));
    }
  };
  if (const auto* list = node.as_array(); list != nullptr && !list->empty()) {
    for (const toml::node& item : *list) {
      take(item);
    }
  } else {
    take(node);
  }
  return values;
}

/// Returns the configuration folder of this installation: /etc/oblique for programs in /usr/bin,
/// PREFIX/etc/oblique for programs in PREFIX/bin.
std::filesystem::path configuration_folder() {
  std::error_code unknown;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  const auto prefix = program.parent_path().parent_path();
  return (unknown || prefix == "/usr" ? "/etc" : prefix / "etc") / "oblique";
}

}  // namespace

Configuration::Configuration(CLI::App& app, std::string prefix, const std::string& name)
    : app_(app), prefix_(std::move(prefix)), default_file_(configuration_folder() / name) {
  auto* file = app.add_option("--config", file_,
                              fmt::format("TOML file with settings; without this, the environment "
                                          "variable {}CONFIG, or else {} if it exists",
                                          prefix_, default_file_));
  file->type_name("FILE")->default_str("")->configurable(false);
  app.add_flag("--no-config", without_places_, "Use neither a file nor environment variables")
      ->configurable(false)
      ->excludes(file);
  app.add_flag("--print-config", print_,
               "Print the effective settings as a configuration file, and exit")
      ->configurable(false);
}

void Configuration::add_log_options(LogSettings& settings) {
  const auto add = [this](const std::string& flag, std::string& value,
                          std::span<const std::string_view> choices, const std::string& meaning) {
    const std::vector<std::string> names(choices.begin(), choices.end());
    auto* option = app_.add_option(flag, value, meaning)->capture_default_str();
    return note_choices(option->check(CLI::IsMember(names).description("")), choices);
  };
  auto* level = add("--log-level", settings.level, kLevels,
                    "Lowest level that is logged: debug, info, warning or error");
  level->type_name("LEVEL");
  add("--log-format", settings.format, kFormats,
      "text, or json: one object a line with time, level, program and message")
      ->type_name("FORMAT");
  const std::string meaning = "Log warnings and errors only: --log-level warning";
  quiet_ = app_.add_flag("--quiet", meaning);
  quiet_->configurable(false)->excludes(level);
}

std::optional<int> Configuration::parse(int argc, const char* const* argv) {
  for (CLI::Option* option : app_.get_options()) {
    if (option->get_configurable()) {
      settings_.push_back({option, key_of(*option), option->get_envname()});
      option->envname("");  // else CLI11 would prefer the shared variable to the program's own
    }
  }
  app_.footer(fmt::format(
      "Every option may also be an environment variable (--log-level: {}LOG_LEVEL) or a key of\n"
      "the file (log_level); --print-config shows the effective settings.",
      prefix_));
  if (const auto exit_code = parse_command_line(app_, argc, argv)) {
    return exit_code;
  }
  std::string place;
  try {
    if (!without_places_) {
      set_from_environment(place);
      set_from_file(place);
    }
    if (quiet_ != nullptr && quiet_->count() > 0) {
      set(*app_.get_option("--log-level"), {"warning"});
    }
    return std::nullopt;
  } catch (const solver::InputError& error) {
    return report_wrong_usage(app_.get_name(), error.what());
  } catch (const CLI::ParseError& error) {
    return report_wrong_usage(app_.get_name(), place + parse_error_message(app_, app_, error));
  }
}

std::string Configuration::file_to_read() const {
  const std::string path = file_.empty() ? environment_value(prefix_ + "CONFIG") : file_;
  std::error_code unknown;
  const bool takes_default =
      path.empty() && (std::filesystem::exists(default_file_, unknown) || unknown);
  return without_places_ ? "" : takes_default ? default_file_ : path;
}

void Configuration::set_from_environment(std::string& place) const {
  for (const Setting& setting : settings_) {
    std::string own = prefix_ + setting.key;
    std::transform(own.begin(), own.end(), own.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    for (const std::string& name : {own, setting.shared_variable}) {
      const std::string value = environment_value(name);
      if (!value.empty() && setting.option->count() == 0) {
        place = fmt::format("environment variable {}: ", name);
        set(*setting.option, {value});
      }
    }
  }
}

void Configuration::set_from_file(std::string& place) const {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 20U;
  const std::string path = file_to_read();
  if (path.empty()) {
    return;
  }
  const TomlReader file(path);
  const toml::table top = file.parse(read_small_file(path, "the configuration file", kMaxBytes));
  std::vector<std::string_view> known;
  for (const Setting& setting : settings_) {
    known.emplace_back(setting.key);
  }
  const auto take = [&](const std::string& name, const toml::key& key, const toml::node& node) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end()) {
      file.fail(key,
                fmt::format("there is no setting {}{}", excerpt(name), did_you_mean(name, known)));
    }
    CLI::Option& option = *settings_[static_cast<std::size_t>(found - known.begin())].option;
    const auto values = typed_values(file, name, node, option);
    place = file.place(key.source()) + ": ";
    if (option.count() == 0) {
      set(option, values);
    }
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
  const std::string path = file_to_read();
  std::string text = fmt::format("# {}: the effective settings; {}\n", app_.get_name(),
                                 path.empty() ? "no file was read" : "read from " + visible(path));
  for (const Setting& setting : settings_) {
    const CLI::Option& option = *setting.option;
    const bool is_list = option.get_items_expected_max() > 1;
    std::vector<std::string> values = option.results();
    if (values.empty() && !is_list) {
      const bool is_switch = option.get_items_expected_max() == 0;
      values.push_back(is_switch ? "false" : option.get_default_str());
    }
    if (values.empty() || values.back().empty() || values.back() == "\"\"") {
      text += fmt::format("# {} is not set\n", setting.key);
      continue;
    }
    if (kind_taken_by(option) == "a string") {
      std::transform(values.begin(), values.end(), values.begin(), toml_string);
    }
    text += is_list ? fmt::format("{} = [{}]\n", setting.key, fmt::join(values, ", "))
                    : fmt::format("{} = {}\n", setting.key, values.back());
  }
  return text;
}

}  // namespace oblique::protocol
