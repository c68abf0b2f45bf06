#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include "client/explore/estimate.h"
#include "client/io/console.h"
#include "client/io/row_output.h"
#include "client/plot/figure.h"
#include "client/plot/picture_file.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// Where the answer of an exploration goes.
struct AnswerFlags {
  std::string format;  ///< of standard output; empty: a table
  std::string file;    ///< table, numbers or picture, by its ending; empty: none
};
/// Adds --format and --out. `flags` must live as long as `command`.
void add_answer_flags(CLI::App& command, AnswerFlags& flags);

/// What the flags say together.
struct AnswerChoice {
  Format format = Format::kTable;                   ///< of the text
  bool is_text_in_file = false;                     ///< else on standard output
  std::optional<plot::PictureFormat> picture = {};  ///< that the file holds
};
/// Throws solver::InputError, naming the flag, for an unknown format or ending, and for a format
/// that contradicts the file's ending.
AnswerChoice choice_of(const AnswerFlags& flags);

/// The answer of an exploration in each form.
struct Answer {
  std::string tables = {};    ///< for people
  protocol::Table rows = {};  ///< CSV: every number with all digits
  std::string json = {};
  plot::Figure figure = {};
};
/// Prints the text to standard output or writes it to --out; a picture goes to --out beside it.
void put_out(Console& console, const AnswerFlags& flags, const Answer& answer);

// ---- Numbers of answers ----

/// NaN is NULL.
protocol::Value value_of(double number);
/// A table as people read it.
std::string text_of(const protocol::Table& table);
/// {"value", "from", "to"} of one estimate, or as arrays of several; NaN becomes null.
nlohmann::ordered_json json_of(const Estimate& estimate);
nlohmann::ordered_json json_of(const std::vector<Estimate>& estimates);
/// "0.30 to 0.33" with so many significant digits; empty without either end.
std::string interval_in_words(const Estimate& estimate, int significant = 4);

}  // namespace oblique::client
