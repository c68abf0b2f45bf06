#include "server/web/pictures/picture_job.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/program/usage.h"
#include "proto/text.h"
#include "server/web/answers/fields.h"
#include "server/web/http/json_answer.h"
#include "server/web/pictures/picture_flags.h"

namespace oblique::server {
namespace {

constexpr unsigned kOk = 200;
constexpr unsigned kWrongField = 400;
constexpr unsigned kNotFound = 404;
constexpr unsigned kCannotBeDrawn = 422;
constexpr unsigned kNotNow = 503;

std::string program_of(const PictureSettings& settings) {
  std::error_code error;
  const auto own = std::filesystem::read_symlink("/proc/self/exe", error);
  return settings.program.empty() ? (own.parent_path() / "oblique").string() : settings.program;
}

/// What it said for people, without its own name and its advice on flags.
std::string sentence_of(const std::string& said) {
  std::string text = protocol::visible_lines(said);
  text = text.substr(0, text.find("\nTry `"));
  constexpr std::string_view kName = "oblique plot: ";
  text = text.starts_with(kName) ? text.substr(kName.size()) : text;
  while (!text.empty() && text.back() == '\n') {
    text.pop_back();
  }
  return text.empty() ? "the picture cannot be drawn" : text;
}

/// For a file to keep: of the study's name what any system takes.
std::string file_name(const std::string& study, std::optional<std::uint64_t> point,
                      const std::string& format) {
  std::string name = study.substr(0, 60);
  std::replace_if(
      name.begin(), name.end(),
      [](char letter) {
        const bool is_plain = (letter >= 'a' && letter <= 'z') ||
                              (letter >= 'A' && letter <= 'Z') ||
                              (letter >= '0' && letter <= '9') || letter == '_';
        return !is_plain;
      },
      '-');
  return fmt::format("{}{}.{}", name, point ? fmt::format("-point-{}", *point) : "", format);
}

HttpAnswer answer_of(ChildEnd end, const PictureFormat& format, const std::string& name) {
  switch (end.kind) {
    case ChildEnd::Kind::kStopped:
      return error_answer(
          kNotNow, "the picture takes too long: ask for less, or draw it with `oblique plot`");
    case ChildEnd::Kind::kTooLong:
      return error_answer(kNotNow,
                          "the picture is too large: ask for less, or draw it with `oblique plot`");
    case ChildEnd::Kind::kKilled:
      return error_answer(kNotNow,
                          "the program that draws was killed, as it is when it takes too much: ask "
                          "for less, or draw with `oblique plot`");
    case ChildEnd::Kind::kEnded:
      break;
  }
  if (end.code != protocol::kDone) {
    return error_answer(end.code == protocol::kWrongUsage ? kWrongField : kCannotBeDrawn,
                        sentence_of(end.said));
  }
  return {kOk,
          format.content_type,
          std::move(end.output),
          {{"Content-Disposition", fmt::format("attachment; filename=\"{}\"", name)}}};
}

HttpAnswer picture_answer(const JobContext& context, const PictureSettings& settings,
                          std::uint64_t id, std::optional<std::uint64_t> point,
                          const Fields& asked) {
  const ServedStudy study = context.study(id);
  const FieldReader fields(asked);
  if (point && *point >= study.table->size()) {
    throw JobError(error_answer(
        kNotFound, fmt::format("the study \"{}\" has no point {}", study.name, *point)));
  }
  const PictureFormat format = picture_format(fields);
  std::vector<std::string> arguments{"oblique", "plot", "--quiet", "--db=" + settings.database};
  for (std::string& flag :
       point ? point_picture_flags(*point, fields) : study_picture_flags(study, fields)) {
    arguments.push_back(std::move(flag));
  }
  arguments.insert(arguments.end(), {"--", study.name});
  const std::string program = program_of(settings);
  try {
    return answer_of(run_child(program, std::move(arguments), settings.limits,
                               [&context] { return context.is_over(); }),
                     format, file_name(study.name, point, format.name));
  } catch (const std::system_error& error) {
    return error_answer(
        kNotNow, fmt::format("pictures are drawn by the program `oblique`, which cannot be started "
                             "as {}: {}. The server is told where it is by --http-plot-program",
                             protocol::visible(program), error.code().message()));
  }
}

}  // namespace

AnswerPool::Job picture_job(const PictureSettings& settings, std::uint64_t study,
                            std::optional<std::uint64_t> point, const Fields& fields) {
  return [settings, study, point, fields](const JobContext& context) {
    return picture_answer(context, settings, study, point, fields);
  };
}

}  // namespace oblique::server
