#include "proto/program/configuration/configuration.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/program/configuration/printed_configuration.h"
#include "proto/program/usage.h"
#include "proto/suggestion.h"
#include "proto/text.h"

namespace oblique::protocol {
namespace {

/// The value of an environment variable; empty when it is not set, which is the same here:
/// containers and units set what they do not fill.
std::string variable(const std::string& name) {
  const char* const value = name.empty() ? nullptr : std::getenv(name.c_str());
  return value == nullptr ? "" : value;
}

std::string with_replaced(std::string text, char from, char to) {
  std::replace(text.begin(), text.end(), from, to);
  return text;
}

std::string upper_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

/// What stands in one place for one option.
struct Given {
  std::vector<std::string> values;
  std::string name;    ///< of the option there
  std::string place;   ///< before an error; empty: the command line
  std::string origin;  ///< for a comment
};

/// Gives the option these values and no others.
void give(CLI::Option& option, const Given& given) {
  option.clear();
  for (const std::string& value : given.values) {
    option.add_result(value);
  }
  try {
    option.run_callback();
  } catch (const CLI::ParseError& error) {
    // People look for the name that they wrote.
    std::string sentence = error.what();
    const std::string flag = option.get_name();
    if (const auto at = sentence.find(flag); at != std::string::npos) {
      sentence.replace(at, flag.size(), given.name);
    }
    throw ConfigurationError(fmt::format("{}: {}", given.place, sentence));
  }
}

const char* allowed(ValueKind kind) {
  switch (kind) {
    case ValueKind::kText:
      return "a text in quotes";
    case ValueKind::kNumber:
      return "a number";
    case ValueKind::kTruth:
      return "true or false";
  }
  return "";
}

void check_kind(const CLI::Option& option, const WrittenValue& written) {
  const ValueKind kind = kind_of(option);
  const bool is_list_wrong = written.is_list && !takes_list(option);
  if (written.kind != kind || is_list_wrong || written.values.empty()) {
    throw ConfigurationError(fmt::format("{}: {} must be {}{}", written.place, written.key,
                                         allowed(kind),
                                         takes_list(option) ? ", or a list of such" : ""));
  }
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
                                          "variable {}CONFIG, or else {} when it is there",
                                          places_.environment_prefix, places_.default_file));
  file->type_name("FILE")->default_str("");
  auto* none = app.add_flag("--no-config", without_places_,
                            "Take neither a file nor environment variables into account");
  auto* print = app.add_flag("--print-config", print_,
                             "Print what holds, and where each value is from, as such a file");
  for (const auto* option : {file, none, print}) {
    keep_to_command_line(option);
  }
}

void Configuration::keep_to_command_line(const CLI::Option* option) {
  command_line_only_.insert(option);
}

void Configuration::add_short_form(CLI::Option* brief, CLI::Option* option,
                                   const std::string& value) {
  keep_to_command_line(brief);
  short_forms_.push_back({brief, option, value});
}

std::optional<int> Configuration::parse(int argc, const char* const* argv) {
  collect_settings();
  tell_of_places();
  if (const auto exit_code = parse_command_line(app_, argc, argv)) {
    return exit_code;
  }
  try {
    expand_short_forms();
    read_places();
    check_exclusions();
  } catch (const ConfigurationError& error) {
    return tell_wrong_usage(app_.get_name(), error.what());
  }
  return std::nullopt;
}

void Configuration::collect_settings() {
  for (CLI::Option* option : app_.get_options()) {
    const bool is_about_program = option == app_.get_help_ptr() ||
                                  option == app_.get_help_all_ptr() ||
                                  option->get_name() == "--version";
    if (is_about_program || command_line_only_.contains(option)) {
      continue;
    }
    const std::string flag = option->get_name().substr(2);
    settings_.push_back({option, key_of(flag),
                         places_.environment_prefix + upper_case(with_replaced(flag, '-', '_')),
                         option->get_envname(), option->get_name()});
    // CLI11 would take it for one of the command line.
    option->envname("");
  }
}

/// Below the options of --help, by an example.
void Configuration::tell_of_places() {
  const auto has_words = [](const Setting& setting) {
    return setting.option->get_items_expected_min() > 0 &&
           setting.key.find('_') != std::string::npos && setting.key.find('.') == std::string::npos;
  };
  const auto example = std::find_if(settings_.begin(), settings_.end(), has_words);
  if (example != settings_.end()) {
    app_.footer(
        fmt::format("Every option may also be an environment variable ({}: {}) or a key of "
                    "the file ({});\n--print-config shows what holds, and from where.",
                    example->flag, example->variable, example->key));
  }
}

void Configuration::expand_short_forms() {
  for (const ShortForm& form : short_forms_) {
    if (form.brief->count() == 0) {
      continue;
    }
    if (form.option->count() > 0) {
      throw ConfigurationError(
          fmt::format("{} excludes {}", form.brief->get_name(), form.option->get_name()));
    }
    form.option->add_result(form.value);
    form.option->run_callback();
    for (Setting& setting : settings_) {
      if (setting.option == form.option) {
        setting.flag = form.brief->get_name();
      }
    }
  }
}

