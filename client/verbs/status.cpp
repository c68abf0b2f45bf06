#include <iostream>
#include <memory>
#include <string>

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

void add_column(protocol::QueryReply& table, const std::string& name, const std::string& value) {
  table.add_columns(name);
  for (auto& row : *table.mutable_rows()) {
    add_value(row, value);
  }
}

int status(const StatusFlags& flags) {
  const auto format = format_named(flags.format);
  const auto source = open_source(flags.source);
  auto table = table_of(source->status(flags.study));
  tell_if_insecure(source->access(), source->place());
  if (!is_for_people(format)) {
    add_column(table, "access", source->access());
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
