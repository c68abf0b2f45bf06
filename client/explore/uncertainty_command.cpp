#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/explore/answer.h"
#include "client/explore/outputs.h"
#include "client/explore/uncertainty.h"
#include "client/io/console.h"
#include "client/plot/figure.h"
#include "client/plot/plot_request.h"
#include "client/service/connection.h"
#include "client/service/source.h"
#include "client/service/watching.h"
#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
#include "proto/text.h"
#include "server/query/columns.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

constexpr const char* kUncertaintyExamples = R"help(Examples:
  oblique run --H 1 --mu "normal(0.4,0.05,0,)" --e 0.7:0.9 --sample random:4000 --name spread
  oblique uncertainty spread
  oblique uncertainty spread --of fn_peak_N,stick_total_s --quantiles 0.01,0.5,0.99 --out spread.svg
  oblique uncertainty spread --of "major_mode,stick_total_s > 0" --where "e < 0.8" --format json

STUDY is one sample (`run` and `submit --sample`, or a [[block]] with `sample`). Outputs that are
texts, as modes, give the probability of each. Values are in SI units, intervals are 95 %. The last
columns have the same for the first eighth, quarter and half of the points.)help";

struct UncertaintyFlags {
  std::string study;
  std::string of{"fn_peak_N,ft_peak_N,duration_s,major_mode"};
  std::string quantiles{"0.05,0.5,0.95"};
  std::string where;
  SourceFlags source;
  AnswerFlags answer;
};

/// A statistic of a growing number of the first points of a study.
struct Statistic {
  std::string name;  ///< "mean", "sd", "quantile 0.05", "pearson mu", "spearman mu" or a text
  std::vector<Estimate> of_parts = {};
};

/// The statistics of an output. For texts, the probability of each, the largest first.
struct OutputStatistics {
  std::string name;
  bool has_texts = false;
  std::vector<double> rising = {};       ///< all numbers
  std::vector<std::size_t> points = {};  ///< of each part
  std::vector<Statistic> statistics = {};
};

/// What is stored of the study.
struct SampledStudy {
  std::string name = {};
  protocol::StudyStatus status = {};
  std::string kind = {};                 ///< of the sample: "sobol"
  std::vector<std::string> inputs = {};  ///< keys
  std::vector<Output> outputs = {};
  plot::Answer inputs_and_outputs = {};  ///< columns in this order, rows by point
  std::vector<double> shares = {};       ///< of the quantiles
};

/// Rising numbers in (0, 1).
std::vector<double> shares_of_flag(const std::string& text) {
  std::vector<double> shares;
  for (const auto part : protocol::split(text, ',')) {
    const auto share = solver::number_of(part);
    if (!share || !(*share > 0.0 && *share < 1.0) || (!shares.empty() && *share <= shares.back())) {
      throw solver::InputError(fmt::format(
          "--quantiles {} is not allowed: write rising numbers between 0 and 1, as 0.05,0.5,0.95",
          protocol::excerpt(text)));
    }
    shares.push_back(*share);
  }
  return shares;
}

/// Throws solver::InputError for a study whose points are not one sample.
const protocol::Sample& sample_of(const protocol::Recipe& recipe, const std::string& study) {
  if (recipe.blocks_size() != 1 ||
      protocol::block_kind(recipe.blocks(0)) != protocol::BlockKind::kSample) {
    throw solver::InputError(fmt::format(
        "the points of \"{}\" are not one sample, so shares of them are no probabilities: run a "
        "study with --sample random:4000",
        study));
  }
  return recipe.blocks(0).sample();
}

SampledStudy read_study(Console& console, const UncertaintyFlags& flags) {
  SampledStudy study{.name = flags.study,
                     .outputs = outputs_of_flag("--of", flags.of),
                     .shares = shares_of_flag(flags.quantiles)};
  ResultQuery query{.study = flags.study, .where = flags.where};
  check(query);
  const auto source = open_source(console, flags.source);
  study.status = study_named(*source, flags.study);
  const auto recipe = stored_recipe(console, flags.source, flags.study);
  study.kind = protocol::name_of(sample_of(recipe, flags.study).kind());
  const auto shape =
      plot::shape_for(recipe, plot::PlotRequest{.study = flags.study, .histogram = "H"});
  for (const auto& axis : shape.axes) {
    if (axis.varies()) {
      study.inputs.push_back(axis.key);
      query.select += axis.column + ", ";
    }
  }
  std::vector<std::string> columns;
  for (const Output& output : study.outputs) {
    columns.push_back(output.sql);
  }
  query.select += fmt::format("{}", fmt::join(columns, ", "));
  study.inputs_and_outputs = plot::read_columns(*source->rows(request_for(query)));
  return study;
}

