#include <iostream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/service/source.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"

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

/// The comparisons with a mode in a condition, as "major_mode = 'SC SR'".
std::vector<std::string> comparisons_with_modes(std::string_view where) {
  const auto tokens = server::sql_tokens(where);
  std::vector<std::string> found;
  for (std::size_t i = 0; i + 2 < tokens.size(); ++i) {
    const std::string column = tokens[i].is_name() ? server::name_of(tokens[i]) : "";
    const bool is_equal = tokens[i + 1].is_sign("=") || tokens[i + 1].is_sign("==");
    if ((column == "mode" || column == "major_mode") && is_equal &&
        tokens[i + 2].text.starts_with('\'')) {
      found.push_back(fmt::format("{} = {}", column, tokens[i + 2].text));
    }
  }
  return found;
}

/// Says which modes of the condition no point has, for SQL takes a misspelt one as any other text.
void note_unknown_modes(Source& source, const ResultQuery& asked) {
  for (const std::string& comparison : comparisons_with_modes(asked.where)) {
    ResultQuery query;
    query.study = asked.study;
    query.where = comparison;
    query.select = "point";
    query.limit = 1;
    if (source.rows(request_for(query))->next().chunk_rows() == 0) {
      std::cerr << fmt::format(
          "Note: no point of {0} has {1}. A mode names the states in their order, as in "
          "'SC SR sR sC sR'; `oblique query {0} --group major_mode` lists those of the study.\n",
          protocol::visible(asked.study), protocol::visible(comparison));
    }
  }
}

int query(const QueryFlags& flags) {
  (void)format_of(flags.output);
  check(flags.query);
  const auto source = open_source(flags.source);
  try {
    const auto answer = source->rows(request_for(flags.query));
    print_stream(*answer, flags.output, true, "--select names columns, csv and json have all");
    note_unknown_modes(*source, flags.query);
    return kDone;
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
  verb->add_option("--select", flags->query.select,
                   "columns to show; default: the axes that vary in the study and the main "
                   "outputs; `*` is all")
      ->type_name("COLUMNS");
  verb->add_option("--group", flags->query.group,
                   "columns to gather rows by; others need a function, as avg(fn_peak_N)")
      ->type_name("COLUMNS");
  verb->add_option("--order", flags->query.order,
                   "columns to sort by, largest first with DESC; default: point")
      ->type_name("COLUMNS");
  verb->add_option("--limit", flags->query.limit, "most rows shown; all when left out")
      ->check(protocol::whole_number_from(0))
      ->type_name("N");
  add_output_flags(*verb, flags->output);
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return query(*flags); }; });
}

}  // namespace oblique::client
