#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/service/source.h"
#include "client/verbs/verbs.h"
#include "proto/text.h"
#include "server/database/database_file.h"
#include "server/database/sqlite.h"
#include "server/maintenance/merge.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kMergeExamples = R"(Examples:
  oblique merge lab.db cluster.db --db all.db
  oblique merge cluster.db --db lab.db --rename-prefix cluster-

Studies and results of the databases come into the one of --db, which is made when it is not there. A
study is the one of the same name and recipe: their points are united, and where both have a result
that of --db stays. One that grew in one of them is united with what it was. A database with a study
of a name that is taken by another recipe is refused as a whole, with what differs. What is merged is
only read, also while a server works on it; merged again it brings what is new since. No server may be
at work on the database of --db.)";

struct MergeFlags {
  std::vector<std::string> sources;
  DatabaseSettings target;
  std::string rename_prefix;
  bool allow_network_disk = false;
};

bool are_one_file(const std::string& one, const std::string& other) {
  std::error_code missing;
  return std::filesystem::equivalent(one, other, missing) && !missing;
}

/// The databases to be merged, each once.
std::vector<std::string> judged_sources(const MergeFlags& flags) {
  std::vector<std::string> sources;
  for (const std::string& source : flags.sources) {
    if (are_one_file(source, flags.target.file)) {
      throw solver::InputError(fmt::format(
          "{} is the database that the others are merged into: name it by --db alone", source));
    }
    bool is_known = false;
    for (const std::string& earlier : sources) {
      is_known = is_known || are_one_file(source, earlier);
    }
    if (is_known) {
      std::cerr << fmt::format("{} is named twice, and merged once.\n", source);
    } else {
      sources.push_back(source);
    }
  }
  server::path_on_own_disk(flags.target.file, flags.allow_network_disk);
  return sources;
}

void tell(const std::string& source, const std::string& target, const server::Merged& merged) {
  std::cerr << fmt::format("{}: {} {} new in {} and {} united with those there; {} {} added",
                           source, shown_count(merged.studies_added),
                           merged.studies_added == 1 ? "study" : "studies", target,
                           shown_count(merged.studies_united), shown_count(merged.results_added),
                           merged.results_added == 1 ? "result" : "results");
  if (merged.studies_grown > 0) {
    std::cerr << fmt::format("; studies that grew: {}", shown_count(merged.studies_grown));
  }
  if (merged.failures_replaced > 0) {
    std::cerr << fmt::format(", {} of them for points that had failed",
                             shown_count(merged.failures_replaced));
  }
  if (merged.results_known > 0) {
    std::cerr << fmt::format("; {} were there already", shown_count(merged.results_known));
  }
  if (merged.results_differing > 0) {
    std::cerr << fmt::format(", {} of these with other numbers: those of {} stay",
                             shown_count(merged.results_differing), target);
  }
  std::cerr << ".\n";
  for (const std::string& remark : merged.remarks) {
    std::cerr << "  " << protocol::visible(remark) << '\n';
  }
}

void merge_one(server::Merger& merger, const std::string& source, const MergeFlags& flags) {
  if (server::is_in_use(source)) {
    std::cerr << fmt::format(
        "A server is at work on {}: what it stores from now on comes when it is merged again.\n",
        source);
  }
  tell(source, flags.target.file, merger.merge(source, flags.rename_prefix));
}

int merge(const MergeFlags& flags) {
  const auto sources = judged_sources(flags);
  server::Merger merger(flags.target.file);
  for (const std::string& source : sources) {
    merge_one(merger, source, flags);
  }
  if (!merger.finish()) {
    std::cerr << fmt::format(
        "Another program reads {0}: until it ends a copy needs {0}-wal too; `oblique backup` makes "
        "one that is whole.\n",
        flags.target.file);
  }
  return kDone;
}

}  // namespace

void add_merge(CLI::App& app, Command& command) {
  auto flags = std::make_shared<MergeFlags>();
  auto* verb = app.add_subcommand("merge", "Bring studies and results of databases into one");
  verb->footer(kMergeExamples);
  verb->add_option("FILES", flags->sources, "the databases to be merged")
      ->required()
      ->type_name("");
  verb->add_option("--db", flags->target.file, "the database that they are merged into")
      ->type_name("FILE")
      ->capture_default_str();
  verb->add_option("--rename-prefix", flags->rename_prefix,
                   "goes before the names of studies whose names other recipes have")
      ->type_name("PREFIX");
  verb->add_flag("--allow-network-disk", flags->allow_network_disk,
                 "take a --db on a network file system, where a second machine could damage it");
  verb->callback([flags, &command] { command = [flags] { return merge(*flags); }; });
}

}  // namespace oblique::client
