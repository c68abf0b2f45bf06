#include "client/explore/answer.h"

#include <array>
#include <cmath>
#include <ostream>
#include <string_view>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "proto/program/usage.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

constexpr std::array<std::string_view, 3> kTextFormats{"table", "csv", "json"};

std::string ending_of(const std::string& file) {
  const auto dot = file.rfind('.');
  const auto slash = file.rfind('/');
  const bool has_ending = dot != std::string::npos && (slash == std::string::npos || dot > slash);
  return has_ending ? file.substr(dot + 1) : std::string();
}

}  // namespace

void add_answer_flags(CLI::App& command, AnswerFlags& flags) {
  auto* format = command
                     .add_option("--format", flags.format,
                                 "table, csv or json; default: as the name of --out ends, else "
                                 "table; the Python module returns NumPy arrays")
                     ->type_name("FORMAT");
  protocol::note_choices(format, kTextFormats);
  command
      .add_option("--out", flags.file,
                  "output file, written atomically: .csv or .json for the numbers; .svg, .pdf, "
                  ".png or .gp (a gnuplot script) for a picture, beside the table on standard "
                  "output")
      ->type_name("FILE");
}

AnswerChoice choice_of(const AnswerFlags& flags) {
  AnswerChoice choice;
  const std::string ending = ending_of(flags.file);
  choice.is_text_in_file = ending == "csv" || ending == "json";
  if (choice.is_text_in_file || flags.file.empty()) {
    choice.format = format_of_output(flags.format, flags.file, kTextFormats);
    return choice;
  }
  choice.picture = plot::picture_format("", flags.file);
  choice.format = format_of_output(flags.format, "", kTextFormats);
  return choice;
}

void put_out(Console& console, const AnswerFlags& flags, const Answer& answer) {
  const AnswerChoice choice = choice_of(flags);
  const std::string text =
      choice.format == Format::kTable ? answer.tables
      : choice.format == Format::kJson
          ? answer.json + '\n'
          : text_of({protocol::chunk_of(answer.rows)}, {.format = Format::kCsv});
  if (choice.picture) {
    plot::write_picture(plot::picture_of(answer.figure, *choice.picture), *choice.picture,
                        flags.file);
  }
  if (choice.is_text_in_file) {
    AtomicFile file(flags.file);
    file.append(text);
    file.finish();
  } else {
    console.out() << text;
  }
}

protocol::Value value_of(double number) {
  return std::isnan(number) ? protocol::Value() : protocol::Value(number);
}

std::string text_of(const protocol::Table& table) {
  return text_of({protocol::chunk_of(table)}, {.format = Format::kTable});
}

nlohmann::ordered_json json_of(const Estimate& estimate) {
  return {{"value", estimate.value}, {"from", estimate.from}, {"to", estimate.to}};
}

nlohmann::ordered_json json_of(const std::vector<Estimate>& estimates) {
  auto json = nlohmann::ordered_json::object();
  for (const Estimate& estimate : estimates) {
    json["value"].push_back(estimate.value);
    json["from"].push_back(estimate.from);
    json["to"].push_back(estimate.to);
  }
  return json;
}

std::string interval_in_words(const Estimate& estimate, int significant) {
  const auto end = [significant](double value) {
    return std::isnan(value) ? "?" : solver::readable_number(value, significant);
  };
  return std::isnan(estimate.from) && std::isnan(estimate.to)
             ? std::string()
             : fmt::format("{} to {}", end(estimate.from), end(estimate.to));
}

}  // namespace oblique::client
