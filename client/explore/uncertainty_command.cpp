#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/explore/answer.h"
#include "client/explore/outputs.h"
#include "client/explore/uncertainty.h"
#include "client/plot/plot_request.h"
#include "client/service/watching.h"
#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

constexpr const char* kUncertaintyExamples = R"help(Examples:
  oblique run --H 1 --mu "normal(0.4,0.05,0,)" --e 0.7:0.9 --sample random:4000 --name spread
  oblique uncertainty spread
  oblique uncertainty spread --of fn_peak_N,stick_total_s --quantiles 0.01,0.5,0.99 --out spread.svg
  oblique uncertainty spread --of "major_mode,stick_total_s > 0" --where "e < 0.8" --format json

STUDY is one sample (`run` and `submit --sample`, or a [[block]] with `sample`). Outputs that are
texts, such as modes, give the probability of each text. Values are in SI units, intervals are 95 %.
The last columns show the convergence: the same for the first half, quarter and eighth of the
points.)help";

struct UncertaintyFlags {
  std::string study;
  std::string of{"fn_peak_N,ft_peak_N,duration_s,major_mode"};
  std::vector<double> quantiles{0.05, 0.5, 0.95};
  std::string where;
  SourceFlags source;
  AnswerFlags answer;
};

/// The results of a study.
struct SampledStudy {
  std::vector<std::string> outputs;
  std::vector<double> shares;            ///< probabilities of the quantiles; 0.5 is the median
  std::vector<std::string> inputs = {};  ///< keys
  plot::Answer columns = {};             ///< inputs, then outputs; a row for each point
};

using Statistic = std::pair<std::string, Estimate>;

/// The statistics of output number `output` over the first `points` rows: the probability of each
/// text, or the mean, deviation, quantiles and correlations of numbers.
std::vector<Statistic> statistics_of(const SampledStudy& study, std::size_t output,
                                     std::size_t points) {
  const auto& column = study.columns[study.inputs.size() + output];
  std::vector<Statistic> statistics;
  if (column.has_texts()) {
    std::vector<std::uint64_t> hits(column.words.size());
    for (std::size_t row = 0; row < points; ++row) {
      if (const auto word = column.word(row); word != plot::AnswerColumn::kNoWord) {
        ++hits[word];
      }
    }
    const auto sum = std::accumulate(hits.begin(), hits.end(), std::uint64_t{0});
    for (std::size_t word = 0; word < hits.size(); ++word) {
      statistics.emplace_back("probability " + column.words[word], probability_of(hits[word], sum));
    }
    return statistics;
  }
  const auto where_finite = [&](const std::vector<double>& numbers) {
    std::vector<double> values;
    for (std::size_t row = 0; row < points; ++row) {
      if (std::isfinite(column.numbers[row])) {
        values.push_back(numbers[row]);
      }
    }
    return values;
  };
  const auto values = where_finite(column.numbers);
  statistics = {{"mean", mean_of(values)}, {"sd", Estimate{deviation_of(values)}}};
  auto ascending = values;
  std::sort(ascending.begin(), ascending.end());
  for (const double share : study.shares) {
    statistics.emplace_back("quantile " + solver::exact_number(share),
                            quantile_of(ascending, share));
  }
  for (std::size_t i = 0; i < study.inputs.size(); ++i) {
    statistics.emplace_back("correlation " + study.inputs[i],
                            correlation_of(where_finite(study.columns[i].numbers), values));
  }
  return statistics;
}

/// Adds the statistics of an output to the table. If its values are texts, their probabilities are
/// in falling order. If they are numbers, adds a line at each quantile to the histogram.
void add_output(const SampledStudy& study, std::size_t output, protocol::Table& table,
                plot::Panel& histogram, ValueNotes& notes) {
  const std::size_t points = study.columns.front().numbers.size();
  const auto statistics = statistics_of(study, output, points);
  std::vector<protocol::Row> rows;
  for (const auto& [name, estimate] : statistics) {
    append_values(rows.emplace_back(protocol::Row{study.outputs[output], name}), estimate);
  }
  for (const std::size_t divisor : {2U, 4U, 8U}) {
    const auto of_first = statistics_of(study, output, points / divisor);
    for (std::size_t row = 0; row < rows.size(); ++row) {
      rows[row].push_back(value_of(of_first[row].second.value));
    }
  }
  const auto& column = study.columns[study.inputs.size() + output];
  std::uint64_t used = points;
  for (std::size_t row = 0; row < points; ++row) {
    used -= column.is_null(row) ? 1U : 0U;
  }
  notes.add(study.outputs[output], used, points,
            column.has_texts() || statistics[1].second.value != 0.0);
  histogram.title = study.outputs[output];
  if (column.has_texts()) {
    std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) {
      return std::get<double>(a[2]) > std::get<double>(b[2]);
    });
    histogram.y.label.clear();  // the title names the output
  } else {
    for (std::size_t i = 0; i < study.shares.size(); ++i) {
      const double value = statistics[2 + i].second.value;
      histogram.curves.push_back(
          {.name = fmt::format("{} % quantile", solver::readable_number(100.0 * study.shares[i])),
           .x = {value, value},
           .y = {0.0, histogram.y.range.to},
           .stroke = i + 1});
    }
  }
  table.rows.insert(table.rows.end(), rows.begin(), rows.end());
}

