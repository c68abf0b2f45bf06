#include "tests/simulation/disk/simulated_files.h"

#include <set>
#include <utility>

#include "tests/simulation/disk/simulated_vfs.h"

namespace oblique::simulation {
namespace {

/// The part of a write that is done when the rest fails.
std::string_view some_of(World& world, std::string_view bytes) {
  return bytes.substr(
      0, static_cast<std::size_t>(world.between(0, static_cast<std::int64_t>(bytes.size()))));
}

}  // namespace

SimulatedFiles::SimulatedFiles(World& world, std::string path, const std::string& image)
    : world_(world), path_(std::move(path)) {
  entries_[path_] = std::make_shared<SimulatedFile>(image);
  durable_entries_ = entries_;
  add_to_vfs(*this, static_cast<std::uint64_t>(world.between(0, INT64_MAX - 1)));
}

SimulatedFiles::~SimulatedFiles() {
  remove_from_vfs(*this);
}

void SimulatedFiles::start() {
  ++life_;
  used_ = true;
  sync_failed_ = false;
}

void SimulatedFiles::kill() {
  ++life_;
  used_ = false;
  death_in_ = 0;
  locks.clear();
  memory.reset();
  connection_ = nullptr;
}

void SimulatedFiles::lose_power() {
  kill();
  std::set<std::string> names;
  for (const auto* entries : {&entries_, &durable_entries_}) {
    for (const auto& [name, file] : *entries) {
      names.insert(name);
    }
  }
  Entries left;
  for (const std::string& name : names) {
    const Entries& source = world_.chance(0.5) ? entries_ : durable_entries_;
    if (const auto found = source.find(name); found != source.end()) {
      found->second->lose_power(world_);
      left.insert(*found);
    }
  }
  entries_ = left;
  durable_entries_ = std::move(left);
}

std::shared_ptr<SimulatedFile> SimulatedFiles::open(const std::string& name, bool create) {
  if (!used_) {
    return nullptr;
  }
  const auto found = entries_.find(name);
  if (found != entries_.end() || !create) {
    return found == entries_.end() ? nullptr : found->second;
  }
  return entries_.emplace(name, std::make_shared<SimulatedFile>()).first->second;
}

int SimulatedFiles::remove(const std::string& name, bool sync_directory) {
  if (!used_) {
    return SQLITE_IOERR_DELETE;
  }
  if (dies_now()) {
    kill();
    return SQLITE_IOERR_DELETE;
  }
  if (entries_.erase(name) == 0) {
    return SQLITE_IOERR_DELETE_NOENT;
  }
  if (sync_directory) {
    durable_entries_ = entries_;
  }
  return SQLITE_OK;
}

int SimulatedFiles::write(SimulatedFile& file, std::size_t offset, std::string_view bytes) {
  if (dies_now()) {
    file.write(offset, some_of(world_, bytes));
    kill();
    return SQLITE_IOERR_WRITE;
  }
  if (fails_now()) {
    file.write(offset, some_of(world_, bytes));
    return SQLITE_IOERR_WRITE;
  }
  const std::size_t size = file.contents().size();
  if (full && offset + bytes.size() > size) {
    file.write(offset, bytes.substr(0, offset < size ? size - offset : 0));
    return SQLITE_FULL;
  }
  file.write(offset, bytes);
  return SQLITE_OK;
}

int SimulatedFiles::truncate(SimulatedFile& file, std::size_t size) {
  if (dies_now()) {
    kill();
    return SQLITE_IOERR_TRUNCATE;
  }
  if (fails_now()) {
    return SQLITE_IOERR_TRUNCATE;
  }
  file.truncate(size);
  return SQLITE_OK;
}

int SimulatedFiles::sync(SimulatedFile& file, bool and_directory) {
  if (failing_sync_in_ > 0 && --failing_sync_in_ == 0) {
    file.forget_unsynced();
    sync_failed_ = true;
    return SQLITE_IOERR_FSYNC;
  }
  const bool dies = dies_now();
  if ((dies && world_.chance(0.5)) || fails_now()) {
    if (dies) {
      kill();
    } else if (forgets) {
      file.forget_unsynced();
    }
    return SQLITE_IOERR_FSYNC;
  }
  file.sync();
  if (and_directory) {
    durable_entries_ = entries_;
  }
  if (dies) {
    kill();
    return SQLITE_IOERR_FSYNC;
  }
  return SQLITE_OK;
}

}  // namespace oblique::simulation
