#include <algorithm>
#include <cstdint>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/output/printer.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"
#include "proto/result_message.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

constexpr const char* kStatusExamples = R"(Examples:
  oblique status
  oblique status paper
  oblique status --server tcp://127.0.0.1:7600 --format json

A database file knows nothing of leases and rates; a server does.)";

struct StatusFlags {
  std::string study;  // empty: all
  std::string format{"table"};
  SourceFlags source;
};

/// What only programs ask for: who submitted each study, and who may come to the server.
void add_details(protocol::Table& table, const std::vector<protocol::StudyStatus>& studies,
                 const std::string& access) {
  table.columns.emplace_back("submitted_by");
  table.columns.emplace_back("access");
  table.columns.emplace_back("solver_version");
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    add_value(table.rows[i], studies.at(i).submitted_by());
    add_value(table.rows[i], access);
    add_value(table.rows[i], studies.at(i).solver_version());
  }
}

int percent_done(const protocol::StudyStatus& study) {
  // Rounded down: 100 % is said of nothing unfinished.
  const auto done = static_cast<double>(protocol::completed_points(study));
  return study.points() == 0 ? 100
                             : static_cast<int>(100.0 * done / static_cast<double>(study.points()));
}

/// What people look for, in 80 columns; what a study waits for stands below, in sentences.
protocol::Table table_for_people(const std::vector<protocol::StudyStatus>& studies) {
  constexpr std::size_t kNameBytes = 18;
  const bool any_failed = std::any_of(studies.begin(), studies.end(),
                                      [](const auto& study) { return study.failed() > 0; });
  const bool any_left_out = std::any_of(studies.begin(), studies.end(),
                                        [](const auto& study) { return study.left_out() > 0; });
  // A file does not say it.
  const bool any_version = std::any_of(studies.begin(), studies.end(), [](const auto& study) {
    return !study.solver_version().empty();
  });
  protocol::Table table{.columns = {"study", "state", "points", "done"}};
  if (any_failed) {
    table.columns.emplace_back("failed");
  }
  if (any_left_out) {
    table.columns.emplace_back("left out");
  }
  for (const char* column : {"points/s", "prio"}) {
    table.columns.emplace_back(column);
  }
  if (any_version) {
    table.columns.emplace_back("solver");
  }
  for (const auto& study : studies) {
    auto& row = table.rows.emplace_back();
    // With one study there is room for its name.
    add_value(row,
              studies.size() == 1 ? study.name() : protocol::shortened(study.name(), kNameBytes));
    add_value(row, study.state());
    add_value(row, shown_count(study.points()));
    add_value(row, fmt::format("{} %", percent_done(study)));
    if (any_failed) {
      add_value(row, shown_count(study.failed()));
    }
    if (any_left_out) {
      add_value(row, shown_count(study.left_out()));
    }
    add_value(row, study.points_per_s() > 0 ? shown_rate(study.points_per_s()) : std::string());
    add_value(row, static_cast<std::int64_t>(study.priority()));
    if (any_version) {
      add_value(row, study.solver_version());
    }
  }
  align_right(table, {"points", "done", "failed", "points/s"});
  return table;
}

void print_for_people(const std::vector<protocol::StudyStatus>& studies, Format format) {
  print_out(table_for_people(studies), format);
  for (const auto& study : studies) {
    if (!study.waits_for().empty()) {
      std::cout << fmt::format("{} waits for {}.\n", protocol::visible(study.name()),
                               protocol::visible(study.waits_for()));
    }
  }
}

int status(const StatusFlags& flags) {
  const auto format = format_named(flags.format);
  const auto source = open_source(flags.source);
  const auto studies = source->status(flags.study);
  tell_if_insecure(source->access(), source->place());
  if (format == Format::kTable) {
    print_for_people(studies, format);
    return kDone;
  }
  auto table = table_of(studies);
  add_details(table, studies, source->access());
  print_out(table, format);
  return kDone;
}

}  // namespace

void add_status(CLI::App& app, Command& command) {
  auto flags = std::make_shared<StatusFlags>();
  auto* verb = app.add_subcommand("status", "Say how far a study is, or all of them");
  verb->footer(kStatusExamples);
  verb->add_option("STUDY", flags->study, "name of the study; all when left out")->type_name("");
  add_format_flag(*verb, flags->format);
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return status(*flags); }; });
}

}  // namespace oblique::client
