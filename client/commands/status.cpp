#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/io/console.h"
#include "client/io/row_output.h"
#include "client/service/connection.h"
#include "client/service/watching.h"
#include "proto/program/process.h"
#include "proto/result_message.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

using protocol::StudyStatus;

constexpr const char* kStatusExamples = R"(Examples:
  oblique status
  oblique status paper
  oblique status --server tcp://127.0.0.1:7600 --format json

Only a server reports points in progress and rates; a database file does not contain them.)";

constexpr const char* kStudiesExamples = R"(Examples:
  oblique studies
  oblique studies --db sweep.db --format csv)";

constexpr const char* kWatchExamples = R"(Examples:
  oblique watch paper
  oblique watch paper --db sweep.db
  oblique watch paper --server tcp://127.0.0.1:7600

Ctrl-C ends watching; the study continues. If the server stops answering, watch waits for it. The
exit code is 1 if a point failed or the study is not done.)";

struct StatusFlags {
  std::string study;  // empty: all
  std::string format{"table"};
  SourceFlags source;
};

/// Right-aligns these text columns: pads their headings and cells to one width.
void align_right(protocol::Table& rows, const std::vector<std::string>& columns) {
  for (std::size_t column = 0; column < rows.columns.size(); ++column) {
    std::string& heading = rows.columns[column];
    if (std::find(columns.begin(), columns.end(), heading) == columns.end()) {
      continue;
    }
    std::size_t width = heading.size();
    for (const auto& row : rows.rows) {
      width = std::max(width, std::get<std::string>(row[column]).size());
    }
    for (auto& row : rows.rows) {
      auto& text = std::get<std::string>(row[column]);
      text.insert(0, width - text.size(), ' ');
    }
    heading.insert(0, width - heading.size(), ' ');
  }
}

/// Percentage of completed points, rounded down so that an unfinished study never shows 100 %.
int percent_done(const StudyStatus& study) {
  const auto done = static_cast<double>(protocol::completed_points(study));
  return study.points() == 0 ? 100
                             : static_cast<int>(100.0 * done / static_cast<double>(study.points()));
}

/// Returns the columns that fit into 80 characters.
protocol::Table table_for_people(const std::vector<StudyStatus>& studies) {
  constexpr std::size_t kNameBytes = 18;
  const auto any = [&studies](auto&& is_so) {
    return std::any_of(studies.begin(), studies.end(), is_so);
  };
  const bool any_failed = any([](const StudyStatus& study) { return study.failed() > 0; });
  const bool any_left_out = any([](const StudyStatus& study) { return study.left_out() > 0; });
  const bool any_version =
      any([](const StudyStatus& study) { return !study.solver_version().empty(); });
  protocol::Table table{.columns = {"study", "state", "points", "done"}};
  const auto add_column = [&table](bool is_shown, const char* name) {
    if (is_shown) {
      table.columns.emplace_back(name);
    }
  };
  add_column(any_failed, "failed");
  add_column(any_left_out, "left out");
  add_column(true, "points/s");
  add_column(true, "prio");
  add_column(any_version, "solver");
  for (const auto& study : studies) {
    // The table of a single study has room for its whole name.
    auto& row = table.rows.emplace_back(protocol::Row{
        studies.size() == 1 ? study.name() : protocol::shortened(study.name(), kNameBytes),
        study.state(), format_count(study.points()), fmt::format("{} %", percent_done(study))});
    if (any_failed) {
      row.emplace_back(format_count(study.failed()));
    }
    if (any_left_out) {
      row.emplace_back(format_count(study.left_out()));
    }
    row.emplace_back(study.points_per_s() > 0 ? format_rate(study.points_per_s()) : "");
    row.emplace_back(std::int64_t{study.priority()});
    if (any_version) {
      row.emplace_back(study.solver_version());
    }
  }
  align_right(table, {"points", "done", "failed", "points/s"});
  return table;
}

/// Returns all columns, for programs.
protocol::Table full_table(const std::vector<StudyStatus>& studies, const std::string& access) {
  auto table = table_of(studies);
  table.columns.insert(table.columns.end(), {"submitted_by", "access", "solver_version"});
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    table.rows[i].insert(table.rows[i].end(),
                         {studies[i].submitted_by(), access, studies[i].solver_version()});
  }
  return table;
}

int status(const StatusFlags& flags, Console& console) {
  const auto format = format_named(flags.format);
  const auto source = open_source(console, flags.source);
  const auto studies = source->status(flags.study);
  warn_if_insecure(console, source->access(), source->place());
  if (format != Format::kTable) {
    print_out(full_table(studies, source->access()), format);
    return kDone;
  }
  print_out(table_for_people(studies), format);
  for (const auto& study : studies) {
    if (!study.waits_for().empty()) {
      console.out() << fmt::format("{} waits for {}.\n", protocol::visible(study.name()),
                                   protocol::visible(study.waits_for()));
    }
  }
  return kDone;
}

int list_studies(const StatusFlags& flags, Console& console) {
  const auto format = format_named(flags.format);
  const auto source = open_source(console, flags.source);
  protocol::Table table{.columns = {"study", "state", "points", "done", "created_at"}};
  const auto cell = [&format](std::uint64_t count) {
    return format == Format::kTable ? protocol::Value(format_count(count))
                                    : protocol::Value(static_cast<std::int64_t>(count));
  };
  for (const auto& study : source->status({})) {
    table.rows.push_back({study.name(), study.state(), cell(study.points()),
                          cell(protocol::completed_points(study)), study.created_at()});
  }
  if (format == Format::kTable) {
    align_right(table, {"points", "done"});
  }
  print_out(table, format);
  return kDone;
}

int watch(const StatusFlags& flags, Console& console) {
  protocol::StopSignals stop;
  const auto source = open_source(console, flags.source, [&stop] { return !stop.requested(); });
  FollowedStudy followed(*source, flags.study);
  bool answered = false;
  const auto ask = [&](const Tell& tell) {
    // The first request has a timeout, because the address may be wrong.
    auto status = followed.status(answered ? tell : Tell());
    if (!std::exchange(answered, true)) {
      warn_if_insecure(console, source->access(), source->place());
    }
    return status;
  };
  try {
    const auto status = watch_study(console, ask, stop);
    if (!stop.requested()) {
      return print_end(console, status, [&](const std::string& sql) { return source->query(sql); });
    }
  } catch (const Interrupted&) {
    // The message below reports that watching the study ended.
  }
  console.notes() << "Watching ended; the study continues.\n";
  return stop.exit_code();
}

}  // namespace

void add_status(CLI::App& app, Action& parsed) {
  {
    auto [command, flags] =
        new_command(app, parsed, "status", "Show the progress of a study or of all studies",
                    kStatusExamples, status);
    command.add_option("STUDY", flags.study, "name of the study; default: all")->type_name("");
    add_format_flag(command, flags.format);
    add_source_flags(command, flags.source);
  }
  {
    auto [command, flags] =
        new_command(app, parsed, "watch", "Show the progress of a study until it is done",
                    kWatchExamples, watch);
    add_study_argument(command, flags.study);
    add_source_flags(command, flags.source);
  }
  auto [command, flags] =
      new_command(app, parsed, "studies", "List the studies", kStudiesExamples, list_studies);
  add_format_flag(command, flags.format);
  add_source_flags(command, flags.source);
}

}  // namespace oblique::client
