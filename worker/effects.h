#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "proto/oblique.pb.h"
#include "worker/batch.h"

/// What the conversation decides and the session carries out.
namespace oblique::worker {

/// Drop the socket, if there is one, with all that waits in it, and open a new one.
struct Connect {
  std::string reason;  ///< empty for the first one
};
struct Send {
  protocol::WorkerMessage message;
};
struct Solve {
  Batch batch;
};
/// Drop the batches of the study.
struct DropStudy {
  std::uint64_t study_id;
};
/// Drop that batch.
struct DropBatch {
  std::uint64_t number;
};
/// Drop all batches: whoever gets their points now is the server's to say.
struct DropAll {};
/// Solve that point beside all batches.
struct SolveTrace {
  protocol::TraceOrder order;
};
/// Nobody waits for that trace any more.
struct CancelTrace {
  std::uint64_t trace_id;
};
/// Whoever ordered traces has forgotten them.
struct DropTraces {};
/// Hello had no answer: people are to know why, as far as the socket shows it.
struct TellSilence {};
/// Worth a line in the log.
struct Note {
  std::string text;
  bool is_warning = false;
};
/// The conversation is over.
struct Finish {
  int exit_code;
  std::string reason;
};

using Effect = std::variant<Connect, Send, Solve, DropStudy, DropBatch, DropAll, SolveTrace,
                            CancelTrace, DropTraces, TellSilence, Note, Finish>;
using Effects = std::vector<Effect>;

}  // namespace oblique::worker
