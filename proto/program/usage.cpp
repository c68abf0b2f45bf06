#include "proto/program/usage.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <iostream>
#include <iterator>
#include <system_error>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::protocol {
namespace {

/// Returns the names of the flags and subcommands of `command`.
std::vector<std::string> known_words(const CLI::App& command) {
  std::vector<std::string> words;
  for (const auto* each : command.get_subcommands([](const CLI::App*) { return true; })) {
    words.push_back(each->get_name());
  }
  for (const auto* option : command.get_options()) {
    for (const auto& name : option->get_lnames()) {
      words.push_back("--" + name);
    }
  }
  return words;
}

}  // namespace

std::string empty_value_error(int argc, const char* const* argv) {
  for (int i = 1; i < argc && std::string_view(argv[i]) != "--"; ++i) {
    const std::string word = argv[i];
    const std::string name = word.substr(0, word.find('='));
    if (word.empty() || (word.starts_with("--") && word == name + '=')) {
      return fmt::format("{}: the value is empty", word.empty() ? argv[i - 1] : name);
    }
  }
  return {};
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

std::string parse_error_message(const CLI::App& app, const CLI::App& command,
                                const CLI::ParseError& error) {
  const auto words = known_words(command);
  const std::vector<std::string_view> candidates(words.begin(), words.end());
  std::vector<std::string_view> commands;
  std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(commands),
               [](std::string_view word) { return !word.starts_with("-"); });
  // Reports an unknown word before a missing command or flag, which the word may misspell.
  if (const auto unexpected = app.remaining(true); !unexpected.empty()) {
    const std::string& first = unexpected.front();
    const bool is_command = !commands.empty() && !first.starts_with("-");
    return std::string(is_command ? "unknown command" : "unexpected") + " `" + excerpt(first) +
           "`" + did_you_mean(first.substr(0, first.find('=')), candidates);
  }
  if (!commands.empty() && command.get_subcommands().empty() &&
      error.get_name() == "RequiredError") {
    return "a command is required; the commands are " + joined(commands);
  }
  if (error.get_name() == "ArgumentMismatch") {
    for (const auto* option : command.get_options()) {
      if (option->get_multi_option_policy() == CLI::MultiOptionPolicy::Throw &&
          option->get_items_expected_max() <= 1 && option->count() > 1) {
        return option->get_name() + " was given more than once: give it once";
      }
    }
  }
  return error.what();
}

int report_wrong_usage(const std::string& words, const std::string& message) {
  std::cerr << words << ": " << visible_lines(message) << "\nTry `" << words << " --help`.\n";
  return kWrongUsage;
}

int end_output(std::ostream& out, const std::string& words, int code) {
  const bool failed_before = !out;
  out.clear();
  errno = 0;  // after a failure the next write fails again and sets it
  if (out << (failed_before ? "\n" : "") << std::flush && !failed_before) {
    return code;
  }
  if (errno == EPIPE) {
    return kReaderGone;
  }
  std::cerr << words << ": standard output could not be written: " << std::strerror(errno) << '\n';
  return kFailed;
}

std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv) {
  if (const std::string error = empty_value_error(argc, argv); !error.empty()) {
    return report_wrong_usage(app.get_name(), error);
  }
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return end_output(std::cout, app.get_name(), app.exit(error, std::cout, std::cerr));
    }
    return report_wrong_usage(app.get_name(), parse_error_message(app, app, error));
  }
}

}  // namespace oblique::protocol
