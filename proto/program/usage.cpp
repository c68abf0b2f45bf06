#include "proto/program/usage.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ctime>
#include <iostream>
#include <iterator>
#include <map>
#include <system_error>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::protocol {
namespace {

std::string objection_to_empty(const std::string& value) {
  return value.empty() ? "the value is empty" : "";
}

/// Names of the verbs of a verb or the program, and of its flags.
std::vector<std::string> known_words(const CLI::App& verb) {
  std::vector<std::string> words;
  for (const auto* each : verb.get_subcommands([](const CLI::App*) { return true; })) {
    words.push_back(each->get_name());
  }
  for (const auto* option : verb.get_options()) {
    for (const auto& name : option->get_lnames()) {
      words.push_back("--" + name);
    }
  }
  return words;
}

bool has_verbs(const CLI::App& verb) {
  return !verb.get_subcommands([](const CLI::App*) { return true; }).empty();
}

/// The name of a check that is never active and that help does not show: CLI11 keeps no other notes
/// with options.
constexpr const char* kChoices = "choices";

}  // namespace

void refuse_empty_values(CLI::App& app) {
  for (auto* option : app.get_options()) {
    // An option that may stand without a value has none then.
    if (option->get_items_expected_min() > 0) {
      option->check(objection_to_empty);
    }
  }
  for (auto* verb : app.get_subcommands({})) {
    refuse_empty_values(*verb);
  }
}

CLI::Validator number_between(double least, double largest) {
  return CLI::Validator(
      [least, largest](const std::string& text) {
        double value = 0.0;
        const bool is_number = CLI::detail::lexical_cast(text, value);
        return is_number && value >= least && value <= largest
                   ? std::string()
                   : fmt::format("\"{}\" is not a number from {:g} to {:g}", text, least, largest);
      },
      "");
}

CLI::Validator whole_number_from(std::int64_t least) {
  return CLI::Validator(
      [least](const std::string& text) {
        std::int64_t value = 0;
        const auto* const last = text.data() + text.size();
        const auto [end, error] = std::from_chars(text.data(), last, value);
        return error == std::errc() && end == last && value >= least
                   ? std::string()
                   : text +
                         " is not allowed: it must be a whole number >= " + std::to_string(least);
      },
      "");
}

std::optional<std::chrono::milliseconds> time_until(const std::string& text,
                                                    std::chrono::system_clock::time_point now) {
  using std::chrono::milliseconds;
  constexpr double kLongest_s = 1e9;
  std::tm parts{};
  const char* const end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  if (end != nullptr && *end == '\0') {
    const int day = parts.tm_mday;
    const milliseconds left = std::chrono::seconds(timegm(&parts)) -
                              std::chrono::floor<milliseconds>(now.time_since_epoch());
    // A day that the month does not have has become one of the next month.
    return parts.tm_mday == day ? std::optional(left) : std::nullopt;
  }
  static const std::map<char, double> kUnits_s{{'s', 1.0}, {'m', 60.0}, {'h', 3600.0}};
  const auto unit_s = kUnits_s.find(text.empty() ? ' ' : text.back());
  double value = 0.0;
  const bool is_duration = unit_s != kUnits_s.end() &&
                           CLI::detail::lexical_cast(text.substr(0, text.size() - 1), value) &&
                           value >= 0.0 && value * unit_s->second <= kLongest_s;
  return is_duration ? std::optional(milliseconds(std::llround(value * unit_s->second * 1000.0)))
                     : std::nullopt;
}

CLI::Option* note_choices(CLI::Option* option, std::span<const std::string_view> choices) {
  return option->check(
      CLI::Validator(fmt::format("{}", fmt::join(choices, " "))).name(kChoices).active(false));
}

std::vector<std::string> choices_of(CLI::Option& option) {
  try {
    // The description of an inactive check is empty.
    const std::string listed = option.get_validator(kChoices)->active().get_description();
    option.get_validator(kChoices)->active(false);
    return CLI::detail::split(listed, ' ');
  } catch (const CLI::OptionNotFound&) {
    return {};
  }
}

std::string objection_of(const CLI::App& app, const CLI::App& verb, const CLI::ParseError& error) {
  const auto words = known_words(verb);
  const std::vector<std::string_view> candidates(words.begin(), words.end());
  // An unexpected word is more helpful than the missing verb or flag that it may be a slip of.
  if (const auto unexpected = app.remaining(true); !unexpected.empty()) {
    const std::string& first = unexpected.front();
    const bool is_verb = has_verbs(verb) && !first.starts_with("-");
    return std::string(is_verb ? "unknown command" : "unexpected") + " `" + excerpt(first) + "`" +
           did_you_mean(first.substr(0, first.find('=')), candidates);
  }
  if (has_verbs(verb) && verb.get_subcommands().empty() && error.get_name() == "RequiredError") {
    std::vector<std::string_view> verbs;
    std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(verbs),
                 [](std::string_view word) { return !word.starts_with("-"); });
    return "a command is required; there are " + joined(verbs);
  }
  const std::string message = error.what();
  if (const auto at = message.find(": At Most 1 required"); at != std::string::npos) {
    return message.substr(0, at) + " is given more than once: give it once";
  }
  return message;
}

int tell_wrong_usage(const std::string& words, const std::string& message) {
  std::cerr << words << ": " << visible_lines(message) << "\nTry `" << words << " --help`.\n";
  return kWrongUsage;
}

std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv) {
  refuse_empty_values(app);
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(error, std::cout, std::cerr);
    }
    return tell_wrong_usage(app.get_name(), objection_of(app, app, error));
  }
}

}  // namespace oblique::protocol
