#include "client/plot/files/picture_file.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/formats/new_file.h"
#include "client/formats/sink.h"
#include "client/plot/figures/svg_figure.h"
#include "client/plot/files/figure_table.h"
#include "client/service/child_process.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

struct NamedFormat {
  std::string_view name;
  std::string_view ending;
  PictureFormat format;
};
constexpr std::array<NamedFormat, 5> kFormats{{
    {"svg", ".svg", PictureFormat::kSvg},
    {"png", ".png", PictureFormat::kPng},
    {"csv", ".csv", PictureFormat::kCsv},
    {"gnuplot", ".gnuplot", PictureFormat::kGnuplot},
    {"gnuplot", ".gp", PictureFormat::kGnuplot},
}};

constexpr std::size_t kMostPngBytes = std::size_t{256} << 20U;

/// Nothing of it stays behind when we are killed: no process, no file.
std::string png_made_of(const std::string& svg) {
  try {
    ChildProcess converter({.program = "rsvg-convert",
                            .arguments = {"--format", "png", "--zoom", "2"},
                            .keep_output = true,
                            .input = svg,
                            .stays_in_our_group = true});
    while (converter.is_running()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    if (!converter.succeeded()) {
      throw std::runtime_error(
          fmt::format("rsvg-convert {}: {}", converter.ending(), converter.last_words()));
    }
    return converter.output(kMostPngBytes);
  } catch (const ProgramNotFound&) {
    throw std::runtime_error(
        "PNG is made by rsvg-convert, which is not here: install it (Debian: librsvg2-bin), or "
        "take --format svg");
  }
}

}  // namespace

std::vector<std::string_view> picture_format_names() {
  std::vector<std::string_view> names;
  for (const auto& format : kFormats) {
    if (std::find(names.begin(), names.end(), format.name) == names.end()) {
      names.push_back(format.name);
    }
  }
  return names;
}

PictureFormat picture_format(const std::string& name, const std::string& file) {
  constexpr std::string_view kAllowed = "svg, png, csv or gnuplot";
  std::vector<std::string_view> names;
  for (const auto& format : kFormats) {
    if (name == format.name) {
      return format.format;
    }
    names.push_back(format.name);
  }
  if (!name.empty()) {
    throw solver::InputError(fmt::format("--format {} is not known{}: it must be {}", name,
                                         protocol::did_you_mean(name, names), kAllowed));
  }
  if (file.empty()) {
    return PictureFormat::kSvg;
  }
  std::string ending = std::filesystem::path(file).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char letter) {
    return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter + 32)
                                          : static_cast<char>(letter);
  });
  for (const auto& format : kFormats) {
    if (ending == format.ending) {
      return format.format;
    }
  }
  if (std::filesystem::exists(file) && !std::filesystem::is_regular_file(file)) {
    return PictureFormat::kSvg;  // a pipe or a device has no ending
  }
  throw solver::InputError(
      fmt::format("--out {}: its ending says no format; it must be .svg, .png, .csv or .gnuplot, "
                  "or --format {}",
                  file, kAllowed));
}

std::string picture_of(const Figure& figure, PictureFormat format, const Size& size) {
  switch (format) {
    case PictureFormat::kSvg:
      return svg_of(figure, size);
    case PictureFormat::kPng:
      return png_made_of(svg_of(figure, size));
    case PictureFormat::kCsv:
      return csv_of(figure);
    case PictureFormat::kGnuplot:
      return gnuplot_of(figure, size);
  }
  throw std::logic_error("a format that is none");
}

std::string picture_of(const Sheet& sheet, PictureFormat format, const Size& size) {
  switch (format) {
    case PictureFormat::kSvg:
      return svg_of(sheet, size);
    case PictureFormat::kPng:
      return png_made_of(svg_of(sheet, size));
    default:
      return picture_of(flattened(sheet), format, size);
  }
}

void write_picture(const std::string& picture, PictureFormat format, const std::string& file) {
  if (!file.empty()) {
    NewFile out(file);
    out.append(picture);
    out.finish();
    return;
  }
  if (format == PictureFormat::kPng && isatty(STDOUT_FILENO) == 1) {
    throw solver::InputError(
        "--format png is no text, and standard output is a terminal: write it to a file with --out "
        "FILE.png");
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
