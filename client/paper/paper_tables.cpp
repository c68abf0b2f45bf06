// The comparison as people read it; what is compared stands in paper_comparison.cpp.
#include <algorithm>
#include <array>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/output/printer.h"
#include "client/paper/paper_comparison.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::exact_number;
using solver::fixed_number;
using solver::signed_number;
using Own = std::vector<std::optional<OwnCase>>;

void add_header(protocol::Table& table, const std::vector<std::string>& columns) {
  for (const auto& column : columns) {
    table.columns.emplace_back(column);
  }
}

void add_case(protocol::Row& row, const PublishedCase& published) {
  add_value(row, published.H_m);
  add_value(row, published.mu);
  add_value(row, published.e_star);
}

// "5.058 / 5.07 / -0.24", or what there is of it.
std::string beside(const std::vector<Difference>& differences, std::size_t case_index,
                   Quantity quantity, std::size_t index, int decimals) {
  const auto found =
      std::find_if(differences.begin(), differences.end(), [&](const Difference& difference) {
        return difference.case_index == case_index && difference.quantity == quantity &&
               difference.index == index;
      });
  if (found == differences.end()) {
    return {};
  }
  const auto published = fixed_number(found->published, decimals);
  if (!found->ours) {
    return fmt::format("- / {}", published);
  }
  return fmt::format("{} / {} / {}", fixed_number(*found->ours, decimals + 1), published,
                     signed_number(*found->percent(), 2));
}

void print_forces(std::ostream& out, const PublishedTable& published,
                  const std::vector<Difference>& differences) {
  constexpr std::array<const char*, 3> kPeaks{"1st", "2nd", "3rd"};
  out << "Peaks of the contact forces (Tab. 2): ours / published [kN] / difference [%]\n\n";
  protocol::Table table;
  add_header(table, {"H", "mu", "e*", "force", kPeaks[0], kPeaks[1], kPeaks[2]});
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    if (published.cases[i].fn_kN.empty()) {
      continue;
    }
    for (const auto& [quantity, name] :
         {std::pair(Quantity::kFn, "F_n"), std::pair(Quantity::kFt, "F_t")}) {
      auto& row = table.rows.emplace_back();
      add_case(row, published.cases[i]);
      add_value(row, std::string(name));
      for (std::size_t peak = 0; peak < kPeaks.size(); ++peak) {
        add_value(row, beside(differences, i, quantity, peak, 2));
      }
    }
  }
  print(out, table, Format::kTable);
}

void print_durations(std::ostream& out, const PublishedTable& published,
                     const std::vector<Difference>& differences) {
  out << "\nDurations of compression and restitution (section 4.2): ours / published [ms] / "
         "difference [%]\n\n";
  protocol::Table table;
  add_header(table, {"H", "mu", "e*", "phase", "ours / published / difference"});
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    for (std::size_t phase = 0; phase < published.cases[i].phases_ms.size(); ++phase) {
      auto& row = table.rows.emplace_back();
      add_case(row, published.cases[i]);
      add_value(
          row, fmt::format("{} {}", phase / 2 + 1, phase % 2 == 0 ? "compression" : "restitution"));
      add_value(row, beside(differences, i, Quantity::kPhase, phase, 3));
    }
  }
  print(out, table, Format::kTable);
}

void print_sticks(std::ostream& out, const PublishedTable& published,
                  const std::vector<Difference>& differences) {
  out << "\nTime in stick (section 4.3): ours / published [ms] / difference [%]\n\n";
  protocol::Table table;
  add_header(table, {"H", "mu", "e*", "ours / published / difference"});
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    if (published.cases[i].stick_ms) {
      auto& row = table.rows.emplace_back();
      add_case(row, published.cases[i]);
      add_value(row, beside(differences, i, Quantity::kStick, 0, 3));
    }
  }
  print(out, table, Format::kTable);
}

std::string place_of(const PublishedCase& in) {
  return fmt::format("H = {}, mu = {}, e* = {}", exact_number(in.H_m), exact_number(in.mu),
                     exact_number(in.e_star));
}

