#include "tests/simulation/disk/simulated_file.h"

#include <algorithm>
#include <map>

namespace oblique::simulation {
namespace {

/// What disks write whole.
constexpr std::size_t kSector = 512;
/// What systems keep in memory, and write to disks, together.
constexpr std::size_t kPage = 4096;

}  // namespace

/// Draws which steps reached the disk.
class SimulatedFile::Losses {
 public:
  Losses(World& world, const std::vector<Step>& steps)
      : world_(world), steps_(static_cast<std::int64_t>(steps.size())) {
    switch (world.between(0, 3)) {
      case 0:  // all
        kept_ = steps_;
        break;
      case 1:  // none
        break;
      case 2:  // some, and part of the next one
        kept_ = world.between(0, steps_);
        if (kept_ < steps_) {
          const Step& torn = steps[static_cast<std::size_t>(kept_)];
          const std::size_t sectors = torn.bytes.size() / kSector + 1;
          torn_before_ = torn.offset / kSector + static_cast<std::size_t>(world.between(
                                                     0, static_cast<std::int64_t>(sectors)));
        }
        break;
      default:
        reordered_ = true;
        kept_ = world.chance(0.5) ? steps_ : world.between(0, steps_);
        break;
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
  std::int64_t kept_ = 0;
  std::size_t torn_before_ = 0;  // of step kept_, the sectors before this one are kept too
  bool reordered_ = false;
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

}  // namespace oblique::simulation
