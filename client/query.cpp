#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/nearest.h"
#include "client/printer.h"
#include "client/source.h"
#include "client/verbs.h"
#include "client/watching.h"
#include "worker/solver/parameters.h"

namespace oblique::client {
namespace {

constexpr const char* kExamples = R"(Examples:
  oblique query paper
  oblique query paper --where "mu > 0.5 AND stick_total_s = 0" --order "fn_peak_N DESC"
  oblique query friction --select mu,fn_peak_N,mode --format csv > friction.csv
  oblique query friction --select "*" --limit 1 --format json

Columns are those of the view `runs`; WHERE, ORDER and COLUMNS are written as in SQL.)";

struct QueryFlags {
  std::string study;
  std::string where;
  std::string select{
      "point,H,mu,e,status,fn_peak_N,ft_peak_N,duration_s,slide_m,stick_total_s,major_mode"};
  std::string order{"point"};
  std::optional<std::int64_t> limit;
  std::string format{"table"};
  SourceFlags source;
};

// The statement, from row `skipped` of what it gives.
std::string statement_of(const QueryFlags& flags, std::int64_t skipped) {
  // The study is chosen inside, where no --where can widen it.
  std::string sql = "SELECT " + flags.select +
                    " FROM (SELECT * FROM runs WHERE study = " + sql_text(flags.study) + ")";
  sql += flags.where.empty() ? "" : " WHERE " + flags.where;
  sql += flags.order.empty() ? "" : " ORDER BY " + flags.order;
  // SQL wants a limit before an offset; -1 is none.
  const std::int64_t limit = flags.limit ? *flags.limit - skipped : -1;
  sql += " LIMIT " + std::to_string(limit) + " OFFSET " + std::to_string(skipped);
  return sql;
}

// A server cuts long answers off. The rest is asked for while nothing is added to the study, for
// new rows would shift the parts against each other.
protocol::QueryReply all_rows(Source& source, const QueryFlags& flags, bool at_rest) {
  auto rows = source.query(statement_of(flags, 0));
  while (rows.truncated() && at_rest) {
    const auto more = source.query(statement_of(flags, rows.rows_size()));
    if (more.rows().empty()) {
      break;
    }
    rows.mutable_rows()->MergeFrom(more.rows());
    rows.set_truncated(more.truncated());
  }
  return rows;
}

// A wrong column's error, with the columns there are.
std::string with_columns(const std::string& message, Source& source) {
  constexpr std::string_view kNoColumn = "no such column: ";
  const auto at = message.find(kNoColumn);
  if (at == std::string::npos) {
    return message;
  }
  const auto wrong = message.substr(at + kNoColumn.size());
  const auto runs = source.query("SELECT * FROM runs LIMIT 0");
  const std::vector<std::string_view> columns(runs.columns().begin(), runs.columns().end());
  return message + did_you_mean(wrong, columns) + "; the columns are " + joined(columns);
}

int query(const QueryFlags& flags) {
  const auto format = format_named(flags.format);
  if (flags.limit && *flags.limit < 0) {
    throw solver::InputError("--limit " + std::to_string(*flags.limit) +
                             " is not allowed: it must be >= 0");
  }
  const auto source = open_source(flags.source);
  const auto study = the_study(*source, flags.study);
  protocol::QueryReply rows;
  try {
    rows = all_rows(*source, flags, study.state() != "running");
  } catch (const ConnectionError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(with_columns(error.what(), *source));
  }
  return print_whole(rows, format);
}

}  // namespace

void add_query(CLI::App& app, Command& command) {
  auto flags = std::make_shared<QueryFlags>();
  auto* verb = app.add_subcommand("query", "Show results of a study");
  verb->footer(kExamples);
  verb->add_option("STUDY", flags->study, "name of the study")->required()->type_name("");
  verb->add_option("--where", flags->where, "condition that points must meet")->type_name("EXPR");
  verb->add_option("--select", flags->select, "columns to show; `*` is all")
      ->type_name("COLUMNS")
      ->capture_default_str();
  verb->add_option("--order", flags->order, "columns to sort by; DESC turns one round")
      ->type_name("COLUMNS")
      ->capture_default_str();
  verb->add_option("--limit", flags->limit, "most rows shown; all when left out")->type_name("N");
  add_format_flag(*verb, flags->format);
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return query(*flags); }; });
}

}  // namespace oblique::client