int uncertainty(const UncertaintyFlags& flags, Console& console) {
  check(flags.answer);
  SampledStudy study{.outputs = outputs_of_flag(flags.of, true), .shares = flags.quantiles};
  ResultQuery query{.study = flags.study, .where = flags.where};
  check(query);
  const auto source = open_source(console, flags.source);
  const auto status = study_named(*source, flags.study);
  const auto recipe = stored_recipe(console, flags.source, flags.study);
  if (recipe.blocks_size() != 1 || !recipe.blocks(0).has_sample()) {
    throw solver::InputError(fmt::format(
        "the points of \"{}\" are not one sample, so shares of them are no probabilities: run a "
        "study with --sample random:4000",
        flags.study));
  }
  plot::PlotRequest histogram{.study = flags.study, .histogram = "H", .where = flags.where};
  const auto shape = plot::shape_for(recipe, histogram);
  for (const auto& axis : shape.axes) {
    if (axis.varies()) {
      study.inputs.push_back(axis.key);
      query.select += axis.column + ", ";
    }
  }
  query.select += fmt::format("{}", fmt::join(study.outputs, ", "));
  study.columns = plot::read_columns(*source->rows(request_for(query)));
  if (study.columns.front().numbers.empty()) {
    throw std::runtime_error(fmt::format("no point of \"{}\" has a result{}", flags.study,
                                         flags.where.empty() ? "" : " that meets --where"));
  }
  if (const auto open = protocol::open_points(status); open + status.failed() > 0) {
    console.note(fmt::format("Note: of {} points {} failed and {} have no result yet.",
                             format_count(status.points()), format_count(status.failed()),
                             format_count(open)));
  }
  protocol::Table table{.columns = {"output", "statistic"}};
  append_columns(table, "value");
  table.columns.insert(table.columns.end(), {"half", "quarter", "eighth"});
  plot::Figure figure{.title = flags.study,
                      .columns = std::min<std::size_t>(2, study.outputs.size())};
  ValueNotes notes;
  for (std::size_t i = 0; i < study.outputs.size(); ++i) {
    auto& panel = figure.panels.emplace_back();
    if (wants_picture(flags.answer)) {
      histogram.histogram = study.outputs[i];
      panel = plot::figure_of(*source, shape, histogram, [](const std::string&) {}).panels.front();
    }
    add_output(study, i, table, panel, notes);
  }
  notes.end(first_failure(*source, flags.study));
  put_out(console, flags.answer,
          answer_of({{"study", flags.study},
                     {"sample", protocol::name_of(recipe.blocks(0).sample().kind())},
                     {"inputs", study.inputs},
                     {"points", status.points()},
                     {"failed", status.failed()}},
                    std::move(table), std::move(figure), notes.notes));
  return kDone;
}

}  // namespace

void add_uncertainty(CLI::App& app, Action& parsed) {
  auto [command, flags] = new_command(app, parsed, "uncertainty",
                                      "Show how the outputs of a sampled study are distributed",
                                      kUncertaintyExamples, uncertainty);
  add_study_argument(command, flags.study);
  command.add_option("--of", flags.of, kOutputsHelp)->type_name("OUTPUTS")->capture_default_str();
  command.add_option("--quantiles", flags.quantiles, "shares of the points below them")
      ->delimiter(',')
      ->check(CLI::Range(1e-6, 1.0 - 1e-6))
      ->type_name("P1,P2,...")
      ->capture_default_str();
  command.add_option("--where", flags.where, "condition that points must meet")->type_name("EXPR");
  add_answer_flags(command, flags.answer);
  add_source_flags(command, flags.source);
}

}  // namespace oblique::client
