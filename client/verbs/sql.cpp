#include <memory>
#include <string>
#include <utility>

#include "client/output/printer.h"
#include "client/service/source_flags.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"

namespace oblique::client {
namespace {

constexpr const char* kSqlExamples = R"(Examples:
  oblique sql "SELECT study, count(*), max(fn_peak_N) FROM runs GROUP BY study"
  oblique sql "SELECT * FROM peaks WHERE study_id = 1 AND major" --format csv
  oblique sql "SELECT name, sql FROM sqlite_schema"     tables and views

One statement that only reads, in SQLite's SQL with median(x), stddev(x) and corr(x, y)
beside its functions. What `oblique query` alone knows is written otherwise here:
  peaks[0].fn_N           peaks ->> '$[0][1]', or the views peaks, phases, stick_intervals and
                          reaction_peaks
  count_mode('SC SR')     count(*) FILTER (WHERE major_mode = 'SC SR'))";

struct SqlFlags {
  std::string statement;
  OutputFlags output;
  SourceFlags source;
};

int sql(const SqlFlags& flags) {
  (void)format_of(flags.output);
  const auto source = open_source(flags.source);
  protocol::QueryRequest request;
  request.set_sql(flags.statement);
  return print_stream(*source->rows(std::move(request)), flags.output, false);
}

}  // namespace

void add_sql(CLI::App& app, Command& command) {
  auto flags = std::make_shared<SqlFlags>();
  auto* verb = app.add_subcommand("sql", "Ask the database in SQL, reading only");
  verb->footer(kSqlExamples);
  verb->add_option("STATEMENT", flags->statement, "the statement, in quotes")
      ->required()
      ->type_name("");
  add_output_flags(*verb, flags->output);
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return sql(*flags); }; });
}

}  // namespace oblique::client
