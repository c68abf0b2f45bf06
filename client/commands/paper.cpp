#include <filesystem>
#include <ostream>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/io/progress.h"
#include "client/io/row_output.h"
#include "client/paper/paper_comparison.h"
#include "client/paper/paper_figures.h"
#include "client/plot/picture_file.h"
#include "client/service/source.h"
#include "client/service/watching.h"
#include "client/trace/solve_again.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

constexpr const char* kPaperExamples = R"(Examples:
  oblique paper
  oblique paper --preset converged --modes  shows which modes are due to the paper's mesh
  oblique paper --preset printed
  oblique paper --db oblique.db --study paper
  oblique paper --format csv > differences.csv
  oblique paper --figures figures           Figs. 3 to 7 as SVG files in that folder)";

struct PaperFlags {
  std::string preset{"paper"};
  std::string study{"paper"};
  std::string database;  // if empty, the cases are solved now
  std::string format{"table"};
  bool modes = false;
  std::string figures;  // folder; if empty, tables are printed
};

protocol::Table rows_of_study(Source& source, const std::string& study) {
  study_named(source, study);
  return source.query(
      "SELECT point, H, mu, e, peaks, phases, stick_total_s, major_mode FROM runs WHERE study = " +
      server::sql_text(study) + " AND status = 'solved'");
}

OwnCases cases_of(Console& console, const PublishedTable& published, const PaperFlags& flags) {
  if (!flags.database.empty()) {
    return own_cases(published, rows_of_study(*open_database(flags.database), flags.study));
  }
  const auto model = solver::preset(flags.preset);
  console.notes() << fmt::format("{} impacts of the preset {}, {} elements a link\n",
                                 published.cases.size(), flags.preset, model.elements_per_link);
  const solver::Finger finger(model);
  StatusLine line(console);
  static_cast<void>(largest_drop_m(finger, line));
  const auto touching = line.begin(fmt::format("{} contacts", published.cases.size()));
  return solved_cases(published, {&finger, 1}).front();
}

/// Draws the figures into the folder, which is created if necessary.
int draw_figures(const PaperFlags& flags, Console& console) {
  std::error_code failed;
  std::filesystem::create_directories(flags.figures, failed);
  if (failed) {
    throw solver::InputError(fmt::format("--figures {}: this folder cannot be created: {}",
                                         flags.figures, failed.message()));
  }
  const auto published = published_table();
  const solver::Finger finger(solver::preset(flags.preset));
  StatusLine line(console);
  static_cast<void>(largest_drop_m(finger, line));
  PaperGroups groups;
  {
    const auto touching = line.begin(fmt::format("{} contacts", published.cases.size()));
    groups = solved_groups(published, finger);
  }
  for (const auto& [name, figure] : paper_figures(groups)) {
    const auto file = (std::filesystem::path(flags.figures) / (name + ".svg")).string();
    plot::write_picture(plot::picture_of(figure, plot::PictureFormat::kSvg),
                        plot::PictureFormat::kSvg, file);
    console.notes() << fmt::format("{}: {}\n", file, figure.title);
  }
  return kDone;
}

int paper(const PaperFlags& flags, Console& console) {
  if (!flags.figures.empty()) {
    return draw_figures(flags, console);
  }
  const auto format = format_named(flags.format);
  const auto published = published_table();
  const auto own = cases_of(console, published, flags);
  if (format == Format::kTable && flags.modes) {
    print_modes(console.out(), published, own);
  } else if (format == Format::kTable) {
    print_comparison(console.out(), published, own);
  } else {
    print_out(rows_of(published, compare(published, own)), format);
  }
  return kDone;
}

}  // namespace

void add_paper(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "paper", "Compare the paper's tables and figures with our results",
                  kPaperExamples, paper);
  auto* preset = command
                     .add_option("--preset", flags.preset,
                                 "model: " + protocol::joined(solver::preset_names()))
                     ->type_name("NAME")
                     ->capture_default_str();
  protocol::note_choices(preset, solver::preset_names());
  auto* database =
      command
          .add_option("--db", flags.database, "compare results of this database instead of solving")
          ->type_name("FILE")
          ->excludes(preset);
  command.add_option("--study", flags.study, "name of the study in that database")
      ->type_name("NAME")
      ->needs(database)
      ->capture_default_str();
  auto* modes = command.add_flag("--modes", flags.modes, "print only peaks and modes (in tables)");
  add_format_flag(command, flags.format);
  command
      .add_option(
          "--figures", flags.figures,
          "draw the paper's Figs. 3 to 7 as SVG files in this folder instead of printing tables")
      ->type_name("DIR")
      ->excludes(database)
      ->excludes(modes)
      ->excludes(command.get_option("--format"));
}

}  // namespace oblique::client