// Says plainly which published modes are not ours.
void print_other_modes(std::ostream& out, const PublishedTable& published, const Own& own) {
  std::string others;
  std::size_t solved = 0;
  std::size_t same = 0;
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    const auto& in = published.cases[i];
    if (!own[i]) {
      continue;
    }
    ++solved;
    if (own[i]->major_mode == in.mode) {
      ++same;
      continue;
    }
    others += fmt::format("- {}: {} ({} peaks), published {} ({})\n", place_of(in),
                          own[i]->major_mode, own[i]->fn_N.size(), in.mode, published_peaks(in));
  }
  if (solved == 0) {
    return;
  }
  out << fmt::format("\nThe mode is the published one in {} of {} cases solved", same, solved);
  out << (others.empty() ? ".\n" : ". It is another one, with other peaks, at\n\n" + others);
}

void print_modes_table(std::ostream& out, const PublishedTable& published, const Own& own) {
  out << "Peaks and modes, ripples merged (Figs. 4 to 6)\n\n";
  protocol::Table table;
  add_header(table, {"H", "mu", "e*", "peaks", "published", "mode", "published mode"});
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    auto& row = table.rows.emplace_back();
    add_case(row, published.cases[i]);
    if (own[i]) {
      add_value(row, static_cast<std::int64_t>(own[i]->fn_N.size()));
    } else {
      row.emplace_back();
    }
    add_value(row, std::int64_t{published_peaks(published.cases[i])});
    add_value(row, own[i] ? own[i]->major_mode : std::string("not solved"));
    add_value(row, own[i] && own[i]->major_mode == published.cases[i].mode
                       ? std::string("the same")
                       : published.cases[i].mode);
  }
  print(out, table, Format::kTable);
}

std::string place_of(const PublishedTable& published, const Difference& difference) {
  const auto& in = published.cases[difference.case_index];
  std::string what;
  switch (difference.quantity) {
    case Quantity::kFn:
      what = fmt::format("peak {} of F_n", difference.index + 1);
      break;
    case Quantity::kFt:
      what = fmt::format("peak {} of F_t", difference.index + 1);
      break;
    case Quantity::kPhase:
      what = fmt::format("{} {}", difference.index % 2 == 0 ? "compression" : "restitution",
                         difference.index / 2 + 1);
      break;
    case Quantity::kStick:
      what = "time in stick";
      break;
  }
  return what + " at " + place_of(in);
}

void print_differences_summary(std::ostream& out, const PublishedTable& published,
                               const std::vector<Difference>& differences) {
  const auto summary = summary_of(differences);
  out << fmt::format("\n{} trustworthy published numbers", differences.size());
  if (summary.missing > 0) {
    out << fmt::format(", {} of them without ours", summary.missing);
  }
  if (summary.largest) {
    out << fmt::format(
        ": rms difference {} %, largest {} % ({})", fixed_number(summary.rms_percent, 2),
        fixed_number(summary.largest_percent, 2), place_of(published, *summary.largest));
  }
  out << "\n";
}

void print_misprints(std::ostream& out, const PublishedTable& published) {
  out << "\nNot counted, for they are misprinted:\n\n";
  for (const auto& misprint : published.misprints) {
    out << "- " << misprint.where << ": ";
    for (std::size_t i = 0; i < misprint.printed.size(); ++i) {
      out << (i > 0 ? "; " : "") << misprint.printed[i];
    }
    out << "\n    " << misprint.why << "\n";
  }
}

}  // namespace

void print_modes(std::ostream& out, const PublishedTable& table, const Own& own) {
  print_modes_table(out, table, own);
  print_other_modes(out, table, own);
}

void print_comparison(std::ostream& out, const PublishedTable& table, const Own& own) {
  const auto differences = compare(table, own);
  print_forces(out, table, differences);
  print_durations(out, table, differences);
  print_sticks(out, table, differences);
  out << '\n';
  print_modes(out, table, own);
  print_differences_summary(out, table, differences);
  print_misprints(out, table);
}

}  // namespace oblique::client
