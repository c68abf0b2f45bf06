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
  oblique query friction --select mu,fn_peak_N,mode --out friction.csv
  oblique query friction --select "*" --limit 1 --format json
  oblique query friction --group major_mode --select "major_mode, count(*), median(mu) AS mid_mu"
  oblique query friction --select "mu, peaks[0].fn_N, longest_phase.duration_s" --where "e = 1"
  oblique query friction --where "H = 1 AND e = 1" --explain

`oblique columns` lists columns, elements of lists (from 0) and functions, in the case in which they
are written: e is the restitution coefficient, E_Pa Young's modulus. LIKE tells capitals apart, as
in "mode LIKE 'SC%'": S is stick and s slip. EXPR and COLUMNS are SQL expressions, without comments
and parameters, over values in SI units. Tables show some columns in other units, which stand in
brackets in the heading.)";

struct QueryFlags {
  ResultQuery query;
  OutputFlags output;
  SourceFlags source;
};

int query(const QueryFlags& flags) {
  const Format format = format_of(flags.output);
  check(flags.query);
  const auto source = open_source(flags.source);
  try {
    const auto answer = source->rows(request_for(flags.query));
    return flags.query.explain && format == Format::kTable && flags.output.file.empty()
               ? print_lines(*answer)
               : print_stream(*answer, flags.output, true,
                              "--select names columns, csv and json have all");
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
  verb->add_option("--group", flags->query.group,
                   "columns to gather rows by; others need a function, as avg(fn_peak_N)")
      ->type_name("COLUMNS");
  verb->add_option("--order", flags->query.order, "columns to sort by; DESC turns one round")
      ->type_name("COLUMNS")
      ->capture_default_str();
  verb->add_option("--limit", flags->query.limit, "most rows shown; all when left out")
      ->check(protocol::whole_number_from(0))
      ->type_name("N");
  verb->add_flag("--explain", flags->query.explain,
                 "show how the question is answered: which points, how many rows, SQLite's plan");
  add_output_flags(*verb, flags->output);
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return query(*flags); }; });
}

}  // namespace oblique::client
