#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

#include "client/io/console.h"
#include "client/service/connection.h"
#include "client/service/run_service.h"
#include "proto/oblique.pb.h"
#include "proto/program/process.h"
#include "proto/wire/chunk.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// Where the points of an exploration are solved and stored: at the server that --server or
/// OBLIQUE_SERVER names, unless --db is given; else here, by a server and workers on this machine.
struct ExploreFlags {
  SourceFlags source;  ///< --db, --server, --keys, --timeout
  RunSettings run;     ///< --workers, --fall-memory, --no-reuse
  std::string name;    ///< of the study; empty: `explored_name`
};

/// Adds --name, --db, --server, --keys, --timeout, --workers, --fall-memory and --no-reuse. `flags`
/// must live as long as `command`.
void add_explore_flags(CLI::App& command, ExploreFlags& flags);

/// --name, or else `verb` and the first eight digits of a digest of `settings`, so that the same
/// command continues its study. Throws solver::InputError for a name that no study can have.
std::string explored_name(const ExploreFlags& flags, std::string_view verb,
                          std::string_view settings);

/// Returns what `work` returns. When a signal stops it (Interrupted), prints that the same command
/// continues, and returns 128 plus the number of the signal.
int run_exploration(Console& console, const std::function<int(protocol::StopSignals& stop)>& work);

/// A study that grows round by round: each round appends a block, which must be a deterministic
/// function of the results before it. A stored block is not solved again, so a stopped exploration
/// is continued by the same calls.
class GrowingStudy {
 public:
  /// Connects to the server, or starts one here with workers, for as long as this object lives.
  /// Throws solver::InputError when the study of that name exists with another model or with
  /// estimated errors, std::runtime_error when the database is in use, and what EmbeddedService and
  /// Connection throw.
  GrowingStudy(Console& console, const ExploreFlags& flags, std::string name,
               const solver::ModelParameters& model, protocol::StopSignals& stop);
  ~GrowingStudy();

  /// Solves the points of `block`, unless they are stored. Returns a row per point, in their order,
  /// with the values of `columns`: SQL over the view `runs`, as "mode, fn_peak_N"; NULL where the
  /// point failed. `what` is shown with the progress. Throws solver::InputError when the stored
  /// study has another block in this place, Interrupted when a signal stops it, and
  /// std::runtime_error when the study is cancelled meanwhile.
  protocol::Table solve(const protocol::Block& block, const std::string& columns,
                        const std::string& what);

  const std::string& name() const { return name_; }
  std::size_t rounds() const { return static_cast<std::size_t>(recipe_.blocks_size()); }
  std::uint64_t points() const { return points_; }  ///< of all rounds so far

 private:
  bool keep_waiting();
  void read_stored();
  void submit(const protocol::Recipe& recipe);
  void wait(const std::string& what);

  Console& console_;
  protocol::StopSignals& stop_;
  std::string name_;
  bool no_reuse_;
  std::unique_ptr<EmbeddedService> service_;  ///< none: a server elsewhere
  std::unique_ptr<Connection> connection_;
  protocol::Recipe recipe_;    ///< the rounds so far
  protocol::Recipe stored_;    ///< as the server has it
  bool is_submitted_ = false;  ///< by this object: a paused or cancelled study runs again
  std::uint64_t points_ = 0;
};

/// A block of listed points: axis i has the value `values[i][p]` at point p, or `values[i][0]` at
/// all points. Throws solver::InputError for an unknown key.
protocol::Block listed_points(const std::vector<std::string>& keys,
                              const std::vector<std::vector<double>>& values);

}  // namespace oblique::client
