#include "proto/program/log.h"

#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <iterator>
#include <memory>
#include <string_view>
#include <utility>

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include "proto/program/exit_code.h"
#include "proto/text.h"

namespace oblique::protocol {
namespace {

std::string text_of(const spdlog::string_view_t& view) {
  return {view.data(), view.size()};
}

/// The message of a log line, made visible.
class VisibleMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& line) override {
    const std::string text = visible({message.payload.data(), message.payload.size()});
    line.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<VisibleMessage>();
  }
};

/// The level as the journal has it at the start of a line: that of syslog.
class JournalLevel : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& line) override {
    const char level = message.level >= spdlog::level::err    ? '3'
                       : message.level == spdlog::level::warn ? '4'
                       : message.level == spdlog::level::info ? '6'
                                                              : '7';
    for (const char c : {'<', level, '>'}) {
      line.push_back(c);
    }
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<JournalLevel>();
  }
};

/// One JSON object a line.
class JsonLine : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) override {
    using std::chrono::duration_cast;
    using std::chrono::milliseconds;
    const auto since_1970 = duration_cast<milliseconds>(message.time.time_since_epoch()).count();
    const auto seconds = fmt::gmtime(static_cast<std::time_t>(since_1970 / 1000));
    const nlohmann::ordered_json object{
        {"time", fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", seconds, since_1970 % 1000)},
        {"level", text_of(spdlog::level::to_string_view(message.level))},
        {"program", text_of(message.logger_name)},
        {"message", text_of(message.payload)}};
    // Bytes that are no UTF-8 become U+FFFD; all beyond ASCII is escaped, so that a line is one
    // line for every reader.
    const std::string text = object.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
    line.append(text.data(), text.data() + text.size());
    line.push_back('\n');
  }
  std::unique_ptr<formatter> clone() const override { return std::make_unique<JsonLine>(); }
};

/// The variable JOURNAL_STREAM names the file that systemd made standard error; it is inherited
/// also by those whose standard error was turned elsewhere since.
bool journal_reads_standard_error() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat file {};
  return stream != nullptr && fstat(STDERR_FILENO, &file) == 0 &&
         fmt::format("{}:{}", file.st_dev, file.st_ino) == stream;
}

std::unique_ptr<spdlog::formatter> formatter_for(const LogSettings& settings) {
  if (settings.format == "json") {
    return std::make_unique<JsonLine>();
  }
  auto lines = std::make_unique<spdlog::pattern_formatter>(spdlog::pattern_time_type::utc);
  lines->add_flag<VisibleMessage>('*').add_flag<JournalLevel>('J');
  lines->set_pattern(journal_reads_standard_error() ? "%J%*"
                                                    : "%Y-%m-%dT%H:%M:%S.%eZ %n %^%l%$: %*");
  return lines;
}

}  // namespace

void set_up_log(const std::string& program, const LogSettings& settings) {
  const char* no_colour = std::getenv("NO_COLOR");
  const bool wants_none = no_colour != nullptr && *no_colour != '\0';
  auto logger = std::make_shared<spdlog::logger>(
      program, std::make_shared<spdlog::sinks::stderr_color_sink_mt>(
                   wants_none ? spdlog::color_mode::never : spdlog::color_mode::automatic));
  logger->set_formatter(formatter_for(settings));
  logger->set_level(spdlog::level::from_str(settings.level));
  spdlog::set_default_logger(std::move(logger));
}

int tell_failure(const std::string& program, const std::string& message,
                 const LogSettings& settings) {
  if (settings.format == "json" || journal_reads_standard_error()) {
    spdlog::error("{}", message);
  } else {
    std::cerr << program << ": " << visible_lines(message) << '\n';
  }
  return kFailed;
}

}  // namespace oblique::protocol
