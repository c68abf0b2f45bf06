// What goes out to workers.
#include <array>
#include <utility>

#include "proto/frames.h"
#include "proto/recipe/model_message.h"
#include "server/service/workers_desk.h"

namespace oblique::server {
namespace {

/// A recipe of the point that every sound worker solves in a moment.
protocol::Recipe probe_recipe() {
  protocol::Recipe recipe;
  *recipe.mutable_model() = protocol::to_message(solver::preset("paper"));
  protocol::Block& block = *recipe.add_blocks();
  for (const auto& [key, value] : {std::pair{"H", 1.0}, {"mu", 0.4}, {"e", 1.0}}) {
    protocol::Axis& axis = *block.add_axes();
    axis.set_key(key);
    axis.add_values(value);
  }
  return recipe;
}

}  // namespace

void WorkersDesk::send(const SendBatch& batch) {
  protocol::ServerToWorker message;
  auto& fields = *message.mutable_batch();
  fields.set_study_id(batch.study);
  fields.set_attempt(batch.attempt);
  fields.set_lease_id(batch.lease);
  fields.set_priority(batch.priority);
  std::uint64_t reached = 0;
  for (const Interval& range : batch.points) {
    fields.add_ranges(static_cast<std::int64_t>(range.begin - reached));
    fields.add_ranges(static_cast<std::int64_t>(range.end - range.begin));
    reached = range.end;
  }
  send(batch.worker, message, batch.lease);
}

void WorkersDesk::send(const SendProbe& probe) {
  protocol::ServerToWorker definition;
  definition.mutable_study()->set_study_id(kProbeStudy);
  *definition.mutable_study()->mutable_recipe() = probe_recipe();
  send(probe.worker, definition);
  send(SendBatch{probe.worker, kProbeStudy, {{0, 1}}, 1, probe.lease});
}

void WorkersDesk::send(const AcknowledgeResults& stored) {
  protocol::ServerToWorker message;
  message.mutable_results_stored()->set_sequence(stored.sequence);
  send(stored.worker, message);
}

void WorkersDesk::send(const WithdrawStudy& withdraw) {
  protocol::ServerToWorker message;
  message.mutable_withdraw()->set_study_id(withdraw.study);
  send(withdraw.worker, message);
}

void WorkersDesk::send(const ReleaseBatch& release) {
  protocol::ServerToWorker message;
  message.mutable_release()->set_lease_id(release.lease);
  send(release.worker, message);
}

void WorkersDesk::define(const DefineStudy& define, const std::string& recipe_bytes) {
  const auto known = workers_.find(define.worker);
  if (known == workers_.end()) {
    return;
  }
  const std::string frame = protocol::definition_around(define.study, recipe_bytes);
  note_delivery(define.worker, known->second,
                network_.forward_to_worker(known->second.identity, frame));
}

void WorkersDesk::notice(const std::string& text) {
  for (const auto& [id, worker] : workers_) {
    notice_to(id, text);
  }
}

void WorkersDesk::notice_to(WorkerId worker, const std::string& text) {
  protocol::ServerToWorker message;
  message.mutable_notice()->set_text(text);
  send(worker, message);
}

void WorkersDesk::stop() {
  if (std::exchange(stopping_, true)) {
    return;
  }
  protocol::ServerToWorker message;
  message.mutable_stopping();
  for (const auto& [id, worker] : workers_) {
    network_.to_worker(worker.identity, message);
  }
}

void WorkersDesk::send(WorkerId worker, const protocol::ServerToWorker& message, LeaseId lease) {
  const auto known = workers_.find(worker);
  if (known == workers_.end()) {
    return;
  }
  const Delivery delivery = network_.to_worker(known->second.identity, message);
  note_delivery(worker, known->second, delivery);
  if (delivery == Delivery::kGone && lease != 0) {
    gone_.at(worker).unsent.push_back(lease);
  }
}

void WorkersDesk::note_delivery(WorkerId worker, WorkerRecord& record, Delivery delivery) {
  record.was_told = true;
  if (delivery == Delivery::kGone) {
    gone_.try_emplace(worker, WorkerUnreachable{worker});
  } else if (delivery == Delivery::kBusy && !std::exchange(record.is_busy, true)) {
    found_.emplace_back(WorkerBusy{worker, true});
  }
}

}  // namespace oblique::server
