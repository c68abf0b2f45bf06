#include "client/plot/picture_file.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/child_process.h"
#include "client/io/console.h"
#include "client/io/row_output.h"
#include "proto/text.h"
#include "proto/wire/chunk.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

/// Names and file endings of the formats, in the order of PictureFormat.
constexpr std::array<std::string_view, 5> kFormats{"svg", "pdf", "png", "gp", "csv"};
constexpr double kSmallestSide = 240.0;
constexpr double kLargestSide = 10'000.0;
constexpr std::size_t kMaxBytes = std::size_t{256} << 20U;
constexpr std::chrono::seconds kTimeLimit{120};  // a map of 10^5 cells takes about 2 s

/// NaN becomes NULL, which is an empty field in CSV.
protocol::Value value_of(double number) {
  return std::isnan(number) ? protocol::Value() : protocol::Value(number);
}

protocol::Table cells_table(const Panel& panel, const Cells& cells) {
  // Names in the order of CellState.
  constexpr std::array<const char*, 6> kStates{"solved", "no result", "filtered",
                                               "failed", "no value",  "no point"};
  protocol::Table table{.columns = {panel.x.name, panel.y.name, cells.name, "state"}};
  for (std::size_t i = 0; i < cells.values.size(); ++i) {
    protocol::Value value;
    if (cells.states[i] == CellState::kSolved) {
      value = cells.names.empty() ? value_of(cells.values[i]) : protocol::Value(cells.names[i]);
    }
    table.rows.push_back({cells.x.values[i % cells.columns()], cells.y.values[i / cells.columns()],
                          std::move(value), kStates[static_cast<std::size_t>(cells.states[i])]});
  }
  return table;
}

protocol::Table bars_table(const Panel& panel, const Bars& bars) {
  protocol::Table table;
  if (bars.names.empty()) {
    table.columns = {panel.x.name + "_from", panel.x.name + "_to", "points"};
  } else {
    table.columns = {panel.y.name, panel.x.name};
    if (!bars.intervals.empty()) {
      table.columns.insert(table.columns.end(), {panel.x.name + "_from", panel.x.name + "_to"});
    }
  }
  for (std::size_t i = 0; i < bars.heights.size(); ++i) {
    auto& row = table.rows.emplace_back();
    if (bars.names.empty()) {
      row.assign({bars.edges[i], bars.edges[i + 1]});
    } else {
      row.emplace_back(bars.names[i]);
    }
    row.emplace_back(bars.heights[i]);
    if (!bars.intervals.empty()) {
      row.push_back(value_of(bars.intervals[i].from));
      row.push_back(value_of(bars.intervals[i].to));
    }
  }
  return table;
}

protocol::Table curves_table(const Panel& panel, const Figure& figure) {
  const bool has_names = panel.curves.size() > 1 || !panel.by_name.empty();
  protocol::Table table{.columns = {panel.x.name, panel.y.name}};
  if (has_names) {
    table.columns.insert(table.columns.begin(), panel.by_name.empty() ? "line" : panel.by_name);
  } else if (figure.colours) {
    table.columns.push_back(figure.colours->name);
  }
  for (const Curve& curve : panel.curves) {
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      auto& row = table.rows.emplace_back();
      if (has_names) {
        row.push_back(curve.by ? protocol::Value(*curve.by) : protocol::Value(curve.name));
      }
      row.push_back(value_of(curve.x[i]));
      row.push_back(value_of(curve.y[i]));
      if (!has_names && figure.colours) {
        row.push_back(value_of(curve.colours[i]));
      }
    }
  }
  return table;
}

}  // namespace

std::vector<std::string_view> picture_format_names() {
  return {kFormats.begin(), kFormats.end()};
}

