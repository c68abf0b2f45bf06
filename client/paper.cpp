#include <cstdlib>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>

#include "client/nearest.h"
#include "client/paper_comparison.h"
#include "client/printer.h"
#include "client/run_service.h"
#include "client/verbs.h"
#include "client/watching.h"
#include "worker/solver/parameters.h"

namespace oblique::client {
namespace {

constexpr const char* kExamples = R"(Examples:
  oblique paper
  oblique paper --preset printed
  oblique paper --db oblique.db --study paper
  oblique paper --format csv > differences.csv)";

struct PaperFlags {
  std::string preset{"paper"};
  std::string study{"paper"};
  std::string database;  // empty: solve the cases now
  std::string format{"table"};
  RunSettings run;
};

// A folder that goes with this object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    auto path = (std::filesystem::temp_directory_path() / "oblique-paper-XXXXXX").string();
    if (mkdtemp(path.data()) == nullptr) {
      throw std::runtime_error("cannot make a folder in " +
                               std::filesystem::temp_directory_path().string() + ": " +
                               std::strerror(errno));
    }
    path_ = path;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

protocol::QueryReply rows_of_study(Source& source, const std::string& study) {
  the_study(source, study);
  return source.query(
      "SELECT point, H, mu, e, peaks, phases, stick_total_s, major_mode FROM runs WHERE study = " +
      sql_text(study) + " AND status = 'solved'");
}

// Solves the cases on a database of their own; nothing when stopped.
std::optional<protocol::QueryReply> solved_now(const PublishedTable& published,
                                               const PaperFlags& flags) {
  const TemporaryFolder folder;
  RunSettings settings = flags.run;
  settings.service.database = folder.path() / "paper.db";
  const Study study{.name = flags.study, .recipe = recipe_of(published, flags.preset)};
  if (!run_study(study, settings)) {
    return std::nullopt;
  }
  return rows_of_study(*open_database(settings.service.database), study.name);
}

int paper(const PaperFlags& flags) {
  const auto format = format_named(flags.format);
  const auto published = published_table();
  const auto rows = flags.database.empty()
                        ? solved_now(published, flags)
                        : rows_of_study(*open_database(flags.database), flags.study);
  if (!rows) {
    return kFailed;
  }
  const auto own = own_cases(published, *rows);
  if (format == Format::kTable) {
    print_comparison(std::cout, published, own);
  } else {
    print(std::cout, rows_of(published, compare(published, own)), format);
  }
  return kDone;
}

}  // namespace

void add_paper(CLI::App& app, Command& command) {
  auto flags = std::make_shared<PaperFlags>();
  auto* verb = app.add_subcommand("paper", "Put the paper's tables beside ours, with differences");
  verb->footer(kExamples);
  auto* preset =
      verb->add_option("--preset", flags->preset, "model: " + joined(solver::preset_names()));
  preset->type_name("NAME")->capture_default_str();
  auto* database = verb->add_option("--db", flags->database,
                                    "compare results of this database instead of solving now");
  database->type_name("FILE")->excludes(preset);
  verb->add_option("--study", flags->study, "the study in that database")
      ->type_name("NAME")
      ->needs(database)
      ->capture_default_str();
  add_format_flag(*verb, flags->format);
  add_worker_flags(*verb, flags->run);
  verb->callback([flags, &command] { command = [flags] { return paper(*flags); }; });
}

}  // namespace oblique::client
