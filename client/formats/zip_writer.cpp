#include "client/formats/zip_writer.h"

namespace oblique::client {
namespace {

// Words of the format, APPNOTE.TXT of PKWARE.
constexpr std::uint32_t kMember = 0x04034b50;
constexpr std::uint32_t kEntry = 0x02014b50;
constexpr std::uint32_t kEnd64 = 0x06064b50;
constexpr std::uint32_t kEnd64Place = 0x07064b50;
constexpr std::uint32_t kEnd = 0x06054b50;
constexpr std::uint16_t kZip64Field = 0x0001;
constexpr std::uint16_t kVersion = 45;          // zip64
constexpr std::uint16_t kMadeBy = 0x0300 | 45;  // Unix, so that the modes below count
constexpr std::uint32_t kUnixMode = 0100644U << 16U;
constexpr std::uint16_t kNamesAreUtf8 = 0x0800;
constexpr std::uint16_t kFirstDay =
    (1U << 5U) | 1U;                         // 1980-01-01: archives of equal rows are equal
constexpr std::uint32_t kIn64 = 0xffffffff;  // the value stands in the zip64 field

void put16(std::string& out, std::uint64_t value) {
  out += static_cast<char>(value & 0xffU);
  out += static_cast<char>((value >> 8U) & 0xffU);
}
void put32(std::string& out, std::uint64_t value) {
  put16(out, value & 0xffffU);
  put16(out, (value >> 16U) & 0xffffU);
}
void put64(std::string& out, std::uint64_t value) {
  put32(out, value & kIn64);
  put32(out, value >> 32U);
}

/// What member and entry have alike, up to the sizes.
void put_common(std::string& out, std::uint32_t crc) {
  put16(out, kVersion);
  put16(out, kNamesAreUtf8);
  put16(out, 0);  // stored
  put16(out, 0);  // midnight
  put16(out, kFirstDay);
  put32(out, crc);
}

}  // namespace

void ZipWriter::write(std::string_view bytes) {
  sink_.append(bytes);
  written_ += bytes.size();
}

void ZipWriter::begin(const std::string& name, std::uint64_t bytes, std::uint32_t crc) {
  members_.push_back({name, bytes, crc, written_});
  std::string head;
  put32(head, kMember);
  put_common(head, crc);
  put32(head, kIn64);
  put32(head, kIn64);
  put16(head, name.size());
  put16(head, 20);
  head += name;
  put16(head, kZip64Field);
  put16(head, 16);
  put64(head, bytes);
  put64(head, bytes);
  write(head);
}

void ZipWriter::append(std::string_view bytes) {
  write(bytes);
}

void ZipWriter::end() {
  const std::uint64_t directory = written_;
  for (const Member& member : members_) {
    std::string entry;
    put32(entry, kEntry);
    put16(entry, kMadeBy);
    put_common(entry, member.crc);
    put32(entry, kIn64);
    put32(entry, kIn64);
    put16(entry, member.name.size());
    put16(entry, 28);
    put16(entry, 0);  // comment
    put16(entry, 0);  // disk
    put16(entry, 0);  // kind of contents
    put32(entry, kUnixMode);
    put32(entry, kIn64);
    entry += member.name;
    put16(entry, kZip64Field);
    put16(entry, 24);
    put64(entry, member.bytes);
    put64(entry, member.bytes);
    put64(entry, member.offset);
    write(entry);
  }
  const std::uint64_t end = written_;
  std::string tail;
  put32(tail, kEnd64);
  put64(tail, 44);  // bytes of this record from here on
  put16(tail, kMadeBy);
  put16(tail, kVersion);
  put32(tail, 0);
  put32(tail, 0);
  put64(tail, members_.size());
  put64(tail, members_.size());
  put64(tail, end - directory);
  put64(tail, directory);
  put32(tail, kEnd64Place);
  put32(tail, 0);
  put64(tail, end);
  put32(tail, 1);
  put32(tail, kEnd);
  put16(tail, 0);
  put16(tail, 0);
  put16(tail, 0xffff);
  put16(tail, 0xffff);
  put32(tail, kIn64);
  put32(tail, kIn64);
  put16(tail, 0);
  write(tail);
}

}  // namespace oblique::client
