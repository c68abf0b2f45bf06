#include "client/commands/shared.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"
#include "client/io/row_output.h"
#include "client/service/connection.h"
#include "client/service/watching.h"
#include "client/trace/solve_again.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "proto/wire/chunk.h"
#include "server/database/database_file.h"
#include "server/maintenance/study_changes_offline.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

namespace fs = std::filesystem;

bool is_database(const fs::path& file) {
  constexpr std::string_view kMagic = "SQLite format 3";
  std::array<char, kMagic.size()> begin{};
  std::error_code error;
  if (fs::is_regular_file(file, error)) {  // a pipe would block when opened
    std::ifstream(file, std::ios::binary).read(begin.data(), begin.size());
  }
  return std::string_view(begin.data(), begin.size()) == kMagic;
}

/// Returns the command line of a process as words; empty if it cannot be read.
std::vector<std::string> words_of_process(const std::string& pid) {
  std::ifstream file("/proc/" + pid + "/cmdline");
  std::vector<std::string> words;
  for (std::string word; std::getline(file, word, '\0');) {
    words.push_back(word);
  }
  return words;
}

/// Describes the process that has the database open as "`oblique view` (process 4711)": the
/// `oblique` that started the oblique-server, or else the server. Returns "another server" if the
/// process cannot be found, for example because another user runs it.
std::string user_of(const fs::path& database) try {
  for (const auto& process : fs::directory_iterator("/proc")) {
    const std::string pid = process.path().filename().string();
    const auto words = words_of_process(pid);
    if (words.empty() || fs::path(words[0]).filename() != "oblique-server") {
      continue;
    }
    const fs::directory_iterator open_files(process.path() / "fd");
    if (std::none_of(begin(open_files), end(open_files), [&](const fs::directory_entry& file) {
          std::error_code no_file;
          return fs::equivalent(file.path(), database, no_file);
        })) {
      continue;
    }
    const auto flag = std::find(words.begin(), words.end() - 1, "--stop-with-parent");
    const auto parent = flag == words.end() - 1 ? words : words_of_process(flag[1]);
    return flag == words.end() - 1 || parent.size() < 2
               ? fmt::format("oblique-server (process {})", pid)
               : fmt::format("`oblique {}` (process {})", parent[1], flag[1]);
  }
  return "another server";
} catch (const fs::filesystem_error&) {  // the process has ended
  return "another server";
}

}  // namespace

void add_study_argument(CLI::App& command, std::string& study) {
  command.add_option("STUDY", study, "name of the study")->required()->type_name("");
}

void add_format_flag(CLI::App& command, std::string& format) {
  auto* option = command.add_option("--format", format, "table, csv, json or jsonl")
                     ->type_name("FORMAT")
                     ->capture_default_str();
  protocol::note_choices(option, format_names());
}

void add_no_reuse_flag(CLI::App& command, bool& no_reuse) {
  command.add_flag(
      "--no-reuse", no_reuse,
      "solve every point, also points of which another study in the database has the result");
}

void add_network_disk_flag(CLI::App& command, bool& allow) {
  command.add_flag(
      "--allow-network-disk", allow,
      "allow a database on a network file system, where a second machine could damage it");
}

Study checked_study(Console& console, const StudyFlags& flags) {
  if (is_database(flags.file)) {
    throw solver::InputError(fmt::format(
        "{0} is a database, not a study file (TOML): pass it as --db {0} and name a study",
        flags.file.string()));
  }
  Study study = study_of_flags(flags, tip_reach(console));
  check_points(study);
  return study;
}

protocol::Recipe stored_recipe(Console& console, const SourceFlags& from,
                               const std::string& study) {
  const std::string database = database_meant(from);
  if (database.empty()) {
    return Connection(connection_settings(console, from)).describe(study);
  }
  const auto found = study_named(*open_source(console, from), study);
  return server::stored_recipe(database, found.study_id());
}

void refuse_used_database(const fs::path& database) {
  if (!server::is_in_use(database.string())) {
    return;
  }
  throw std::runtime_error(
      fmt::format("{} is in use by {}: end that process first (Ctrl-C loses nothing), start the "
                  "study on the page of `oblique view`, submit it to an oblique-server with "
                  "`oblique submit`, or name another --db",
                  database.string(), user_of(database)));
}

void add_output_flags(CLI::App& command, OutputFlags& flags) {
  auto* format = command
                     .add_option("--format", flags.format,
                                 "table, csv, json or jsonl; default: from the name of --out, else "
                                 "table; the Python module returns NumPy arrays")
                     ->type_name("FORMAT");
  protocol::note_choices(format, format_names());
  command.add_option("--out", flags.file, "output file, written atomically")->type_name("FILE");
  command.add_flag("--no-pager", flags.no_pager,
                   "print long tables without $OBLIQUE_PAGER, $PAGER or less");
}

Format format_of(const OutputFlags& flags) {
  return format_of_output(flags.format, flags.file);
}

std::uint64_t print_stream(Console& console, RowStream& stream, const OutputFlags& flags,
                           bool in_shown_units, const std::string& way_to_all) {
  const Format format = format_of(flags);
  // Waits for the first part of the answer before opening the output file, so that a failed query
  // opens no file.
  protocol::QueryReply chunk = stream.next();
  RowOutput out({.format = format,
                 .file = flags.file,
                 .may_page = !flags.no_pager,
                 .way_to_all = way_to_all,
                 .shown = in_shown_units ? shown_columns(chunk) : std::vector<ShownColumn>()});
  std::uint64_t rows = chunk.chunk_rows();
  try {
    out.print(chunk);
    while (!chunk.ends()) {
      chunk = stream.next();
      out.print(chunk);
      rows += chunk.chunk_rows();
    }
    out.finish();
    if (rows == 0 && console.can_redraw()) {
      console.note("No rows.");
    }
  } catch (const ClosedPipe&) {
    if (!out.is_paged()) {
      throw;
    }
  }
  return rows;
}

void print_first(Console& console, const std::vector<protocol::QueryReply>& chunks,
                 std::uint64_t points) {
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
    console.note(fmt::format("The first {} of {} points are shown.", format_count(rows),
                             format_count(points)));
  }
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

}  // namespace oblique::client
