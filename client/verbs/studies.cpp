#include <iostream>
#include <memory>
#include <string>

#include "client/output/human_units.h"
#include "client/output/printer.h"
#include "client/service/source_flags.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"
#include "proto/result_message.h"

namespace oblique::client {
namespace {

constexpr const char* kStudiesExamples = R"(Examples:
  oblique studies
  oblique studies --db sweep.db --format csv)";

struct StudiesFlags {
  std::string format{"table"};
  SourceFlags source;
};

int studies(const StudiesFlags& flags) {
  const auto format = format_named(flags.format);
  const auto source = open_source(flags.source);
  protocol::Table table{.columns = {"study", "state", "points", "done", "created_at"}};
  for (const auto& study : source->status({})) {
    auto& row = table.rows.emplace_back();
    add_value(row, study.name());
    add_value(row, study.state());
    for (const auto count : {study.points(), protocol::completed_points(study)}) {
      if (format == Format::kTable) {
        add_value(row, shown_count(count));
      } else {
        add_value(row, static_cast<std::int64_t>(count));
      }
    }
    add_value(row, study.created_at());
  }
  if (format == Format::kTable) {
    align_right(table, {"points", "done"});
  }
  print_out(table, format);
  return kDone;
}

}  // namespace

void add_studies(CLI::App& app, Command& command) {
  auto flags = std::make_shared<StudiesFlags>();
  auto* verb = app.add_subcommand("studies", "List the studies");
  verb->footer(kStudiesExamples);
  add_format_flag(*verb, flags->format);
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return studies(*flags); }; });
}

}  // namespace oblique::client
