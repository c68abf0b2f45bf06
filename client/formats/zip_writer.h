#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/formats/sink.h"

namespace oblique::client {

/// Writes a ZIP archive whose members are stored as they are, from its beginning to its end, so
/// that it may go to a pipe. Every size is known before: nothing is sought back, and members and
/// archives of any size are written (zip64). Libraries that write ZIP (libzip, minizip) seek, or
/// bring a dozen others along (libarchive); this is all of it that an .npz needs.
class ZipWriter {
 public:
  explicit ZipWriter(Sink& sink) : sink_(sink) {}

  /// Begins a member; exactly `bytes` bytes, of this CRC-32, are to be appended.
  void begin(const std::string& name, std::uint64_t bytes, std::uint32_t crc);
  void append(std::string_view bytes);
  /// Ends the archive.
  void end();

 private:
  struct Member {
    std::string name;
    std::uint64_t bytes;
    std::uint32_t crc;
    std::uint64_t offset;
  };

  void write(std::string_view bytes);

  Sink& sink_;
  std::vector<Member> members_;
  std::uint64_t written_ = 0;
};

}  // namespace oblique::client
