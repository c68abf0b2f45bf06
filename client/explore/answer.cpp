#include "client/explore/answer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <ostream>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

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
constexpr std::array<std::string_view, 6> kEndings{".svg", ".pdf", ".png", ".gp", ".csv", ".json"};

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

/// Merges the columns NAME_from and NAME_to into one column "95 %".
protocol::Table with_intervals(protocol::Table table) {
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    if (table.columns[i].ends_with("_from")) {
      table.columns[i] = "95 %";
      table.columns.erase(table.columns.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      for (protocol::Row& row : table.rows) {
        row[i] = interval_text(row[i], row[i + 1]);
        row.erase(row.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      }
    }
  }
  return table;
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
  const auto ending = std::filesystem::path(flags.file).extension().string();
  if (!flags.file.empty() &&
      std::find(kEndings.begin(), kEndings.end(), ending) == kEndings.end()) {
    throw solver::InputError(
        fmt::format("--out {}: the ending is not a format: it must be one of {}", flags.file,
                    fmt::join(kEndings, ", ")));
  }
}

bool wants_picture(const AnswerFlags& flags) {
  return !flags.file.empty() && !flags.file.ends_with(".csv") && !flags.file.ends_with(".json");
}

Answer answer_of(nlohmann::ordered_json facts, protocol::Table rows, plot::Figure figure,
                 std::vector<std::string> notes) {
  facts["rows"] = json_rows(rows);
  facts["notes"] = notes;
  auto tables = text_of(with_intervals(rows));
  for (const std::string& note : notes) {
    tables += (&note == notes.data() ? "\n" : "") + note + '\n';
  }
  return {.tables = std::move(tables),
          .rows = std::move(rows),
          .json = facts.dump(2),
          .figure = std::move(figure),
          .notes = std::move(notes)};
}

void put_out(Console& console, const AnswerFlags& flags, const Answer& answer) {
  const auto format = format_named(flags.format, kTextFormats);
  console.out() << text_in_format(answer, format);
  for (const std::string& note :
       format == Format::kCsv ? answer.notes : std::vector<std::string>()) {
    console.note("Note: " + note);
  }
  if (!flags.file.empty()) {
    AtomicFile file(flags.file);
    file.append(
        wants_picture(flags)
            ? plot::picture_of(answer.figure, plot::picture_format({}, flags.file))
            : text_in_format(answer, flags.file.ends_with(".csv") ? Format::kCsv : Format::kJson));
    file.finish();
  }
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

nlohmann::ordered_json json_rows(const protocol::Table& table) {
  return nlohmann::ordered_json::parse(
      text_of({protocol::chunk_of(table)}, {.format = Format::kJson}));
}

std::string text_of(const protocol::Table& table) {
  return text_of({protocol::chunk_of(table)}, {.format = Format::kTable});
}

}  // namespace oblique::client
