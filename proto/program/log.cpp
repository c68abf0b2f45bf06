#include "proto/program/log.h"

#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <memory>
#include <string_view>
#include <utility>

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include "proto/program/usage.h"
#include "proto/text.h"

namespace oblique::protocol {
namespace {

enum class Form { kText, kJournal, kJson };

/// Lines of the log in one of the forms of `set_up_log`.
class LineFormatter : public spdlog::formatter {
 public:
  explicit LineFormatter(Form form) : form_(form) {}

  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) override {
    using std::chrono::milliseconds;
    const auto since_1970 =
        std::chrono::duration_cast<milliseconds>(message.time.time_since_epoch()).count();
    const auto seconds = fmt::gmtime(static_cast<std::time_t>(since_1970 / 1000));
    const std::string time = fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", seconds, since_1970 % 1000);
    const std::string level = text_of(spdlog::level::to_string_view(message.level));
    const std::string program = text_of(message.logger_name);
    const std::string text = text_of(message.payload);
    const auto add = [&line](std::string_view part) { line.append(part.begin(), part.end()); };
    if (form_ == Form::kJson) {
      const nlohmann::ordered_json object{
          {"time", time}, {"level", level}, {"program", program}, {"message", text}};
      // Bytes that are no UTF-8 become U+FFFD; all beyond ASCII is escaped, so that a line is one
      // line for every reader.
      add(object.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace));
    } else if (form_ == Form::kJournal) {
      add(fmt::format("<{}>{}", syslog_level(message.level), visible(text)));
    } else {
      add(fmt::format("{} {} {}: {}", time, program, level, visible(text)));
    }
    add("\n");
  }
  std::unique_ptr<formatter> clone() const override {
    return std::make_unique<LineFormatter>(form_);
  }

 private:
  static std::string text_of(const spdlog::string_view_t& view) {
    return {view.data(), view.size()};
  }
  static int syslog_level(spdlog::level::level_enum level) {
    return level >= spdlog::level::err    ? 3
           : level == spdlog::level::warn ? 4
           : level == spdlog::level::info ? 6
                                          : 7;
  }

  Form form_;
};

/// The variable JOURNAL_STREAM names the file that systemd made standard error; it is inherited
/// also by those whose standard error was turned elsewhere since.
bool journal_reads_standard_error() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat file {};
  return stream != nullptr && fstat(STDERR_FILENO, &file) == 0 &&
         fmt::format("{}:{}", file.st_dev, file.st_ino) == stream;
}

}  // namespace

void set_up_log(const std::string& program, const LogSettings& settings) {
  auto logger =
      std::make_shared<spdlog::logger>(program, std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_formatter(std::make_unique<LineFormatter>(settings.format == "json" ? Form::kJson
                                                        : journal_reads_standard_error()
                                                            ? Form::kJournal
                                                            : Form::kText));
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
