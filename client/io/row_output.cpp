#include "client/io/row_output.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"

#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr std::array<std::string_view, 4> kFormatNames{"table", "csv", "json", "jsonl"};

}  // namespace

std::span<const std::string_view> format_names() {
  return kFormatNames;
}

Format format_named(std::string_view name, std::span<const std::string_view> allowed) {
  if (std::find(allowed.begin(), allowed.end(), name) == allowed.end()) {
    throw solver::InputError(fmt::format("--format {} is not allowed: it must be one of {}{}", name,
                                         protocol::joined(allowed),
                                         protocol::did_you_mean(name, allowed)));
  }
  return static_cast<Format>(std::find(kFormatNames.begin(), kFormatNames.end(), name) -
                             kFormatNames.begin());
}

Format format_of_output(const std::string& flag, const std::string& file,
                        std::span<const std::string_view> allowed, Format usual) {
  const std::string ending = std::filesystem::path(file).extension().string();
  const auto meant = std::string_view(ending).substr(ending.empty() ? 0 : 1);
  const bool is_known =
      meant != "table" && std::find(allowed.begin(), allowed.end(), meant) != allowed.end();
  if (!flag.empty()) {
    const Format format = format_named(flag, allowed);
    if (is_known && flag != meant) {
      throw solver::InputError(fmt::format(
          "--format {} and --out {} contradict each other: a name that ends so is for {}; leave "
          "the flag out, or give the file another ending",
          flag, file, meant));
    }
    return format;
  }
  if (is_known) {
    return format_named(meant);
  }
  if (file.empty() || is_written_in_place(file)) {
    return usual;
  }
  throw solver::InputError(
      fmt::format("--out {} does not say in which format: end its name in .csv or .json{}, or "
                  "give --format",
                  file, allowed.size() > 2 ? ", or .jsonl" : ""));
}

std::string text_of(const std::vector<protocol::QueryReply>& chunks,
                    const OutputSettings& settings) {
  std::string text;
  const auto printer = make_printer(settings);
  for (const auto& chunk : chunks) {
    printer->print(chunk, text);
  }
  printer->end(text);
  return text;
}

RowOutput::RowOutput(OutputSettings settings) {
  if (settings.file.empty()) {
    const TerminalSize terminal = terminal_size(STDOUT_FILENO);
    if (terminal.lines > 0) {
      settings.width = terminal.columns;
      settings.first_rows = terminal.lines;
    }
    sink_ =
        std::make_unique<StandardOutput>(settings.may_page && settings.format == Format::kTable);
  } else {
    sink_ = std::make_unique<AtomicFile>(settings.file);
  }
  printer_ = make_printer(settings);
}

void RowOutput::print(const protocol::QueryReply& chunk) {
  std::string text;
  printer_->print(chunk, text);
  sink_->append(text);
}

void RowOutput::finish() {
  std::string text;
  printer_->end(text);
  sink_->append(text);
  sink_->finish();
}

bool RowOutput::is_paged() const {
  const auto* output = dynamic_cast<const StandardOutput*>(sink_.get());
  return output != nullptr && output->is_paged();
}

}  // namespace oblique::client
