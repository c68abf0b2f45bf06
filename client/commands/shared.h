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
/// Adds --format for commands that print a short table.
void add_format_flag(CLI::App& command, std::string& format);
void add_no_reuse_flag(CLI::App& command, bool& no_reuse);
void add_network_disk_flag(CLI::App& command, bool& allow);

/// Returns the study that the flags name or define, fully checked. Throws solver::InputError.
Study checked_study(Console& console, const StudyFlags& flags);

/// Returns the recipe of a stored study. Throws std::runtime_error if there is no such study.
protocol::Recipe stored_recipe(Console& console, const SourceFlags& from, const std::string& study);

/// Throws std::runtime_error, with process and remedy, if a server has the database open.
void refuse_used_database(const std::filesystem::path& database);

/// Destination and format of a long answer.
struct OutputFlags {
  std::string format;  // empty: given by the ending of `file`, else a table
  std::string file;
  bool no_pager = false;
};
/// Adds --format, --out and --no-pager.
void add_output_flags(CLI::App& command, OutputFlags& flags);
/// Returns the format that the flags name. Throws solver::InputError as format_of_output does.
Format format_of(const OutputFlags& flags);

/// Prints an answer as it arrives and returns its number of rows. With `in_shown_units`, tables use
/// the units of shown_columns(). `way_to_all` is the same as in OutputSettings. Throws the errors
/// of the source and of RowOutput.
std::uint64_t print_stream(Console& console, RowStream& stream, const OutputFlags& flags,
                           bool in_shown_units,
                           const std::string& way_to_all = "csv and json have all");

/// Prints the first rows of a study as a table, and a note if the study has more `points`.
void print_first(Console& console, const std::vector<protocol::QueryReply>& chunks,
                 std::uint64_t points);

/// Quotes `text` as one word for a shell.
std::string shell_word(const std::string& text);

}  // namespace oblique::client
