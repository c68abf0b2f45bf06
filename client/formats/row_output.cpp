#include "client/formats/row_output.h"

#include <unistd.h>

#include <utility>

#include "client/formats/new_file.h"
#include "client/formats/pager.h"
#include "client/io/console.h"

namespace oblique::client {
namespace {

std::unique_ptr<Sink> sink_for(const OutputSettings& settings, const TerminalSize& terminal) {
  if (!settings.file.empty()) {
    return std::make_unique<NewFile>(settings.file);
  }
  if (terminal.lines == 0) {
    return std::make_unique<StandardOutput>();
  }
  if (settings.may_page && settings.format == Format::kTable) {
    return std::make_unique<PagedOutput>(terminal.lines - 1, pager_command());
  }
  return std::make_unique<StandardOutput>();
}

PrinterSettings printer_settings(const OutputSettings& settings, const TerminalSize& terminal) {
  PrinterSettings of_printer;
  of_printer.shown = settings.shown;
  of_printer.way_to_all = settings.way_to_all;
  if (settings.file.empty() && terminal.lines > 0) {
    of_printer.width = terminal.columns;
    of_printer.keeps_all = !settings.may_leave_out;
    of_printer.first_rows = terminal.lines;
  }
  return of_printer;
}

}  // namespace

RowOutput::RowOutput(OutputSettings settings) {
  const TerminalSize terminal = terminal_size(STDOUT_FILENO);
  sink_ = sink_for(settings, terminal);
  printer_ = made_printer(settings.format, *sink_, printer_settings(settings, terminal));
}

RowOutput::~RowOutput() = default;

void RowOutput::print(const protocol::QueryReply& chunk) {
  printer_->print(chunk);
}

void RowOutput::finish() {
  printer_->end();
  sink_->finish();
}

bool RowOutput::is_paged() const {
  const auto* paged = dynamic_cast<const PagedOutput*>(sink_.get());
  return paged != nullptr && paged->is_paged();
}

}  // namespace oblique::client
