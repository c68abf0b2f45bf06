#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "proto/oblique.pb.h"
#include "proto/program/process.h"
#include "worker/solving_slot.h"

namespace oblique::worker {

/// Returns slots that this process shares with its later children, until it ends. The first slot is
/// for traces; the others are for the solving threads.
std::span<SolvingSlot> make_shared_slots(std::size_t threads);

/// Runs `work` in a child process, which ends with this one, and returns its exit code. If a signal
/// ends the child, starts another one: at once, or after a growing pause if several in a row have
/// solved nothing. Forwards signals to stop. Must be called before any thread starts.
///
/// `hello` contains the random ID of the child, and the child before it. `forwarder` is a socket
/// for messages to systemd, which accepts them from the parent only. Returns in the child too, with
/// the result of `work`.
int supervise(protocol::StopSignals& stop, std::span<SolvingSlot> slots,
              const std::function<int(const protocol::WorkerHello& hello, int forwarder)>& work);

}  // namespace oblique::worker
