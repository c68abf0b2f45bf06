// The side of the service that tells clients how things stand. Long lists go out in pages.
#include <algorithm>

#include "server/service/service.h"

namespace oblique::server {
namespace {

/// A page ends when it has so many bytes, whatever its number of lines.
constexpr std::size_t kMostPageBytes = std::size_t{1} << 20U;

/// Lines of a page for a client that asks for so many; 0: for as many as there may be.
std::size_t page_size(std::uint32_t asked, std::size_t largest) {
  return asked == 0 ? largest : std::min<std::size_t>(asked, largest);
}

}  // namespace

void Service::status(const Client& client, const protocol::StatusRequest& request, Instant now) {
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  auto& fields = *reply.mutable_status();
  fields.set_workers(static_cast<std::uint32_t>(scheduler_.workers()));
  if (!request.study().empty()) {
    const auto known = studies_.find_durable(request.study());
    if (!known) {
      reply_error(client, unknown_study(request.study()));
      return;
    }
    *fields.add_studies() = status_of(*known, now);
    outbox_.to_client(client.identity, reply);
    return;
  }
  const std::size_t most = page_size(request.limit(), settings_.largest_page);
  std::size_t bytes = 0;
  for (auto id = studies_.durable_after(request.after_study_id()); id;
       id = studies_.durable_after(*id)) {
    if (static_cast<std::size_t>(fields.studies_size()) == most || bytes > kMostPageBytes) {
      fields.set_next_after(fields.studies(fields.studies_size() - 1).study_id());
      break;
    }
    *fields.add_studies() = status_of(*id, now);
    bytes += fields.studies(fields.studies_size() - 1).ByteSizeLong();
  }
  outbox_.to_client(client.identity, reply);
}

protocol::StudyStatus Service::status_of(StudyId id, Instant now) const {
  const StudyRecord& study = studies_.record(id);
  const StudyCounts counts = scheduler_.study(id);
  const std::uint64_t settled = counts.solved + counts.failed;
  protocol::StudyStatus status;
  status.set_study_id(id);
  status.set_name(study.name);
  status.set_state(settled == counts.points ? "done" : state_name(studies_.state(id)));
  status.set_points(counts.points);
  status.set_solved(counts.solved);
  status.set_failed(counts.failed);
  status.set_leased(counts.leased);
  status.set_created_at(study.created_at);
  status.set_priority(study.share.priority);
  status.set_weight(study.share.weight);
  status.set_mixes_versions(study.share.mixes_versions);
  status.set_solver_version(counts.solver_version);
  status.set_waits_for(what_it_waits_for(id, counts));
  if (studies_.state(id) == StudyState::kRunning) {
    status.set_points_per_s(rates_.points_per_s(id, settled, now.steady_ms));
  }
  return status;
}

std::string Service::what_it_waits_for(StudyId id, const StudyCounts& counts) const {
  if (studies_.state(id) != StudyState::kRunning ||
      counts.solved + counts.failed == counts.points) {
    return {};
  }
  if (!storage_fault_.empty()) {
    return storage_is_gone_ ? storage_fault_
                            : "the database, which takes no results: " + storage_fault_;
  }
  if (scheduler_.workers() == 0) {
    return "a worker";
  }
  if (counts.lacks_worker) {
    return "a worker with solver version " + counts.solver_version +
           ", that of its results, or to be submitted again with --mix-versions";
  }
  return {};
}

void Service::workers(const Client& client, const protocol::WorkersRequest& request, Instant now) {
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  auto& fields = *reply.mutable_workers();
  fields.set_bad_frames(bad_frames_);
  const std::size_t most = page_size(request.limit(), settings_.largest_page);
  for (auto peer = peers_.upper_bound(request.after_worker_id()); peer != peers_.end(); ++peer) {
    if (static_cast<std::size_t>(fields.workers_size()) == most) {
      fields.set_next_after(fields.workers(fields.workers_size() - 1).worker_id());
      break;
    }
    *fields.add_workers() = status_of_worker(peer->first, peer->second, now);
  }
  outbox_.to_client(client.identity, reply);
}

protocol::WorkerStatus Service::status_of_worker(WorkerId id, const Peer& peer, Instant now) const {
  const WorkerCounts counts = scheduler_.worker(id, now.steady_ms);
  protocol::WorkerStatus worker;
  worker.set_worker_id(id);
  worker.set_name(peer.name);
  worker.set_threads(peer.threads);
  worker.set_instruction_set(peer.instruction_set);
  worker.set_solver_version(peer.solver_version);
  worker.set_leased_points(counts.leased_points);
  worker.set_solved_points(counts.solved_points);
  worker.set_silent_ms(static_cast<std::uint32_t>(counts.silent_ms));
  worker.set_losses(counts.losses);
  worker.set_set_aside(counts.is_set_aside);
  worker.set_proven(counts.is_proven);
  return worker;
}

}  // namespace oblique::server
