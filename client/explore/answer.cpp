#include "client/explore/answer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string_view>
#include <utility>
#include <variant>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/io/row_output.h"
#include "client/plot/picture_file.h"
#include "proto/program/usage.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

constexpr std::array<std::string_view, 3> kTextFormats{"table", "csv", "json"};

/// The format of a file with numbers; none for pictures.
std::optional<Format> numbers_format(const std::string& file) {
  return file.ends_with(".csv")    ? std::optional(Format::kCsv)
         : file.ends_with(".json") ? std::optional(Format::kJson)
                                   : std::nullopt;
}

std::string text_in_format(const Answer& answer, Format format) {
  return format == Format::kTable  ? answer.tables
         : format == Format::kJson ? answer.json + '\n'
                                   : text_of({protocol::chunk_of(answer.rows)}, {.format = format});
}

std::string interval_text(const protocol::Value& from, const protocol::Value& to) {
  const auto text = [](const protocol::Value& end) {
    const auto* number = std::get_if<double>(&end);
    return number == nullptr ? "?" : solver::readable_number(*number, 4);
  };
  return from.index() == 0 && to.index() == 0 ? "" : fmt::format("{} to {}", text(from), text(to));
}

protocol::Table with_intervals(const protocol::Table& rows) {
  protocol::Table shown;
  shown.rows.resize(rows.rows.size());
  for (std::size_t i = 0; i < rows.columns.size(); ++i) {
    const bool is_interval = rows.columns[i].ends_with("_from");
    shown.columns.push_back(is_interval ? "95 %" : rows.columns[i]);
    for (std::size_t row = 0; row < rows.rows.size(); ++row) {
      const auto& cells = rows.rows[row];
      shown.rows[row].push_back(is_interval ? interval_text(cells[i], cells[i + 1]) : cells[i]);
    }
    i += is_interval ? 1 : 0;
  }
  return shown;
}

}  // namespace

void add_answer_flags(CLI::App& command, AnswerFlags& flags) {
  auto* format = command.add_option("--format", flags.format, "table, csv or json")
                     ->type_name("FORMAT")
                     ->capture_default_str();
  protocol::note_choices(format, kTextFormats);
  command
      .add_option("--out", flags.file,
                  "file beside the text on standard output: a picture (svg, pdf, png, or gp, a "
                  "gnuplot script) or numbers (csv, json) as its name ends")
      ->type_name("FILE");
}

void check(const AnswerFlags& flags) {
  static_cast<void>(format_named(flags.format, kTextFormats));
  const auto pictures = plot::picture_format_names();
  const auto ending = std::filesystem::path(flags.file).extension().string();
  if (!flags.file.empty() && !numbers_format(flags.file) &&
      std::find(pictures.begin(), pictures.end(), ending.substr(ending.empty() ? 0 : 1)) ==
          pictures.end()) {
    throw solver::InputError(
        fmt::format("--out {}: the ending is not a format: it must be one of .svg, .pdf, .png, "
                    ".gp, .csv, .json",
                    flags.file));
  }
}

Answer answer_of(nlohmann::ordered_json facts, protocol::Table rows, plot::Figure figure) {
  facts["rows"] =
      nlohmann::ordered_json::parse(text_of({protocol::chunk_of(rows)}, {.format = Format::kJson}));
  auto tables = text_of(with_intervals(rows));
  return {.tables = std::move(tables),
          .rows = std::move(rows),
          .json = facts.dump(2),
          .figure = std::move(figure)};
}

void put_out(Console& console, const AnswerFlags& flags, const Answer& answer) {
  console.out() << text_in_format(answer, format_named(flags.format, kTextFormats));
  if (flags.file.empty()) {
    return;
  }
  if (const auto format = numbers_format(flags.file)) {
    AtomicFile file(flags.file);
    file.append(text_in_format(answer, *format));
    file.finish();
    return;
  }
  const auto format = plot::picture_format({}, flags.file);
  plot::write_picture(plot::picture_of(answer.figure, format), format, flags.file);
}

protocol::Value value_of(double number) {
  return std::isnan(number) ? protocol::Value() : protocol::Value(number);
}

void append_columns(protocol::Table& table, const std::string& name) {
  table.columns.insert(table.columns.end(), {name, name + "_from", name + "_to"});
}

void append_values(protocol::Row& row, const Estimate& estimate) {
  row.insert(row.end(), {value_of(estimate.value), value_of(estimate.from), value_of(estimate.to)});
}

std::string text_of(const protocol::Table& table) {
  return text_of({protocol::chunk_of(table)}, {.format = Format::kTable});
}

}  // namespace oblique::client
