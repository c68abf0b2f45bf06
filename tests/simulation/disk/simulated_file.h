#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/simulation/world.h"

namespace oblique::simulation {

/// One file on a simulated disk: what a reader sees, and what of it losing power leaves.
class SimulatedFile {
 public:
  SimulatedFile() = default;
  explicit SimulatedFile(const std::string& durable) : durable_(durable), contents_(durable) {}

  const std::string& contents() const { return contents_; }
  void write(std::size_t offset, std::string_view bytes);
  void truncate(std::size_t size);
  void sync();
  /// A sync failed, and the system takes the pages for clean nevertheless, as Linux does: what was
  /// written is read back and never gets to the disk, unless its page is written again.
  void forget_unsynced();

  /// What was synced stays. Of what was written since, the disk has any part: sectors are written
  /// whole, in any order, and a sector written several times has any of its states. The size of the
  /// file is another such thing. What is in the file and was never written is zero.
  void lose_power(World& world);

 private:
  struct Step {
    std::size_t offset;  // or the new size
    std::string bytes;
    bool truncates;
  };
  class Losses;
  static void apply(const Step& step, std::string& contents);

  std::string durable_;
  std::string contents_;
  std::vector<Step> unsynced_;
  std::set<std::size_t> forgotten_pages_;
};

}  // namespace oblique::simulation
