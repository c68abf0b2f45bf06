#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/output/printer.h"
#include "client/output/work_line.h"
#include "client/paper/paper_comparison.h"
#include "client/paper/paper_figures.h"
#include "client/plot/picture_file.h"
#include "client/service/source.h"
#include "client/service/watching.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/tip_reach.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

constexpr const char* kPaperExamples = R"(Examples:
  oblique paper
  oblique paper --preset converged --modes  where the paper's modes come of its mesh
  oblique paper --preset printed
  oblique paper --db oblique.db --study paper
  oblique paper --format csv > differences.csv
  oblique paper --figures figures           Figs. 3 to 7 as SVG files in that folder)";

struct PaperFlags {
  std::string preset{"paper"};
  std::string study{"paper"};
  std::string database;  // empty: solve the cases now
  std::string format{"table"};
  bool modes = false;
  std::string figures;  // folder; empty: tables
};

protocol::Table rows_of_study(Source& source, const std::string& study) {
  study_named(source, study);
  return source.query(
      "SELECT point, H, mu, e, peaks, phases, stick_total_s, major_mode FROM runs WHERE study = " +
      server::sql_text(study) + " AND status = 'solved'");
}

OwnCases cases_of(const PublishedTable& published, const PaperFlags& flags) {
  if (!flags.database.empty()) {
    return own_cases(published, rows_of_study(*open_database(flags.database), flags.study));
  }
  const auto model = solver::preset(flags.preset);
  std::cerr << fmt::format("{} impacts of the preset {}, {} elements a link\n",
                           published.cases.size(), flags.preset, model.elements_per_link);
  const solver::Finger finger(model);
  WorkLine line;
  static_cast<void>(largest_drop_m(finger, line));
  const auto touching = line.begin(fmt::format("{} contacts", published.cases.size()));
  return solved_cases(published, {&finger, 1}).front();
}

/// Writes the figures into the folder, which is made.
int draw_figures(const PaperFlags& flags) {
  std::error_code failed;
  std::filesystem::create_directories(flags.figures, failed);
  if (failed) {
    throw solver::InputError(fmt::format("--figures {}: this folder cannot be made: {}",
                                         flags.figures, failed.message()));
  }
  const auto published = published_table();
  const solver::Finger finger(solver::preset(flags.preset));
  WorkLine line;
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
    std::cerr << fmt::format("{}: {}\n", file, figure.title);
  }
  return kDone;
}

int paper(const PaperFlags& flags) {
  if (!flags.figures.empty()) {
    return draw_figures(flags);
  }
  const auto format = format_named(flags.format);
  const auto published = published_table();
  const auto own = cases_of(published, flags);
  if (format == Format::kTable && flags.modes) {
    print_modes(std::cout, published, own);
  } else if (format == Format::kTable) {
    print_comparison(std::cout, published, own);
  } else {
    print_out(rows_of(published, compare(published, own)), format);
  }
  return kDone;
}

}  // namespace

void add_paper(CLI::App& app, Command& command) {
  auto flags = std::make_shared<PaperFlags>();
  auto* verb = app.add_subcommand("paper", "Put the paper's tables beside ours, with differences");
  verb->footer(kPaperExamples);
  auto* preset = verb->add_option("--preset", flags->preset,
                                  "model: " + protocol::joined(solver::preset_names()));
  preset->type_name("NAME")->capture_default_str();
  protocol::note_choices(preset, solver::preset_names());
  auto* database = verb->add_option("--db", flags->database,
                                    "compare results of this database instead of solving now");
  database->type_name("FILE")->excludes(preset);
  verb->add_option("--study", flags->study, "the study in that database")
      ->type_name("NAME")
      ->needs(database)
      ->capture_default_str();
  auto* modes =
      verb->add_flag("--modes", flags->modes, "peaks and modes alone (in tables for people)");
  add_format_flag(*verb, flags->format);
  verb->add_option("--figures", flags->figures,
                   "draw the paper's figures 3 to 7 as SVG files in that folder, instead of tables")
      ->type_name("DIR")
      ->excludes(database)
      ->excludes(modes)
      ->excludes(verb->get_option("--format"));
  verb->callback([flags, &command] { command = [flags] { return paper(*flags); }; });
}

}  // namespace oblique::client
