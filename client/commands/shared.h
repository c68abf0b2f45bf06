#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "client/io/console.h"
#include "client/io/row_output.h"
#include "client/service/connection.h"
#include "client/service/run_service.h"
#include "client/service/source.h"
#include "client/study/point_flags.h"
#include "client/study/study.h"
#include "proto/oblique.pb.h"

// Flags and functions that several commands share.
namespace oblique::client {

/// Adds the argument STUDY, the name of a stored study.
void add_study_argument(CLI::App& command, std::string& study);
/// Adds --format for a short table.
void add_format_flag(CLI::App& command, std::string& format);
void add_no_reuse_flag(CLI::App& command, bool& no_reuse);
void add_network_disk_flag(CLI::App& command, bool& allow);

/// The study that the flags name or define, fully checked. Throws solver::InputError.
Study checked_study(Console& console, const StudyFlags& flags);

/// The recipe of a stored study. Throws std::runtime_error if there is no such study.
protocol::Recipe stored_recipe(Console& console, const SourceFlags& from, const std::string& study);

/// Throws std::runtime_error, naming the process and the remedy, if a server has the database open.
void refuse_used_database(const std::filesystem::path& database);

/// Where and how a long answer is printed.
struct OutputFlags {
  std::string format;  // empty: from the ending of `file`, else a table
  std::string file;
  bool no_pager = false;
};
/// Adds --format, --out and --no-pager.
void add_output_flags(CLI::App& command, OutputFlags& flags);
/// The format that `output` names; throws solver::InputError as format_of_output does.
Format format_of(const OutputFlags& flags);

/// Prints an answer as it arrives, in tables with shown_columns() if `in_shown_units`; `way_to_all`
/// as in OutputSettings. Returns the number of rows. Throws as the source and RowOutput do.
std::uint64_t print_stream(Console& console, RowStream& stream, const OutputFlags& flags,
                           bool in_shown_units,
                           const std::string& way_to_all = "csv and json have all");

/// Prints the first rows of a study as a table, and a note if the study has more `points`.
void print_first(Console& console, const std::vector<protocol::QueryReply>& chunks,
                 std::uint64_t points);

/// `text`, quoted as one word for a shell.
std::string shell_word(const std::string& text);

}  // namespace oblique::client
