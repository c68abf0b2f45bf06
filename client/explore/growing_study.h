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

/// Flags that choose who solves and stores the points of an exploration: the server that --server
/// or OBLIQUE_SERVER names, unless --db is given; otherwise a server and workers on this machine.
struct ExploreFlags {
  SourceFlags source;  ///< --db, --server, --keys, --timeout
  RunSettings run;     ///< --workers, --fall-memory, --no-reuse
  std::string name;    ///< name of the study; empty: made by `explored_name`
};

/// Adds --name, --db, --server, --keys, --timeout, --workers, --fall-memory and --no-reuse. `flags`
/// must live as long as `command`.
void add_explore_flags(CLI::App& command, ExploreFlags& flags);

/// Returns --name, or else `verb` and the first eight digits of a digest of `settings`, so that the
/// same command continues its study. Throws solver::InputError for an invalid --name.
std::string explored_name(const ExploreFlags& flags, std::string_view verb,
                          std::string_view settings);

/// Returns what `work` returns. When a signal stops `work` (Interrupted), prints that the same
/// command continues the exploration, and returns 128 plus the number of the signal.
int run_exploration(Console& console, const std::function<int(protocol::StopSignals& stop)>& work);

/// A study that grows round by round. Each round appends a block, which must be a deterministic
/// function of the results before it, but for rounding errors. Stored blocks are not solved again,
/// so the same calls continue an exploration that was stopped, or one that another client grows at
/// the same time.
class GrowingStudy {
 public:
  /// Connects to the server, or starts a server with workers, for as long as this object lives.
  /// Throws solver::InputError if the study `name` exists with another model or with estimated
  /// errors, std::runtime_error if the database is in use, and the errors of EmbeddedService and
  /// Connection.
  GrowingStudy(Console& console, const ExploreFlags& flags, std::string name,
               const solver::ModelParameters& model, protocol::StopSignals& stop);
  ~GrowingStudy();

  /// Solves the points of `block`, unless they are stored. Returns one row per point, in the order
  /// of the block. `columns` is SQL over the view `runs`, for example "mode, fn_peak_N"; the values
  /// of failed points are NULL. `what` is shown with the progress. Throws solver::InputError if the
  /// stored study has a different block for this round, Interrupted when a signal stops the call,
  /// and std::runtime_error when another command cancels, renames or deletes the study.
  protocol::Table solve(const protocol::Block& block, const std::string& columns,
                        const std::string& what);

  Source& source() const { return *connection_; }
  const std::string& name() const { return name_; }
  std::size_t rounds() const { return static_cast<std::size_t>(recipe_.blocks_size()); }
  std::uint64_t points() const { return points_; }  ///< number of points in all rounds so far

 private:
  /// Prints news of the embedded server and its workers. Throws if one of them has ended.
  void report_service();
  /// Submits the blocks so far, or the stored study where it is longer.
  void submit();
  /// Reads the stored study. Returns whether it exists and begins with the blocks so far, which
  /// then become those of the stored study. Throws solver::InputError if it has another model.
  bool read_stored();
  void wait(const std::string& what);

  Console& console_;
  protocol::StopSignals& stop_;
  std::string name_;
  bool no_reuse_;
  std::unique_ptr<EmbeddedService> service_;  ///< null if --server names the server
  std::unique_ptr<Connection> connection_;
  protocol::Recipe recipe_;    ///< the rounds so far
  protocol::Recipe stored_;    ///< the study that the server had when last described
  bool is_submitted_ = false;  ///< set by the first submission, which resumes a paused study
  std::uint64_t points_ = 0;
};

/// A block of listed points: the key `keys[i]` has the value `values[i][p]` at point p, or
/// `values[i][0]` at all points. `others` are axes that are constant or expressions. Throws
/// solver::InputError for an unknown key.
protocol::Block listed_points(const std::vector<std::string>& keys,
                              const std::vector<std::vector<double>>& values,
                              std::vector<protocol::Axis> others = {});

}  // namespace oblique::client
