#include "client/verbs/printed_rows.h"

#include <iostream>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "client/output/columns.h"
#include "client/output/speech.h"
#include "proto/program/exit_code.h"

namespace oblique::client {

void add_format_flag(CLI::App& verb, std::string& format) {
  verb.add_option("--format", format, "table, csv, json or markdown")
      ->type_name("FORMAT")
      ->capture_default_str();
}

int print_whole(const protocol::QueryReply& rows, Format format) {
  print_out(rows, format);
  if (!rows.truncated()) {
    return protocol::kDone;
  }
  const ErrorOn error(std::cerr);
  std::cerr << fmt::format(
      "Only the first {} rows: the server sends no more at once. Narrow it with WHERE and LIMIT, "
      "or "
      "read the database itself with --db FILE.\n",
      rows.rows_size());
  return protocol::kFailed;
}

std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) {
    return text;
  }
  std::string quoted = "'";
  for (const char letter : text) {
    quoted += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
  }
  return quoted + "'";
}

void print_first(const protocol::QueryReply& rows, std::uint64_t points) {
  print_out(in_shown_units(rows), Format::kTable);
  if (static_cast<std::uint64_t>(rows.rows_size()) < points) {
    std::cerr << fmt::format("The first {} of {} points are shown.\n", rows.rows_size(), points);
  }
}

}  // namespace oblique::client
