#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "client/plot/figure.h"
#include "client/plot/picture_file.h"

namespace oblique::client {

/// Where a picture goes, and how large it is.
struct PictureFlags {
  std::string size;  ///< empty: its own
  std::string out;
  std::string format;
  bool show = false;
};

/// Adds --size, --out, --format and --show. `flags` must live as long as `verb`.
void add_picture_flags(CLI::App& verb, PictureFlags& flags);

/// What the flags say together. Throws solver::InputError, naming the flag.
struct PictureChoice {
  plot::PictureFormat format;
  bool is_shown;    ///< on standard output, as text
  bool is_written;  ///< to a file or to standard output
};
PictureChoice picture_choice(const PictureFlags& flags);

/// Throws solver::InputError where the flags leave open where a picture goes, and standard output
/// is no terminal.
void refuse_pipe(const PictureFlags& flags);

/// The size asked for; none: the picture's own.
std::optional<plot::Size> picture_size(const PictureFlags& flags);

/// Shows the figure on the terminal, writes the picture, or both.
void put_out(const PictureFlags& flags, const plot::Figure& figure);

}  // namespace oblique::client
