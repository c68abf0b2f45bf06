#include "tests/simulation/disk/simulated_files.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace oblique::simulation {
namespace {

/// What disks write whole.
constexpr std::size_t kSector = 512;
/// What systems keep in memory, and write to disks, together.
constexpr std::size_t kPage = 4096;

/// The part of a write that is done when the rest fails.
std::string_view some_of(World& world, std::string_view bytes) {
  return bytes.substr(
      0, static_cast<std::size_t>(world.between(0, static_cast<std::int64_t>(bytes.size()))));
}

}  // namespace

// ---- One file ----------------------------------------------------------------------------------

/// Draws which steps reached the disk: the first ones and part of the next, or any of each sector.
class SimulatedFile::Losses {
 public:
  Losses(World& world, const std::vector<Step>& steps)
      : world_(world),
        steps_(static_cast<std::int64_t>(steps.size())),
        reordered_(world.chance(0.25)),
        kept_(world.chance(0.5)   ? world.between(0, steps_)
              : world.chance(0.5) ? steps_
                                  : 0) {
    if (kept_ < steps_) {
      const Step& torn = steps[static_cast<std::size_t>(kept_)];
      const std::size_t sectors = torn.bytes.size() / kSector + 1;
      torn_before_ = torn.offset / kSector +
                     static_cast<std::size_t>(world.between(0, static_cast<std::int64_t>(sectors)));
    }
  }

  bool keeps_size(std::int64_t step) const { return step < kept_; }
  /// The size that the file has after a step that is kept in part.
  std::size_t torn_end(std::int64_t step, std::size_t end) const {
    return step == kept_ && !reordered_ ? std::min(end, torn_before_ * kSector) : 0;
  }
  bool keeps(std::int64_t step, std::size_t sector) {
    if (!reordered_) {
      return step < kept_ || (step == kept_ && sector < torn_before_);
    }
    const auto [found, is_new] = kept_of_sector_.try_emplace(sector, 0);
    if (is_new) {
      found->second = world_.between(0, steps_);
    }
    return step < found->second;
  }

 private:
  World& world_;
  std::int64_t steps_;
  bool reordered_;
  std::int64_t kept_;
  std::size_t torn_before_ = 0;  // of step kept_, the sectors before this one are kept too
  std::map<std::size_t, std::int64_t> kept_of_sector_;
};

void SimulatedFile::apply(const Step& step, std::string& contents) {
  if (step.truncates) {
    contents.resize(step.offset);
    return;
  }
  contents.resize(std::max(contents.size(), step.offset + step.bytes.size()));
  contents.replace(step.offset, step.bytes.size(), step.bytes);
}

void SimulatedFile::write(std::size_t offset, std::string_view bytes) {
  if (!bytes.empty()) {
    unsynced_.push_back({offset, std::string(bytes), false});
    apply(unsynced_.back(), contents_);
    for (std::size_t page = offset / kPage; page <= (offset + bytes.size() - 1) / kPage; ++page) {
      if (forgotten_pages_.erase(page) > 0) {
        unsynced_.push_back({page * kPage, contents_.substr(page * kPage, kPage), false});
      }
    }
  }
}

void SimulatedFile::forget_unsynced() {
  for (const Step& step : unsynced_) {
    const std::size_t end = step.offset + step.bytes.size();
    for (std::size_t page = step.offset / kPage; page * kPage < end; ++page) {
      forgotten_pages_.insert(page);
    }
  }
  unsynced_.clear();
  durable_.resize(contents_.size());
}

void SimulatedFile::truncate(std::size_t size) {
  if (size != contents_.size()) {
    unsynced_.push_back({size, {}, true});
    apply(unsynced_.back(), contents_);
  }
}

void SimulatedFile::sync() {
  for (const Step& step : unsynced_) {
    apply(step, durable_);
  }
  unsynced_.clear();
}

void SimulatedFile::lose_power(World& world) {
  Losses losses(world, unsynced_);
  std::size_t size = durable_.size();
  std::int64_t number = 0;
  for (const Step& step : unsynced_) {
    if (step.truncates) {
      if (losses.keeps_size(number)) {
        size = step.offset;
        durable_.resize(std::min(durable_.size(), size));
      }
      ++number;
      continue;
    }
    const std::size_t end = step.offset + step.bytes.size();
    durable_.resize(std::max(durable_.size(), end));
    size = std::max(size, losses.keeps_size(number) ? end : losses.torn_end(number, end));
    for (std::size_t at = step.offset; at < end;) {
      const std::size_t next = std::min(end, (at / kSector + 1) * kSector);
      if (losses.keeps(number, at / kSector)) {
        durable_.replace(at, next - at, step.bytes, at - step.offset, next - at);
      }
      at = next;
    }
    ++number;
  }
  durable_.resize(size);
  contents_ = durable_;
  unsynced_.clear();
  forgotten_pages_.clear();
}

// ---- All files of a database -------------------------------------------------------------------

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
