#include "client/verbs/picture_flags.h"

#include <unistd.h>

#include <iostream>

#include "client/formats/pager.h"
#include "client/formats/sink.h"
#include "client/plot/terminal/terminal_figure.h"
#include "proto/program/choices.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {

void add_picture_flags(CLI::App& verb, PictureFlags& flags) {
  verb.add_option(
          "--size", flags.size,
          "width and height in pixels, of PNG twice as many; higher where a legend needs it")
      ->type_name("WxH")
      ->default_str("760x520");
  verb.add_option("--out", flags.out, "file to write, which appears when it is whole")
      ->type_name("FILE");
  auto* format =
      verb.add_option("--format", flags.format,
                      "svg, png, csv or gnuplot; as the file's name ends when left out, else svg")
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
  const bool is_for_terminal =
      flags.out.empty() && flags.format.empty() && terminal_size().lines > 0;
  const bool is_shown = flags.show || is_for_terminal;
  return {format, is_shown, !is_shown || !flags.out.empty()};
}

plot::Size picture_size(const PictureFlags& flags, const plot::Size& own) {
  return flags.size.empty() ? own : plot::size_of(flags.size);
}

void put_out(const PictureFlags& flags, const plot::Figure& figure,
             const std::function<std::string(plot::PictureFormat)>& made) {
  const PictureChoice choice = picture_choice(flags);
  if (choice.is_shown) {
    std::cout.flush();
    write_all(STDOUT_FILENO, plot::text_of(figure, plot::look_of_standard_output()),
              "standard output");
  }
  if (choice.is_written) {
    plot::write_picture(made(choice.format), choice.format, flags.out);
  }
}

}  // namespace oblique::client