std::string Configuration::key_of(const std::string& flag) const {
  const std::string key = with_replaced(flag, '-', '_');
  for (const std::string& table : places_.tables) {
    if (key.starts_with(table + "_")) {
      return table + "." + key.substr(table.size() + 1);
    }
  }
  return key;
}

std::string Configuration::file_to_read() const {
  if (!file_.empty()) {
    return file_;
  }
  if (std::string named = variable(places_.environment_prefix + "CONFIG"); !named.empty()) {
    return named;
  }
  std::error_code unknown;
  const bool is_there = std::filesystem::exists(places_.default_file, unknown);
  return is_there || unknown ? places_.default_file : "";
}

void Configuration::read_places() {
  if (without_places_ && !file_.empty()) {
    throw ConfigurationError("--no-config excludes --config");
  }
  std::map<std::string, WrittenValue> written;
  read_file_ = without_places_ ? "" : file_to_read();
  if (!read_file_.empty()) {
    const std::vector<WrittenValue> values = read_configuration_file(read_file_);
    check_keys(values);
    for (const WrittenValue& value : values) {
      written.emplace(value.key, value);
    }
  }
  for (Setting& setting : settings_) {
    apply(setting, written);
  }
}

/// Throws ConfigurationError for the first key that no setting has.
void Configuration::check_keys(const std::vector<WrittenValue>& written) const {
  std::vector<std::string_view> keys;
  for (const Setting& setting : settings_) {
    keys.push_back(setting.key);
  }
  for (const WrittenValue& value : written) {
    const auto& tables = places_.tables;
    const bool is_empty_table = value.values.empty() && !value.is_list &&
                                std::find(tables.begin(), tables.end(), value.key) != tables.end();
    if (is_empty_table || std::find(keys.begin(), keys.end(), value.key) != keys.end()) {
      continue;
    }
    const std::string flag = "--" + with_replaced(value.key, '_', '-');
    const auto* const option = app_.get_option_no_throw(flag);
    throw ConfigurationError(option != nullptr && command_line_only_.contains(option)
                                 ? fmt::format("{}: {} is given on the command line only, as {}",
                                               value.place, value.key, flag)
                                 : fmt::format("{}: there is no setting {}{}", value.place,
                                               excerpt(value.key), did_you_mean(value.key, keys)));
  }
}

/// Tries what stands in each place, from the weakest on, so that none of it is wrong unnoticed.
void Configuration::apply(Setting& setting, const std::map<std::string, WrittenValue>& written) {
  CLI::Option& option = *setting.option;
  const std::vector<std::string> flags = option.results();
  std::vector<Given> places;
  if (const auto found = written.find(setting.key); found != written.end()) {
    check_kind(option, found->second);
    places.push_back({found->second.values, setting.key, found->second.place, found->second.place});
  }
  if (!without_places_) {
    for (const std::string& name : {setting.shared_variable, setting.variable}) {
      if (const std::string value = variable(name); !value.empty()) {
        places.push_back({{value}, name, "environment", "environment variable " + name});
      }
    }
  }
  if (places.empty() && flags.empty()) {
    return;
  }
  if (!flags.empty()) {
    places.push_back({flags, setting.flag, "", "flag " + setting.flag});
  }
  for (const Given& given : places) {
    give(option, given);
  }
  setting.origin = places.back().origin;
}

/// CLI11 knows of those on the command line alone.
void Configuration::check_exclusions() const {
  for (const Setting& setting : settings_) {
    for (const CLI::Option* other : setting.option->get_excludes()) {
      const auto found = std::find_if(settings_.begin(), settings_.end(),
                                      [&](const Setting& s) { return s.option == other; });
      if (setting.option->count() > 0 && found != settings_.end() && other->count() > 0) {
        throw ConfigurationError(fmt::format("{} ({}) excludes {} ({})", setting.key,
                                             setting.origin, found->key, found->origin));
      }
    }
  }
}

std::string Configuration::origin_of(const std::string& flag) const {
  const auto found = std::find_if(settings_.begin(), settings_.end(), [&](const Setting& setting) {
    return setting.option->get_name() == flag;
  });
  return found == settings_.end() ? "" : found->origin;
}

std::string Configuration::printed() const {
  std::string top;
  std::map<std::string, std::string> tables;
  for (const Setting& setting : settings_) {
    const auto dot = setting.key.find('.');
    const bool is_top = dot == std::string::npos;
    std::string& text = is_top ? top : tables[setting.key.substr(0, dot)];
    text += printed_setting(*setting.option, is_top ? setting.key : setting.key.substr(dot + 1),
                            setting.origin);
  }
  std::string text = fmt::format(
      "# {}: what holds. {}\n{}", app_.get_name(),
      read_file_.empty() ? "No file was read." : "The file read is " + one_line(read_file_), top);
  for (const auto& [table, lines] : tables) {
    text += fmt::format("\n[{}]\n{}", table, lines);
  }
  return text;
}

}  // namespace oblique::protocol
