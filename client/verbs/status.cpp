#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "client/output/printer.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"

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
void add_details(protocol::QueryReply& table, const std::vector<protocol::StudyStatus>& studies,
                 const std::string& access) {
  table.add_columns("submitted_by");
  table.add_columns("access");
  for (int i = 0; i < table.rows_size(); ++i) {
    add_value(*table.mutable_rows(i), studies.at(static_cast<std::size_t>(i)).submitted_by());
    add_value(*table.mutable_rows(i), access);
  }
}

int status(const StatusFlags& flags) {
  const auto format = format_named(flags.format);
  const auto source = open_source(flags.source);
  const auto studies = source->status(flags.study);
  auto table = table_of(studies);
  tell_if_insecure(source->access(), source->place());
  if (!is_for_people(format)) {
    add_details(table, studies, source->access());
  }
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
