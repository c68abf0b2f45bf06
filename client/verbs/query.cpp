#include <memory>
#include <string>

#include "client/service/result_query.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"
#include "worker/solver/model/errors.h"

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
  OutputFlags output;
  SourceFlags source;
};

int query(const QueryFlags& flags) {
  (void)format_named(flags.output.format);
  check(flags.query);
  const auto source = open_source(flags.source);
  try {
    return print_stream(*source->rows(request_for(flags.query)), flags.output, true);
  } catch (const solver::InputError&) {
    (void)study_named(*source, flags.query.study);  // which is no wrong usage when it is not there
    throw;
  }
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
  add_output_flags(*verb, flags->output);
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return query(*flags); }; });
}

}  // namespace oblique::client
