#include "client/formats/table_printer.h"

#include <algorithm>
#include <numeric>
#include <sstream>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/formats/cell_text.h"
#include "proto/text.h"
#include "proto/wire/chunk.h"

namespace oblique::client {
namespace {

using protocol::Cell;
using protocol::CellKind;

constexpr std::size_t kGap = 2;     // between columns
constexpr const char* kMore = "…";  // ends a heading that lacks columns
/// Texts are not shortened below that.
constexpr std::size_t kShortestText = 12;
/// Nor are sentences wrapped into less.
constexpr std::size_t kNarrowestSentence = 16;

ShownColumn shown_as(const std::vector<ShownColumn>& shown, const protocol::QueryReply& chunk,
                     int column) {
  const auto place = static_cast<std::size_t>(column);
  return place < shown.size() ? shown[place] : ShownColumn{chunk.columns(column)};
}

std::string cell_in_unit(const Cell& cell, double per_unit) {
  Cell shown = cell;
  shown.real *= per_unit;
  return table_cell(shown);
}

/// Characters before the point of a number, all when it has none.
std::size_t before_point(std::string_view number) {
  return std::min(number.find('.'), number.size());
}

/// The first `width` characters, the last one being an ellipsis when there are more.
std::string shortened_to(const std::string& text, std::size_t width) {
  if (width_of(text) <= width) {
    return text;
  }
  std::size_t bytes = 0;
  for (std::size_t i = 0; i + 1 < width; ++i) {
    bytes += std::max<std::size_t>(
        protocol::first_character(std::string_view(text).substr(bytes)).bytes, 1);
  }
  return text.substr(0, bytes) + "…";
}

/// The words of a text in lines of at most `width` characters, where they are not longer.
std::vector<std::string> wrapped(const std::string& text, std::size_t width) {
  std::vector<std::string> lines(1);
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    std::string& line = lines.back();
    if (!line.empty() && width_of(line) + 1 + width_of(word) > width) {
      lines.push_back(word);
    } else {
      line += (line.empty() ? "" : " ") + word;
    }
  }
  return lines;
}

/// Words with commas between them, in lines of at most `width` characters where they can be.
std::string in_lines(const std::vector<std::string>& words, std::size_t begun, std::size_t width) {
  std::string text;
  std::size_t at = begun;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string word = words[i] + (i + 1 < words.size() ? "," : "\n");
    const bool fits = at + 1 + width_of(word) <= width;
    text += (fits ? " " : "\n") + word;
    at = (fits ? at + 1 : 0) + width_of(word);
  }
  return text;
}

}  // namespace

void TablePrinter::begin(const protocol::QueryReply& chunk) {
  for (int i = 0; i < chunk.columns_size(); ++i) {
    const ShownColumn shown = shown_as(settings_.shown, chunk, i);
    Column column;
    column.heading = protocol::visible(shown.heading);
    column.per_unit = shown.per_unit;
    column.width = width_of(column.heading);
    columns_.push_back(std::move(column));
  }
  has_begun_ = true;
}

void TablePrinter::print(const protocol::QueryReply& chunk) {
  if (!has_begun_) {
    begin(chunk);
  }
  protocol::ChunkRows rows(chunk);
  while (rows.next()) {
    Line line(rows.columns());
    for (std::size_t i = 0; i < line.size(); ++i) {
      const Cell& cell = rows.cell(i);
      line[i] = {cell_in_unit(cell, columns_[i].per_unit),
                 cell.kind == CellKind::kInteger || cell.kind == CellKind::kReal};
    }
    if (has_head_) {
      print_line(line);
      continue;
    }
    widen(line);
    first_.push_back(std::move(line));
    if (first_.size() >= settings_.first_rows) {
      print_first_rows();
    }
  }
}

void TablePrinter::widen(const Line& line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    Column& column = columns_[i];
    const auto& [text, is_number] = line[i];
    if (is_number) {
      const std::size_t before = before_point(text);
      column.has_numbers = true;
      column.before_point = std::max(column.before_point, before);
      column.after_point = std::max(column.after_point, text.size() - before);
      column.width = std::max(column.width, column.before_point + column.after_point);
    } else {
      column.width = std::max(column.width, width_of(text));
    }
  }
}

std::size_t TablePrinter::line_width() const {
  const std::size_t all = std::accumulate(
      columns_.begin(), columns_.end(), std::size_t{0}, [](std::size_t sum, const Column& column) {
        return sum + (column.is_left_out ? 0 : column.width + kGap);
      });
  const bool has_all = std::none_of(columns_.begin(), columns_.end(),
                                    [](const Column& column) { return column.is_left_out; });
  return all - std::min(all, kGap) + (has_all ? 0 : kGap + width_of(kMore));
}

