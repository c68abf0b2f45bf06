#include "server/scheduler/worker_processes.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

namespace oblique::server {

ProcessNumber WorkerProcesses::join(const std::string& id, WorkerId worker) {
  const auto known = id.empty() ? numbers_.end() : numbers_.find(id);
  if (known != numbers_.end()) {
    WorkerProcess& process = processes_.at(known->second);
    if (process.workers.empty()) {
      std::erase(absent_, known->second);
    }
    process.workers.insert(worker);
    return known->second;
  }
  const ProcessNumber number = ++last_number_;
  processes_.emplace(number, WorkerProcess{id, {worker}});
  if (!id.empty()) {
    numbers_.emplace(id, number);
  }
  return number;
}

void WorkerProcesses::leave(ProcessNumber number, WorkerId worker) {
  WorkerProcess& process = processes_.at(number);
  process.workers.erase(worker);
  if (!process.workers.empty()) {
    return;
  }
  if (process.id.empty()) {
    forget(number);
    return;
  }
  absent_.push_back(number);
  if (absent_.size() > most_absent_) {
    forget(absent_.front());
    absent_.pop_front();
  }
}

void WorkerProcesses::forget(ProcessNumber number) {
  numbers_.erase(processes_.at(number).id);
  processes_.erase(number);
}

void WorkerProcesses::forget_study(StudyId study) {
  for (auto& [number, process] : processes_) {
    process.in_histories.erase(study);
  }
}

std::size_t WorkerProcesses::workers() const {
  return std::accumulate(
      processes_.begin(), processes_.end(), std::size_t{0},
      [](std::size_t sum, const auto& entry) { return sum + entry.second.workers.size(); });
}

void WorkerProcesses::check_invariants() const {
  std::size_t absent = 0;
  for (const auto& [number, process] : processes_) {
    const auto by_id = numbers_.find(process.id);
    if (process.id.empty() ? process.workers.empty()
                           : by_id == numbers_.end() || by_id->second != number) {
      throw std::logic_error("a worker process cannot be found");
    }
    if (process.workers.empty()) {
      ++absent;
      if (std::count(absent_.begin(), absent_.end(), number) != 1) {
        throw std::logic_error("an absent process is not remembered once");
      }
    }
  }
  if (absent != absent_.size() || absent > most_absent_) {
    throw std::logic_error("the wrong processes are remembered");
  }
}

}  // namespace oblique::server
