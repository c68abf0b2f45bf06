#include "proto/program/usage.h"

#include <charconv>
#include <iostream>
#include <sstream>

#include "proto/text.h"

namespace oblique::protocol {
namespace {

std::string objection_to_empty(const std::string& value) {
  return value.empty() ? "the value is empty: give one, or leave the flag out" : "";
}

std::string shown(double number) {
  std::ostringstream text;
  text << number;
  return text.str();
}

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
                   : "\"" + text + "\" is not a number from " + shown(least) + " to " +
                         shown(largest);
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
    return tell_wrong_usage(app.get_name(), error.what());
  }
}

}  // namespace oblique::protocol