PictureFormat picture_format(const std::string& name, const std::string& file) {
  const std::string ending = std::filesystem::path(file).extension().string();
  if (name.empty() && !file.empty() &&
      std::find(kFormats.begin(), kFormats.end(), ending.substr(ending.empty() ? 0 : 1)) ==
          kFormats.end()) {
    throw solver::InputError(
        fmt::format("--out {}: the ending is not a format: use .svg, .pdf, .png, .gp or .csv, or "
                    "--format with one of {}",
                    file, protocol::joined(kFormats)));
  }
  return static_cast<PictureFormat>(choice_of("--format",
                                              !name.empty()   ? name
                                              : !file.empty() ? ending.substr(1)
                                                              : std::string(kFormats.front()),
                                              kFormats));
}

std::string output_of_gnuplot(const std::string& script) {
  try {
    // --default-settings ignores the user's ~/.gnuplot.
    ChildProcess gnuplot({.program = "gnuplot",
                          .arguments = {"--default-settings", "-"},
                          .keep_output = true,
                          .input = script,
                          .stays_in_our_group = true});
    const auto deadline = std::chrono::steady_clock::now() + kTimeLimit;
    while (gnuplot.is_running()) {
      if (std::chrono::steady_clock::now() > deadline) {
        throw std::runtime_error(
            fmt::format("gnuplot was stopped after {} s: draw fewer points", kTimeLimit.count()));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    // After some errors gnuplot returns 0, but its output is empty.
    std::string output = gnuplot.output(kMaxBytes);
    if (!gnuplot.succeeded() || output.empty()) {
      throw std::runtime_error(
          fmt::format("gnuplot {}: {}", gnuplot.ending(), gnuplot.last_output()));
    }
    return output;
  } catch (const ProgramNotFound&) {
    throw std::runtime_error(
        "gnuplot, which draws the pictures, is not installed: install it (Debian: gnuplot-nox), or "
        "write its script with --out FILE.gp");
  }
}

std::string picture_of(const Figure& figure, PictureFormat format,
                       const std::optional<Size>& size) {
  const Size in_pixels = size.value_or(own_size(figure));
  if (format == PictureFormat::kCsv) {
    return csv_of(figure);
  }
  return format == PictureFormat::kScript
             ? script_of(figure, PictureFormat::kSvg, in_pixels, "picture.svg")
             : output_of_gnuplot(script_of(figure, format, in_pixels));
}

std::string csv_of(const Figure& figure) {
  std::string out;
  for (const Panel& panel : figure.panels) {
    const auto table = panel.cells  ? cells_table(panel, *panel.cells)
                       : panel.bars ? bars_table(panel, *panel.bars)
                                    : curves_table(panel, figure);
    out += out.empty() ? "" : "\n";
    out += client::text_of({protocol::chunk_of(table)}, {.format = Format::kCsv});
  }
  return out;
}

std::string text_of(const Figure& figure) {
  const TerminalSize terminal = terminal_size(STDOUT_FILENO);
  const bool is_terminal = terminal.lines > 0;
  const bool has_colours = may_colour(STDOUT_FILENO);
  const std::size_t columns = is_terminal ? std::clamp<std::size_t>(terminal.columns, 40, 200) : 80;
  std::size_t lines = is_terminal ? std::clamp<std::size_t>(terminal.lines - 1, 20, 60) : 30;
  if (figure.panels.size() > 1) {
    lines = 20 * figure.panels.size();
  } else if (!figure.panels.empty() && figure.panels.front().cells) {
    lines += figure.panels.front().cells->categories.size();  // the legend has a line per category
  }
  Figure below = figure;
  below.columns = 1;
  const std::string drawn =
      output_of_gnuplot(script_for_terminal(below, columns, lines, has_colours));
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
    AtomicFile out(file);
    out.append(picture);
    out.finish();
    return;
  }
  const bool is_binary = format == PictureFormat::kPng || format == PictureFormat::kPdf;
  if (is_binary && isatty(STDOUT_FILENO) == 1) {
    throw solver::InputError(
        "PNG and PDF cannot be shown on a terminal: write to a file with --out FILE.png or "
        "FILE.pdf");
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