bool TablePrinter::wraps(const Column& column) const {
  return settings_.keeps_all && settings_.width > 0 && !column.has_numbers &&
         &column == &columns_.back();
}

/// Makes lines fit: sentences in the last column are wrapped where all columns are kept, then the
/// widest text is shortened, and at least one column stays.
void TablePrinter::fit() {
  while (settings_.width > 0 && line_width() > settings_.width) {
    if (Column& end = columns_.back(); wraps(end) && end.width > kNarrowestSentence) {
      end.width -= std::min(end.width - kNarrowestSentence, line_width() - settings_.width);
      continue;
    }
    Column* widest = nullptr;
    for (Column& column : columns_) {
      const std::size_t least = std::max(kShortestText, width_of(column.heading));
      if (!column.has_numbers && !column.is_left_out && !wraps(column) && column.width > least &&
          (widest == nullptr || column.width > widest->width)) {
        widest = &column;
      }
    }
    if (widest != nullptr) {
      const std::size_t least = std::max(kShortestText, width_of(widest->heading));
      widest->width -= std::min(widest->width - least, line_width() - settings_.width);
      continue;
    }
    const auto last = std::find_if(columns_.rbegin(), columns_.rend(),
                                   [](const Column& column) { return !column.is_left_out; });
    if (settings_.keeps_all || last + 1 == columns_.rend()) {
      return;
    }
    last->is_left_out = true;
  }
}

void TablePrinter::print_cells(const std::vector<std::string>& cells, const std::string& end) {
  std::string& out = sink_.held();
  const std::size_t begin = out.size();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Column& column = columns_[i];
    if (column.is_left_out) {
      continue;
    }
    const std::size_t padding = column.width - std::min(column.width, width_of(cells[i]));
    out.append(i > 0 ? kGap : 0, ' ');
    out.append(column.has_numbers ? padding : 0, ' ');
    out += cells[i];
    out.append(column.has_numbers ? 0 : padding, ' ');
  }
  out += end;
  while (out.size() > begin && out.back() == ' ') {
    out.pop_back();
  }
  out += '\n';
  sink_.flush_if_long();
}

void TablePrinter::print_line(const Line& line) {
  std::vector<std::string> cells;
  std::vector<std::string> more;  // lines of the last one
  for (std::size_t i = 0; i < line.size(); ++i) {
    const auto& [text, is_number] = line[i];
    const Column& column = columns_[i];
    if (is_number) {
      const std::size_t after = text.size() - before_point(text);
      cells.push_back(text +
                      std::string(column.after_point - std::min(column.after_point, after), ' '));
    } else if (wraps(column)) {
      more = wrapped(text, column.width);
      cells.push_back(more.front());
    } else {
      cells.push_back(settings_.width > 0 && !column.is_left_out ? shortened_to(text, column.width)
                                                                 : text);
    }
  }
  print_cells(cells);
  for (std::size_t i = 1; i < more.size(); ++i) {
    std::vector<std::string> rest(cells.size());
    rest.back() = more[i];
    print_cells(rest);
  }
}

void TablePrinter::print_head() {
  std::vector<std::string> headings;
  std::vector<std::string> rule;
  for (const Column& column : columns_) {
    headings.push_back(column.heading);
    rule.emplace_back(column.width, '-');
  }
  const bool has_all = std::none_of(columns_.begin(), columns_.end(),
                                    [](const Column& column) { return column.is_left_out; });
  print_cells(headings, has_all ? "" : std::string(kGap, ' ') + kMore);
  print_cells(rule);
  has_head_ = true;
}

void TablePrinter::print_first_rows() {
  fit();
  print_head();
  for (const Line& line : std::exchange(first_, {})) {
    print_line(line);
  }
}

void TablePrinter::end() {
  if (!has_begun_) {
    return;
  }
  if (!has_head_) {
    print_first_rows();
  }
  std::vector<std::string> left_out;
  bool has_mode = false;
  for (const Column& column : columns_) {
    if (column.is_left_out) {
      left_out.push_back(column.heading);
    } else {
      has_mode = has_mode || column.heading == "mode" || column.heading == "major_mode";
    }
  }
  if (has_mode) {
    sink_.append(fmt::format("({})\n", kModeLetters));
  }
  if (!left_out.empty()) {
    const std::string beginning =
        fmt::format("Left out, for a width of {} ({}):", settings_.width, settings_.way_to_all);
    sink_.append(beginning + in_lines(left_out, width_of(beginning), settings_.width));
  }
}

}  // namespace oblique::client