/// The statistics of the first `points` values.
std::vector<Statistic> statistics_of_numbers(const SampledStudy& study,
                                             const std::vector<double>& numbers,
                                             std::size_t points) {
  std::vector<double> values;
  std::vector<std::size_t> rows;  // with a value
  for (std::size_t row = 0; row < points; ++row) {
    if (std::isfinite(numbers[row])) {
      rows.push_back(row);
      values.push_back(numbers[row]);
    }
  }
  std::vector<double> rising = values;
  std::sort(rising.begin(), rising.end());
  const Moments moments = moments_of(values);
  std::vector<Statistic> statistics{{"mean", {moments.mean}}, {"sd", {{.value = moments.sd}}}};
  for (const double share : study.shares) {
    statistics.push_back({"quantile " + solver::exact_number(share), {quantile_of(rising, share)}});
  }
  for (std::size_t input = 0; input < study.inputs.size(); ++input) {
    std::vector<double> of_input;
    for (const std::size_t row : rows) {
      of_input.push_back(study.inputs_and_outputs[input].numbers[row]);
    }
    statistics.push_back({"pearson " + study.inputs[input], {pearson(of_input, values)}});
    statistics.push_back({"spearman " + study.inputs[input], {spearman(of_input, values)}});
  }
  return statistics;
}

/// The probabilities of texts among the first `points` values.
std::vector<Statistic> statistics_of_texts(const plot::AnswerColumn& column, std::size_t points) {
  std::vector<std::uint64_t> hits(column.words.size());
  std::uint64_t sum = 0;
  for (std::size_t row = 0; row < points; ++row) {
    if (const auto word = column.word(row); word != plot::AnswerColumn::kNoWord) {
      ++hits[word];
      ++sum;
    }
  }
  std::vector<Statistic> statistics;
  for (std::size_t word = 0; word < hits.size(); ++word) {
    statistics.push_back({column.words[word], {probability_of(hits[word], sum)}});
  }
  return statistics;
}

OutputStatistics statistics_of(const SampledStudy& study, std::size_t number) {
  const auto& column = study.inputs_and_outputs[study.inputs.size() + number];
  OutputStatistics output{.name = study.outputs[number].name, .has_texts = column.has_texts()};
  output.points = growing_parts(column.numbers.size());
  for (const std::size_t points : output.points) {
    const auto part = output.has_texts ? statistics_of_texts(column, points)
                                       : statistics_of_numbers(study, column.numbers, points);
    output.statistics.resize(part.size());
    for (std::size_t i = 0; i < part.size(); ++i) {
      output.statistics[i].name = part[i].name;
      output.statistics[i].of_parts.push_back(part[i].of_parts.front());
    }
  }
  if (output.has_texts) {
    std::stable_sort(output.statistics.begin(), output.statistics.end(),
                     [](const Statistic& a, const Statistic& b) {
                       return a.of_parts.back().value > b.of_parts.back().value;
                     });
    return output;
  }
  std::copy_if(column.numbers.begin(), column.numbers.end(), std::back_inserter(output.rising),
               [](double value) { return std::isfinite(value); });
  std::sort(output.rising.begin(), output.rising.end());
  return output;
}

/// The rows of an output in CSV.
void add_rows(protocol::Table& table, const OutputStatistics& output) {
  for (const auto& [name, of_parts] : output.statistics) {
    for (std::size_t part = 0; part < of_parts.size(); ++part) {
      const auto& [value, from, to] = of_parts[part];
      table.rows.push_back({output.name, name, static_cast<std::int64_t>(output.points[part]),
                            value_of(value), value_of(from), value_of(to)});
    }
  }
}

/// Statistics of all points with intervals, and for comparison those of the first parts.
std::string table_of(const OutputStatistics& output) {
  protocol::Table table{
      .columns = {output.name, output.has_texts ? "probability" : "value", "95 %"}};
  for (std::size_t part = 0; part + 1 < output.points.size(); ++part) {
    table.columns.push_back(fmt::format("of the first {}", format_count(output.points[part])));
  }
  for (const auto& [name, of_parts] : output.statistics) {
    auto& row = table.rows.emplace_back(protocol::Row{name, value_of(of_parts.back().value),
                                                      interval_in_words(of_parts.back(), 5)});
    for (std::size_t part = 0; part + 1 < of_parts.size(); ++part) {
      row.push_back(value_of(of_parts[part].value));
    }
  }
  return text_of(table);
}

nlohmann::ordered_json json_of(const OutputStatistics& output) {
  nlohmann::ordered_json json{{"name", output.name}, {"points", output.points}};
  for (const auto& [name, of_parts] : output.statistics) {
    json["statistics"][name] = json_of(of_parts);
  }
  return json;
}

