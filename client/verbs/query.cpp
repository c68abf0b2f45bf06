#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/output/columns.h"
#include "client/output/printer.h"
#include "client/service/result_query.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"
#include "proto/suggestion.h"
#include "server/asking/columns.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

constexpr const char* kQueryExamples = R"(Examples:
  oblique query paper
  oblique query paper --where "mu > 0.5 AND stick_total_s = 0" --order "fn_peak_N DESC"
  oblique query friction --select mu,fn_peak_N,mode --format csv > friction.csv
  oblique query friction --select "*" --limit 1 --format json

`oblique columns` lists the columns, in the case in which they are written: e is the restitution
coefficient, E_Pa Young's modulus. EXPR and COLUMNS are SQL expressions, without comments and
parameters, over values in SI units. Tables show some columns in other units, which stand in
brackets in the heading.)";

struct QueryFlags {
  ResultQuery query;
  std::string format{"table"};
  SourceFlags source;
};

// A wrong column's error, with the columns there are.
std::string with_columns(const std::string& message, Source& source) {
  constexpr std::string_view kNoColumn = "no such column: ";
  const auto at = message.find(kNoColumn);
  if (at == std::string::npos) {
    return message;
  }
  const auto wrong = message.substr(at + kNoColumn.size());
  const auto runs =
      source.query(fmt::format("SELECT * FROM {} LIMIT 0", server::rows_of_queries()));
  const std::vector<std::string_view> columns(runs.columns().begin(), runs.columns().end());
  return message + protocol::did_you_mean(wrong, columns) + "; the columns are " +
         protocol::joined(columns);
}

int query(const QueryFlags& flags) {
  const auto format = format_named(flags.format);
  check(flags.query);
  const auto source = open_source(flags.source);
  const auto study = study_named(*source, flags.query.study);
  check_columns(flags.query, *source);
  protocol::QueryReply rows;
  try {
    rows = all_rows(*source, flags.query, study.state() != "running");
  } catch (const solver::InputError& error) {
    throw solver::InputError(with_columns(error.what(), *source));
  }
  return print_whole(is_for_people(format) ? in_shown_units(std::move(rows)) : rows, format);
}

}  // namespace

void add_query(CLI::App& app, Command& command) {
  auto flags = std::make_shared<QueryFlags>();
  auto* verb = app.add_subcommand("query", "Show results of a study");
  verb->footer(kQueryExamples);
  verb->add_option("STUDY", flags->query.study, "name of the study")->required()->type_name("");
  verb->add_option("--where", flags->query.where, "condition that points must meet")
      ->type_name("EXPR");
  verb->add_option("--select", flags->query.select, "columns to show; `*` is all")
      ->type_name("COLUMNS")
      ->capture_default_str();
  verb->add_option("--order", flags->query.order, "columns to sort by; DESC turns one round")
      ->type_name("COLUMNS")
      ->capture_default_str();
  verb->add_option("--limit", flags->query.limit, "most rows shown; all when left out")
      ->check(protocol::whole_number_from(0))
      ->type_name("N");
  add_format_flag(*verb, flags->format);
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return query(*flags); }; });
}

}  // namespace oblique::client
