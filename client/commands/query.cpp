#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/service/connection.h"
#include "client/service/source.h"
#include "proto/program/usage.h"

namespace oblique::client {
namespace {

constexpr const char* kQueryExamples = R"(Examples:
  oblique query paper
  oblique query paper --where "mu > 0.5 AND stick_total_s = 0" --order "fn_peak_N DESC"
  oblique query friction --select mu,fn_peak_N,mode --out friction.csv
  oblique query friction --select "*" --limit 1 --format json
  oblique query friction --group major_mode --select "major_mode, count(*), median(mu) AS mid_mu"
  oblique query friction --select "corr(mu, fn_peak_N) AS of_mu, corr(e, fn_peak_N) AS of_e"
  oblique query friction --select "mu, peaks[0].fn_N, phases.count" --where "e = 1"

`oblique columns` lists the columns, elements of lists (counted from 0) and functions. Names are
case-sensitive: e is the coefficient of restitution, E_Pa Young's modulus. So is LIKE, as in
"mode LIKE 'SC%'": S is stick and s slip. EXPR and COLUMNS are SQL expressions in SI units, without
comments and parameters. Numbers and functions are those of study files: 1/3 is 0.333..., log is
natural, and pow(a, b) is a power. Tables show some columns in other units, which the heading gives.)";

constexpr const char* kSqlExamples = R"(Examples:
  oblique sql "SELECT study, count(*), max(fn_peak_N) FROM runs GROUP BY study"
  oblique sql "SELECT * FROM peaks WHERE study_id = 1 AND major" --format csv
  oblique sql "SELECT name, sql FROM sqlite_schema"     tables and views

One statement in SQLite's SQL that only reads, in which 1/3 is 0 and log is decimal. median(x),
stddev(x) and corr(x, y) are added. Forms of `oblique query` that are written differently here:
  peaks[0].fn_N           peaks ->> '$[0][1]', or the views peaks, phases, stick_intervals and
                          reaction_peaks
  count_mode('SC SR')     count(*) FILTER (WHERE major_mode = 'SC SR'))";

struct QueryFlags {
  ResultQuery query;
  OutputFlags output;
  SourceFlags source;
};

struct SqlFlags {
  std::string statement;
  OutputFlags output;
  SourceFlags source;
};

int query(const QueryFlags& flags, Console& console) {
  (void)format_of(flags.output);
  check(flags.query);
  const auto source = open_source(console, flags.source);
  const auto answer = source->rows(request_for(flags.query));
  const auto rows = print_stream(console, *answer, flags.output, true,
                                 "choose columns with --select; csv and json have all");
  if (rows == 0 && flags.query.where.find("mode") != std::string::npos) {
    console.note(fmt::format(
        "Note: no point of {0} meets the condition. A mode lists the states in order, such as "
        "'SC SR sR sC sR'; `oblique query {0} --group major_mode` lists the modes of the study.",
        flags.query.study));
  }
  return kDone;
}

int sql(const SqlFlags& flags, Console& console) {
  (void)format_of(flags.output);
  const auto source = open_source(console, flags.source);
  protocol::QueryRequest request;
  request.set_sql(flags.statement);
  print_stream(console, *source->rows(std::move(request)), flags.output, false);
  return kDone;
}

void add_sql(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "sql", "Run an SQL statement that only reads", kSqlExamples, sql);
  command.add_option("STATEMENT", flags.statement, "the statement, in quotes")
      ->required()
      ->type_name("");
  add_output_flags(command, flags.output);
  add_source_flags(command, flags.source);
}

}  // namespace

void add_query(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "query", "Show results of a study", kQueryExamples, query);
  auto& asked = flags.query;
  add_study_argument(command, asked.study);
  command.add_option("--where", asked.where, "condition that points must meet")->type_name("EXPR");
  command
      .add_option("--select", asked.select,
                  "columns to show; `*`: all; default: the axes that vary and the main outputs")
      ->type_name("COLUMNS");
  command
      .add_option("--group", asked.group,
                  "columns to group by; other columns need a function, such as avg(fn_peak_N)")
      ->type_name("COLUMNS");
  command
      .add_option("--order", asked.order,
                  "columns to sort by; DESC sorts largest first; default: point")
      ->type_name("COLUMNS");
  command.add_option("--limit", asked.limit, "maximum number of rows; default: all")
      ->check(protocol::whole_number_from(0))
      ->type_name("N");
  add_output_flags(command, flags.output);
  add_source_flags(command, flags.source);
  add_sql(app, parsed);
}

}  // namespace oblique::client