plot::Panel histogram_of(const SampledStudy& study, const OutputStatistics& output) {
  plot::Panel panel;
  panel.x = plot::axis_of(output.name, server::unit_of_column(output.name));
  panel.x.span(plot::range_of(output.rising));
  panel.bars = plot::binned(output.rising, panel.x);
  panel.x.range = {panel.bars->edges.front(), panel.bars->edges.back()};
  const double top = 1.05 * std::max(plot::range_of(panel.bars->heights).to, 1.0);
  panel.y = {.label = "points", .name = "points", .range = {0.0, top}};
  for (const double share : study.shares) {
    const double value = quantile_of(output.rising, share).value;
    panel.curves.push_back(
        {.name = fmt::format("{} % quantile", solver::readable_number(100.0 * share)),
         .x = {value, value},
         .y = {0.0, top},
         .stroke = panel.curves.size() + 1});
  }
  return panel;
}

plot::Panel bars_of_texts(const OutputStatistics& output) {
  constexpr std::size_t kMostBars = 12;
  plot::Panel panel{.title = output.name,
                    .x = {.label = "probability", .name = "probability"},
                    .y = {.name = output.name},
                    .bars = plot::Bars{}};
  for (std::size_t i = 0; i < std::min(kMostBars, output.statistics.size()); ++i) {
    const Estimate& probability = output.statistics[i].of_parts.back();
    panel.bars->names.push_back(output.statistics[i].name);
    panel.bars->heights.push_back(probability.value);
    panel.bars->intervals.push_back({probability.from, probability.to});
    panel.x.range.to = i == 0 ? std::min(1.0, 1.1 * probability.to) : panel.x.range.to;
  }
  if (output.statistics.size() > kMostBars) {
    panel.title += fmt::format(": the {} most probable of {}", kMostBars, output.statistics.size());
  }
  return panel;
}

plot::Figure figure_of(const SampledStudy& study, const std::vector<OutputStatistics>& outputs) {
  plot::Figure figure{
      .title = study.name,
      .subtitle =
          fmt::format("{} points ({})", format_count(outputs.front().points.back()), study.kind),
      .columns = std::min<std::size_t>(2, outputs.size()),
      .panel_size = {560.0, 320.0}};
  for (const OutputStatistics& output : outputs) {
    figure.panels.push_back(output.has_texts ? bars_of_texts(output) : histogram_of(study, output));
  }
  return figure;
}

void note_points(Console& console, const SampledStudy& study) {
  const auto& status = study.status;
  if (status.failed() > 0) {
    console.note(fmt::format("Note: {} of {} points failed and are left out.",
                             format_count(status.failed()), format_count(status.points())));
  }
  if (const auto open = protocol::open_points(status); open > 0) {
    console.note(fmt::format("Note: {} of {} points have no result yet.", format_count(open),
                             format_count(status.points())));
  }
  if (study.kind != "random") {
    console.note(fmt::format(
        "Note: the intervals are those of random points; {} points are spread more evenly, so the "
        "intervals of means, quantiles and probabilities are rather too wide.",
        study.kind));
  }
}

int uncertainty(const UncertaintyFlags& flags, Console& console) {
  static_cast<void>(choice_of(flags.answer));
  const SampledStudy study = read_study(console, flags);
  if (study.inputs_and_outputs.front().numbers.empty()) {
    throw std::runtime_error(fmt::format("no point of \"{}\" has a result{}", flags.study,
                                         flags.where.empty() ? "" : " that meets --where"));
  }
  note_points(console, study);
  std::vector<OutputStatistics> outputs;
  protocol::Table rows{.columns = {"output", "statistic", "points", "value", "from", "to"}};
  nlohmann::ordered_json json{{"study", study.name},
                              {"sample", study.kind},
                              {"points", study.status.points()},
                              {"failed", study.status.failed()},
                              {"inputs", study.inputs}};
  std::string tables;
  for (std::size_t i = 0; i < study.outputs.size(); ++i) {
    const auto& output = outputs.emplace_back(statistics_of(study, i));
    add_rows(rows, output);
    json["outputs"].push_back(json_of(output));
    tables += (tables.empty() ? "" : "\n") + table_of(output);
  }
  put_out(console, flags.answer,
          {.tables = std::move(tables),
           .rows = std::move(rows),
           .json = json.dump(2),
           .figure = figure_of(study, outputs)});
  return kDone;
}

}  // namespace

void add_uncertainty(CLI::App& app, Action& parsed) {
  auto [command, flags] = new_command(app, parsed, "uncertainty",
                                      "Show how the outputs of a sampled study are distributed",
                                      kUncertaintyExamples, uncertainty);
  add_study_argument(command, flags.study);
  command.add_option("--of", flags.of, std::string(kOutputsHelp))
      ->type_name("OUTPUTS")
      ->capture_default_str();
  command
      .add_option("--quantiles", flags.quantiles,
                  "quantiles to print, as fractions of the points: 0.5 is the median")
      ->type_name("P1,P2,...")
      ->capture_default_str();
  command.add_option("--where", flags.where, "condition that points must meet")->type_name("EXPR");
  add_answer_flags(command, flags.answer);
  add_source_flags(command, flags.source);
}

}  // namespace oblique::client
