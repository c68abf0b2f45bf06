#include "client/plot/picture_file.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <thread>

#include <spdlog/fmt/fmt.h>

#include "client/formats/new_file.h"
#include "client/formats/sink.h"
#include "client/io/console.h"
#include "client/plot/figure_table.h"
#include "client/plot/gnuplot_script.h"
#include "client/service/child_process.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

struct NamedFormat {
  std::string_view name;
  PictureFormat format;
};
// A file's ending is a point and the name.
constexpr std::array<NamedFormat, 5> kFormats{{
    {"svg", PictureFormat::kSvg},
    {"pdf", PictureFormat::kPdf},
    {"png", PictureFormat::kPng},
    {"gp", PictureFormat::kScript},
    {"csv", PictureFormat::kCsv},
}};
constexpr std::string_view kAllowed = "svg, pdf, png, gp or csv";

constexpr std::size_t kMostBytes = std::size_t{256} << 20U;
// A map of 10^6 cells takes about 5 s.
constexpr std::chrono::seconds kTimeLimit{120};

std::optional<PictureFormat> format_named(std::string_view name) {
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(),
                                   [name](const NamedFormat& each) { return each.name == name; });
  return found == kFormats.end() ? std::nullopt : std::optional(found->format);
}

}  // namespace

std::vector<std::string_view> picture_format_names() {
  std::vector<std::string_view> names;
  for (const auto& format : kFormats) {
    names.push_back(format.name);
  }
  return names;
}

PictureFormat picture_format(const std::string& name, const std::string& file) {
  if (!name.empty()) {
    if (const auto format = format_named(name)) {
      return *format;
    }
    throw solver::InputError(fmt::format("--format {} is not known{}: it must be {}", name,
                                         protocol::did_you_mean(name, picture_format_names()),
                                         kAllowed));
  }
  if (file.empty()) {
    return PictureFormat::kSvg;
  }
  std::string ending = std::filesystem::path(file).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char letter) {
    return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter + 32)
                                          : static_cast<char>(letter);
  });
  if (const auto format = format_named(ending.empty() ? ending : ending.substr(1))) {
    return *format;
  }
  if (std::filesystem::exists(file) && !std::filesystem::is_regular_file(file)) {
    return PictureFormat::kSvg;  // a pipe or a device has no ending
  }
  throw solver::InputError(fmt::format(
      "--out {}: its ending is not a format; it must be .svg, .pdf, .png, .gp or .csv, or --format "
      "{}",
      file, kAllowed));
}

std::string output_of_gnuplot(const std::string& script) {
  try {
    // Without the settings of the user's ~/.gnuplot.
    ChildProcess gnuplot({.program = "gnuplot",
                          .arguments = {"--default-settings", "-"},
                          .keep_output = true,
                          .input = script,
                          .stays_in_our_group = true});
    const auto deadline = std::chrono::steady_clock::now() + kTimeLimit;
    while (gnuplot.is_running()) {
      if (std::chrono::steady_clock::now() > deadline) {
        throw std::runtime_error(fmt::format(
            "gnuplot took longer than {} s and was ended: draw fewer points", kTimeLimit.count()));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    // gnuplot ends with 0 after some errors, and then has drawn nothing.
    std::string output = gnuplot.output(kMostBytes);
    if (!gnuplot.succeeded() || output.empty()) {
      throw std::runtime_error(
          fmt::format("gnuplot {}: {}", gnuplot.ending(), gnuplot.last_words()));
    }
    return output;
  } catch (const ProgramNotFound&) {
    throw std::runtime_error(
        "pictures are made by gnuplot, which is not installed: install it (Debian: gnuplot-nox), "
        "or write the script for it with --out FILE.gp");
  }
}

std::string picture_of(const Figure& figure, PictureFormat format,
                       const std::optional<Size>& size) {
  const Size in_pixels = size.value_or(own_size(figure));
  switch (format) {
    case PictureFormat::kSvg:
      return output_of_gnuplot(script_of(figure, Terminal::kSvg, in_pixels));
    case PictureFormat::kPdf:
      return output_of_gnuplot(script_of(figure, Terminal::kPdf, in_pixels));
    case PictureFormat::kPng:
      return output_of_gnuplot(script_of(figure, Terminal::kPng, in_pixels));
    case PictureFormat::kScript:
      return script_of(figure, Terminal::kSvg, in_pixels, "picture.svg");
    case PictureFormat::kCsv:
      return csv_of(figure);
  }
  throw std::logic_error("unknown picture format");
}

std::string text_of(const Figure& figure) {
  const TerminalSize terminal = terminal_size(STDOUT_FILENO);
  const bool is_terminal = terminal.lines > 0;
  const bool has_colours = may_colour(STDOUT_FILENO);
  constexpr std::size_t kLinesOfPanel = 20;
  const std::size_t rows = figure.panels.size();
  const std::size_t columns = is_terminal ? std::clamp<std::size_t>(terminal.columns, 40, 200) : 80;
  const std::size_t lines = is_terminal ? std::clamp<std::size_t>(terminal.lines - 1, 20, 60) : 30;
  Figure below = figure;
  below.columns = 1;
  const std::string drawn = output_of_gnuplot(
      script_for_terminal(below, columns, rows > 1 ? rows * kLinesOfPanel : lines, has_colours));
  std::string text;
  for (const auto line : protocol::split(drawn, '\n')) {
    const auto end = line.find_last_not_of(" \f");
    if (end != std::string_view::npos) {
      text.append(line.substr(0, end + 1)).append("\n");
    }
  }
  return text;
}

void write_picture(const std::string& picture, PictureFormat format, const std::string& file) {
  if (!file.empty()) {
    NewFile out(file);
    out.append(picture);
    out.finish();
    return;
  }
  const bool is_binary = format == PictureFormat::kPng || format == PictureFormat::kPdf;
  if (is_binary && isatty(STDOUT_FILENO) == 1) {
    throw solver::InputError(
        "PNG and PDF are no text, and standard output is a terminal: write them to a file with "
        "--out FILE.png or FILE.pdf");
  }
  StandardOutput out;
  out.append(picture);
  out.finish();
}

Size size_of(const std::string& text) {
  const auto times = text.find('x');
  const auto width = solver::number_of(text.substr(0, times));
  const auto height =
      times == std::string::npos ? std::nullopt : solver::number_of(text.substr(times + 1));
  const auto is_allowed = [](double side) {
    return side >= kSmallestSide && side <= kLargestSide && side == static_cast<int>(side);
  };
  if (!width || !height || !is_allowed(*width) || !is_allowed(*height)) {
    throw solver::InputError(fmt::format(
        "--size {} is not allowed: it must be WIDTHxHEIGHT, whole numbers from {} to {}", text,
        solver::exact_number(kSmallestSide), solver::exact_number(kLargestSide)));
  }
  return {*width, *height};
}

}  // namespace oblique::client::plot
