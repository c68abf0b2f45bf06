#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include "client/explore/estimate.h"
#include "client/io/console.h"
#include "client/plot/figure.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// Format and file of the answer of an exploration.
struct AnswerFlags {
  std::string format{"table"};  ///< of standard output
  std::string file;             ///< its ending chooses numbers or a picture; may be empty
};
/// Adds --format and --out. `flags` must live as long as `command`.
void add_answer_flags(CLI::App& command, AnswerFlags& flags);
/// Throws solver::InputError, naming the flag, for an unknown format or ending.
void check(const AnswerFlags& flags);
/// Whether --out names a picture.
bool wants_picture(const AnswerFlags& flags);

/// The answer of an exploration in each form.
struct Answer {
  std::string tables = {};    ///< for people
  protocol::Table rows = {};  ///< CSV: every number with all digits
  std::string json = {};
  plot::Figure figure = {};
  /// Sentences about what the answer lacks. `tables` and `json` have them, too.
  std::vector<std::string> notes = {};
};
/// The answer that consists of `rows`. JSON is `facts` with the rows as the member "rows"; in the
/// table the columns NAME_from and NAME_to become an interval. The table and JSON end with `notes`.
Answer answer_of(nlohmann::ordered_json facts, protocol::Table rows, plot::Figure figure,
                 std::vector<std::string> notes);

/// Prints the answer to standard output, and writes the file of --out. The notes of a CSV answer
/// are notes of the console.
void put_out(Console& console, const AnswerFlags& flags, const Answer& answer);

/// NaN is NULL.
protocol::Value value_of(double number);
/// Adds the columns of an estimate: NAME, NAME_from and NAME_to.
void append_columns(protocol::Table& table, const std::string& name);
/// Adds the value of an estimate and the ends of its interval, for the columns of `append_columns`.
void append_values(protocol::Row& row, const Estimate& estimate);
/// Returns the rows as JSON objects.
nlohmann::ordered_json json_rows(const protocol::Table& table);
/// Formats a table for people.
std::string text_of(const protocol::Table& table);

}  // namespace oblique::client
