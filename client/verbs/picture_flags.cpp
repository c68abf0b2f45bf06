#include "client/verbs/picture_flags.h"

#include <unistd.h>

#include <iostream>

#include "client/io/sink.h"
#include "proto/program/usage.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {

void add_picture_flags(CLI::App& verb, PictureFlags& flags) {
  verb.add_option("--size", flags.size, "width and height in pixels, of PNG twice as many")
      ->type_name("WxH")
      ->default_str("760x520");
  verb.add_option("--out", flags.out, "output file, written atomically")->type_name("FILE");
  auto* format =
      verb.add_option("--format", flags.format,
                      "svg, pdf, png, gp (a gnuplot script) or csv; default: as the name of "
                      "--out ends. Without --out it goes to standard output")
          ->type_name("FORMAT");
  protocol::note_choices(format, plot::picture_format_names());
  verb.add_flag("--show", flags.show, "draw on the terminal");
}

PictureChoice picture_choice(const PictureFlags& flags) {
  const auto format = plot::picture_format(flags.format, flags.out);
  if (flags.show && flags.out.empty() && !flags.format.empty()) {
    throw solver::InputError(
        "--show draws on standard output: give the file for --format as --out FILE");
  }
  const bool is_shown = flags.show || (flags.out.empty() && flags.format.empty());
  return {format, is_shown, !is_shown || !flags.out.empty()};
}

void refuse_pipe(const PictureFlags& flags) {
  if (flags.out.empty() && flags.format.empty() && !flags.show && terminal_size().lines == 0) {
    throw solver::InputError(
        "standard output is no terminal: name a file for the picture with --out FILE.svg (or .pdf, "
        ".png, .gp, .csv), or draw it in characters with --show");
  }
}

std::optional<plot::Size> picture_size(const PictureFlags& flags) {
  return flags.size.empty() ? std::nullopt : std::optional(plot::size_of(flags.size));
}

void put_out(const PictureFlags& flags, const plot::Figure& figure) {
  const PictureChoice choice = picture_choice(flags);
  if (choice.is_shown) {
    std::cout.flush();
    write_all(STDOUT_FILENO, plot::text_of(figure), "standard output");
  }
  if (choice.is_written) {
    plot::write_picture(plot::picture_of(figure, choice.format, picture_size(flags)), choice.format,
                        flags.out);
  }
}

}  // namespace oblique::client
