#include "client/formats/row_printer.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/formats/csv_printer.h"
#include "client/formats/json_printer.h"
#include "client/formats/new_file.h"
#include "client/formats/table_printer.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr std::array<std::string_view, 4> kFormatNames{"table", "csv", "json", "jsonl"};

}  // namespace

std::span<const std::string_view> format_names() {
  return kFormatNames;
}

Format format_named(std::string_view name) {
  const auto found = std::find(kFormatNames.begin(), kFormatNames.end(), name);
  if (found == kFormatNames.end()) {
    throw solver::InputError("format = \"" + std::string(name) +
                             "\" is not allowed: it must be one of " +
                             protocol::joined(kFormatNames));
  }
  return static_cast<Format>(found - kFormatNames.begin());
}

std::string contradiction(std::string_view flag, std::string_view ending, const std::string& file) {
  return flag == ending
             ? std::string()
             : fmt::format(
                   "--format {} and --out {} contradict each other: a name that ends so is "
                   "for {}; leave the flag out, or give the file another ending",
                   flag, file, ending);
}

Format format_of_output(const std::string& flag, const std::string& file) {
  const std::string ending = std::filesystem::path(file).extension().string();
  const auto meant = std::string_view(ending).substr(ending.empty() ? 0 : 1);
  const bool is_known = meant != "table" && std::find(kFormatNames.begin(), kFormatNames.end(),
                                                      meant) != kFormatNames.end();
  if (!flag.empty()) {
    const Format format = format_named(flag);
    if (const std::string wrong = contradiction(flag, meant, file); is_known && !wrong.empty()) {
      throw solver::InputError(wrong);
    }
    return format;
  }
  if (is_known) {
    return format_named(meant);
  }
  if (file.empty() || file_place(file).is_in_place) {
    return Format::kTable;
  }
  throw solver::InputError(
      fmt::format("--out {} does not say in which format: end its name in .csv, .json or "
                  ".jsonl, or give --format",
                  file));
}

std::unique_ptr<RowPrinter> made_printer(Format format, Sink& sink, PrinterSettings settings) {
  switch (format) {
    case Format::kCsv:
      return std::make_unique<CsvPrinter>(sink);
    case Format::kJson:
      return std::make_unique<JsonPrinter>(sink, JsonPrinter::Shape::kArray);
    case Format::kJsonLines:
      return std::make_unique<JsonPrinter>(sink, JsonPrinter::Shape::kLines);
    case Format::kTable:
      break;
  }
  return std::make_unique<TablePrinter>(sink, std::move(settings));
}

std::vector<std::string> distinct_names(const protocol::QueryReply& chunk) {
  std::vector<std::string> names;
  const auto is_taken = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end() ||
           std::find(chunk.columns().begin(), chunk.columns().end(), name) != chunk.columns().end();
  };
  for (const std::string& column : chunk.columns()) {
    std::string name = column;
    const bool is_first = std::find(names.begin(), names.end(), name) == names.end();
    for (int i = 2; !is_first && is_taken(name); ++i) {
      name = column + "_" + std::to_string(i);
    }
    names.push_back(std::move(name));
  }
  return names;
}

}  // namespace oblique::client
