#include "proto/program/log.h"

#include <cstdlib>
#include <ctime>
#include <memory>
#include <string_view>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

#include <spdlog/fmt/fmt.h>
#include <spdlog/logger.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include "proto/text.h"

namespace oblique::protocol {
namespace {

enum class Form { kText, kJournal, kJson };

class Message : public spdlog::custom_flag_formatter {
 public:
  explicit Message(Form form) : form_(form) {}

  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/,
              spdlog::memory_buf_t& line) override {
    const std::string text(message.payload.data(), message.payload.size());
    // In JSON, invalid bytes become U+FFFD and all characters other than ASCII are escaped.
    const std::string shown =
        form_ == Form::kJson
            ? nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace)
        : form_ == Form::kJournal
            ? fmt::format("<{}>{}", syslog_level(message.level), visible(text))
            : visible(text);
    line.append(shown.data(), shown.data() + shown.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<Message>(form_);
  }

 private:
  static int syslog_level(spdlog::level::level_enum level) {
    return level >= spdlog::level::err    ? 3
           : level == spdlog::level::warn ? 4
           : level == spdlog::level::info ? 6
                                          : 7;
  }

  Form form_;
};

/// Returns whether standard error goes to systemd's journal. JOURNAL_STREAM contains device and
/// inode of the file that systemd opened for this. A program inherits the variable even if its
/// standard error is redirected, so device and inode of standard error are compared.
bool journal_reads_standard_error() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat file {};
  return stream != nullptr && fstat(STDERR_FILENO, &file) == 0 &&
         fmt::format("{}:{}", file.st_dev, file.st_ino) == stream;
}

}  // namespace

void set_up_log(const std::string& program, const LogSettings& settings) {
  Form form = journal_reads_standard_error() ? Form::kJournal : Form::kText;
  std::string pattern = form == Form::kJournal ? "%*" : "%Y-%m-%dT%H:%M:%S.%eZ %n %l: %*";
  if (settings.format == "json") {
    form = Form::kJson;
    pattern = R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l","program":"%n","message":%*})";
  }
  auto formatter =
      std::make_unique<spdlog::pattern_formatter>(spdlog::pattern_time_type::utc, "\n");
  formatter->add_flag<Message>('*', form).set_pattern(pattern);
  auto logger =
      std::make_shared<spdlog::logger>(program, std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_formatter(std::move(formatter));
  logger->set_level(spdlog::level::from_str(settings.level));
  spdlog::set_default_logger(std::move(logger));
}

}  // namespace oblique::protocol
