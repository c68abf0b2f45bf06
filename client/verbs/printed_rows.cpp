#include "client/verbs/printed_rows.h"

#include <iostream>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/io/row_output.h"
#include "client/output/columns.h"
#include "client/output/human_units.h"
#include "client/output/terminal.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "proto/wire/chunk.h"
#include "server/query/columns.h"

namespace oblique::client {

void add_format_flag(CLI::App& verb, std::string& format) {
  auto* option = verb.add_option("--format", format, "table, csv, json or jsonl")
                     ->type_name("FORMAT")
                     ->capture_default_str();
  protocol::note_choices(option, format_names());
}

void add_output_flags(CLI::App& verb, OutputFlags& flags) {
  auto* format = verb.add_option("--format", flags.format,
                                 "table, csv, json or jsonl; default: as the name of --out "
                                 "ends, else table; the Python module returns NumPy arrays")
                     ->type_name("FORMAT");
  protocol::note_choices(format, format_names());
  verb.add_option("--out", flags.file, "output file, written atomically")->type_name("FILE");
  verb.add_flag("--no-pager", flags.no_pager,
                "print long tables on a terminal without $OBLIQUE_PAGER, $PAGER or less");
}

Format format_of(const OutputFlags& flags) {
  return format_of_output(flags.format, flags.file);
}

int print_stream(RowStream& stream, const OutputFlags& flags, bool in_shown_units,
                 const std::string& way_to_all) {
  const Format format = format_of(flags);
  // Nothing is begun, and no file, before there is a first answer.
  protocol::QueryReply chunk = stream.next();
  RowOutput out({.format = format,
                 .file = flags.file,
                 .may_page = !flags.no_pager,
                 .way_to_all = way_to_all,
                 .shown = in_shown_units ? shown_columns(chunk) : std::vector<ShownColumn>()});
  try {
    out.print(chunk);
    std::uint64_t rows = chunk.chunk_rows();
    while (!chunk.ends()) {
      chunk = stream.next();
      out.print(chunk);
      rows += chunk.chunk_rows();
    }
    out.finish();
    if (rows == 0 && draws_on_terminal()) {
      std::cerr << "No rows.\n";
    }
  } catch (const ClosedPipe&) {
    if (!out.is_paged()) {
      throw;
    }
  }
  return protocol::kDone;
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

void print_first(const std::vector<protocol::QueryReply>& chunks, std::uint64_t points) {
  std::uint64_t rows = 0;
  for (const auto& chunk : chunks) {
    rows += chunk.chunk_rows();
  }
  if (rows == 0) {
    return;
  }
  RowOutput out({.may_page = false, .shown = shown_columns(chunks.front())});
  for (const auto& chunk : chunks) {
    out.print(chunk);
  }
  out.finish();
  if (rows < points) {
    std::cerr << fmt::format("The first {} of {} points are shown.\n", shown_count(rows),
                             shown_count(points));
  }
}

}  // namespace oblique::client
