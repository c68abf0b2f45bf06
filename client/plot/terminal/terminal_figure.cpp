#include "client/plot/terminal/terminal_figure.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <optional>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "client/formats/pager.h"
#include "client/output/human_units.h"
#include "client/output/terminal.h"
#include "client/plot/figures/legend.h"
#include "client/plot/terminal/terminal_marks.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

constexpr std::size_t kNarrow = 50;

std::string_view of_environment(const char* variable) {
  const char* value = std::getenv(variable);
  return value == nullptr ? "" : value;
}

bool knows_utf8() {
  for (const char* variable : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    std::string value(of_environment(variable));
    if (!value.empty()) {
      std::transform(value.begin(), value.end(), value.begin(),
                     [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
      return value.find("utf-8") != std::string::npos || value.find("utf8") != std::string::npos;
    }
  }
  return false;
}

/// What ASCII has instead.
std::string plain(std::string text) {
  constexpr std::pair<std::string_view, std::string_view> kInstead[] = {
      {"\u03bc", "mu"},  {"\u00b5", "u"},  {"\u03b7", "eta"},
      {"\u03c1", "rho"}, {"\u00b2", "^2"}, {"\u00d7", "x"}};
  for (const auto& [letter, instead] : kInstead) {
    for (auto at = text.find(letter); at != std::string::npos; at = text.find(letter)) {
      text.replace(at, letter.size(), instead);
    }
  }
  text.erase(
      std::remove_if(text.begin(), text.end(),
                     [](char letter) { return (static_cast<unsigned char>(letter) & 0x80U); }),
      text.end());
  return text;
}

/// Lays one panel out in characters.
class PanelText {
 public:
  PanelText(const Figure& figure, const Panel& panel, const TerminalLook& look, std::size_t lines)
      : figure_(figure), panel_(panel), look_(look), canvas_(look.columns, lines) {}

  std::string drawn() {
    const bool lists_names = panel_.bars && !panel_.bars->names.empty();
    const std::size_t lines = canvas_.lines() - 4;  // labels above and below, the axis, its numbers
    constexpr int kFewestTicks = 3;                 // of two hardly more than 0 is left
    const Ticks y_ticks =
        ticks_of(scaled(panel_.y), std::max(kFewestTicks, static_cast<int>(lines / 4)));
    std::size_t widest = 0;
    for (const Tick& tick : y_ticks.ticks) {
      widest = std::max(widest, tick.label.size());
    }
    for (std::size_t i = 0; lists_names && i < panel_.bars->names.size(); ++i) {
      widest = std::max(widest, characters_of(panel_.bars->names[i]).size());
    }
    widest = std::min(widest, look_.columns / 2);
    frame_ = {widest + 2, 1, look_.columns - widest - 3, lines};
    canvas_.write(frame_.left - 1, 0, shown(panel_.y.label + y_ticks.factor()));
    draw_panel_text(canvas_, figure_, panel_, frame_, look_);
    draw_left(lists_names ? Ticks() : y_ticks);
    for (std::size_t i = 0; lists_names && i < panel_.bars->names.size(); ++i) {
      auto name = shown(protocol::visible(panel_.bars->names[i]));
      const auto letters = characters_of(name);
      if (letters.size() > widest) {
        const std::string more = look_.is_plain ? ".." : "\u2026";
        name.clear();
        for (std::size_t letter = 0; letter + characters_of(more).size() < widest; ++letter) {
          name += letters[letter];
        }
        name += more;
      }
      canvas_.write_before(frame_.left - 1, frame_.top + i, name);
    }
    draw_below();
    return canvas_.text(look_.is_plain ? Shading::kNone : look_.shading);
  }

 private:
  std::string shown(const std::string& text) const { return look_.is_plain ? plain(text) : text; }

  static Scale scaled(const FigureAxis& axis) {
    return {axis.range.from * axis.per_unit, axis.range.to * axis.per_unit, axis.is_logarithmic};
  }

  void draw_left(const Ticks& ticks) {
    for (std::size_t line = 0; line < frame_.lines; ++line) {
      canvas_.put(frame_.left - 1, frame_.top + line, look_.is_plain ? "|" : "\u2502");
    }
    for (const Tick& tick : ticks.ticks) {
      const auto line = static_cast<std::size_t>(
          std::clamp((1.0 - tick.share) * static_cast<double>(frame_.lines), 0.0,
                     static_cast<double>(frame_.lines - 1)));
      if (!tick.label.empty()) {
        canvas_.write_before(frame_.left - 1, frame_.top + line, tick.label);
        canvas_.put(frame_.left - 1, frame_.top + line, look_.is_plain ? "+" : "\u2524");
      }
    }
  }

  void draw_below() {
    const std::size_t axis = frame_.top + frame_.lines;
    canvas_.put(frame_.left - 1, axis, look_.is_plain ? "+" : "\u2514");
    for (std::size_t column = 0; column < frame_.columns; ++column) {
      canvas_.put(frame_.left + column, axis, look_.is_plain ? "-" : "\u2500");
    }
    int wanted = std::max(2, static_cast<int>(frame_.columns / 12));
    const Ticks ticks = ticks_of(scaled(panel_.x), wanted);
    std::size_t free_from = 0;
    for (const Tick& tick : ticks.ticks) {
      const auto column = frame_.left + static_cast<std::size_t>(std::clamp(
                                            tick.share * static_cast<double>(frame_.columns), 0.0,
                                            static_cast<double>(frame_.columns - 1)));
      const std::size_t half = tick.label.size() / 2;
      if (tick.label.empty() || (free_from > 0 && column < free_from + half)) {
        continue;
      }
      canvas_.put(column, axis, look_.is_plain ? "+" : "\u252c");
      canvas_.write_around(column, axis + 1, tick.label);
      free_from = column + half + 2;
    }
    canvas_.write_around(frame_.left + frame_.columns / 2, axis + 2,
                         shown(panel_.x.label + ticks.factor()));
  }

  const Figure& figure_;
  const Panel& panel_;
  const TerminalLook& look_;
  TextCanvas canvas_;
  TextFrame frame_{};
};

/// A sign in its colour, and what it means.
struct SignedName {
  std::string sign;
  std::optional<Colour> ink;
  std::string name;

  std::size_t columns() const {
    return characters_of(sign).size() + 1 + characters_of(name).size();
  }
};

SignedName signed_name(const LegendEntry& entry, const TerminalLook& look) {
  using Sign = LegendEntry::Sign;
  const std::string block = "\u2588\u2588";
  const std::string name = look.is_plain ? plain(entry.name) : entry.name;
  switch (entry.sign) {
    case Sign::kCurve:
      return {look.is_plain ? std::string(2, stroke_sign(entry.number)) : "\u2501\u2501",
              stroke_on_terminal(entry.number), name};
    case Sign::kKind:
      return {look.is_plain ? letter_of(entry.number) + ' ' : block, plain_fill(entry.number),
              name};
    case Sign::kRest:
      return {look.is_plain ? ". " : block, kFillOfOthers.colour, name};
    case Sign::kNoResult:
      return {look.is_plain ? "? " : block, colour_of(0x6e6e6e), name};
    case Sign::kFiltered:
      return {look.is_plain ? "- " : block, kFilteredInk, name};
    case Sign::kFailed:
      return {look.is_plain ? "! " : block, colour_of(0xff0000), name};
    case Sign::kKnown:
      return {"P ", stroke_on_terminal(7), name};
    case Sign::kSpan:
      return {};
  }
  return {};
}

/// One entry a line, or as many as fit into one.
std::string legend_lines(const std::vector<LegendEntry>& entries, bool is_packed,
                         const TerminalLook& look) {
  constexpr std::size_t kBetween = 3;
  std::string text;
  TextCanvas line(look.columns, 1);
  std::size_t column = 0;
  const auto end_line = [&] {
    text += line.text(look.is_plain ? Shading::kNone : look.shading);
    line = TextCanvas(look.columns, 1);
    column = 0;
  };
  for (const LegendEntry& entry : entries) {
    if (entry.sign == LegendEntry::Sign::kSpan) {  // spans are not drawn in characters
      continue;
    }
    const SignedName next = signed_name(entry, look);
    if (column > 0 && (!is_packed || column + next.columns() > look.columns)) {
      end_line();
    }
    for (const auto& character : characters_of(next.sign)) {
      line.put(column++, 0, character, next.ink);
    }
    line.write(column + 1, 0, next.name);
    column += 1 + characters_of(next.name).size() + kBetween;
  }
  if (column > 0) {
    end_line();
  }
  return text;
}

/// What the panel's lines mean, below it where there are several panels.
std::string legend_of_panel(const Panel& panel, const TerminalLook& look) {
  Figure alone;
  alone.panels = {panel};
  return legend_lines(legend_of(alone), true, look);
}

/// The shades from the lowest value to the highest.
std::string colour_line(const Colours& colours, const TerminalLook& look) {
  const Scale scale(colours.axis.range.from, colours.axis.range.to, colours.axis.is_logarithmic);
  TextCanvas line(look.columns, 1);
  const auto number = [&](double value) {
    return solver::readable_number(value * colours.axis.per_unit, 4);
  };
  std::size_t column = 0;
  const auto write = [&](const std::string& text) {
    line.write(column, 0, text);
    column += characters_of(text).size();
  };
  write((colours.has_below ? "<= " : "") + number(scale.from()) + ' ');
  const std::size_t steps = look.is_plain ? 10 : 20;
  for (std::size_t i = 0; i < steps; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(steps);
    line.put(column++, 0, look.is_plain ? std::string(1, shade_sign(share)) : "\u2588",
             shade_of(colours, share));
  }
  write((colours.has_above ? " <= " : " ") + number(scale.to()) + "  " +
        (look.is_plain ? plain(colours.axis.label) : colours.axis.label));
  return line.text(look.is_plain ? Shading::kNone : look.shading);
}

/// The text in lines that are at most so long, broken at spaces.
std::string broken_at(const std::string& text, std::size_t columns) {
  std::string lines;
  std::size_t length = 0;
  for (const auto word : protocol::split(text, ' ')) {
    // Bytes that go on with a character take no room of their own.
    const auto letters = static_cast<std::size_t>(std::count_if(
        word.begin(), word.end(), [](char byte) { return (byte & '\xc0') != '\x80'; }));
    const bool is_first = length == 0;
    if (!is_first && length + 1 + letters > columns) {
      lines += '\n';
      length = 0;
    } else if (!is_first) {
      lines += ' ';
      ++length;
    }
    lines += word;
    length += letters;
  }
  return lines + '\n';
}

}  // namespace

TerminalLook look_of_standard_output() {
  const TerminalSize size = terminal_size();
  TerminalLook look;
  if (size.lines > 0) {
    look.columns = std::clamp<std::size_t>(size.columns, 24, 160);
    look.lines = std::clamp<std::size_t>(size.lines, 16, 50);
  }
  look.is_plain = !may_colour(STDOUT_FILENO) || size.columns < kNarrow || !knows_utf8();
  const auto colours = of_environment("COLORTERM");
  look.shading = colours == "truecolor" || colours == "24bit" ? Shading::kTrue : Shading::k256;
  return look;
}

std::string text_of(const Figure& figure, const TerminalLook& look) {
  std::string after;
  if (has_colour_scale(figure)) {
    after += colour_line(*figure.colours, look);
  }
  // Panels have colours in common, which mean something else in each.
  const bool is_legend_by_panel = figure.panels.size() > 1;
  if (!is_legend_by_panel) {
    after += legend_lines(legend_of(figure), false, look);
  }
  const auto note = [&look](const std::string& text) {
    return broken_at(protocol::visible(look.is_plain ? plain(text) : text), look.columns);
  };
  for (const auto& text : figure.notes) {
    after += note(text);
  }
  std::string text = note(figure.title) + note(figure.subtitle);
  const auto lines_in = [](const std::string& lines) {
    return static_cast<std::size_t>(std::count(lines.begin(), lines.end(), '\n'));
  };
  const std::size_t taken = lines_in(text) + lines_in(after) + 1;  // and what follows below
  const std::size_t panels = std::max<std::size_t>(1, figure.panels.size());
  for (const Panel& panel : figure.panels) {
    const std::size_t room = look.lines > taken ? (look.lines - taken) / panels : 0;
    std::size_t lines = std::max<std::size_t>(room, panels == 1 ? 16 : 12);
    if (panel.bars && !panel.bars->names.empty()) {
      lines = panel.bars->names.size() + 4;
    }
    text += PanelText(figure, panel, look, lines).drawn();
    text += is_legend_by_panel ? legend_of_panel(panel, look) : "";
  }
  return text + after;
}

}  // namespace oblique::client::plot
