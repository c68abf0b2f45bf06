#include "client/formats/npz_printer.h"

#include <algorithm>
#include <cstddef>
#include <set>
#include <string_view>
#include <utility>

#include <zlib.h>

#include "client/formats/zip_writer.h"
#include "proto/text.h"
#include "proto/wire/chunk_rows.h"

namespace oblique::client {
namespace {

/// Longest name of an array in bytes. The archive has 16 bits for the length of a name, and a file
/// system, when the archive is unpacked, 255 bytes for a name.
constexpr std::size_t kLongestName = 200;

/// The heading of a column as the name of a file: no folders, nothing that cannot be seen.
std::string file_name(const std::string& heading) {
  std::string name = protocol::shortened(protocol::visible(heading), kLongestName);
  std::replace_if(
      name.begin(), name.end(), [](char letter) { return letter == '/' || letter == '\\'; }, '_');
  return name.find_first_not_of('.') == std::string::npos ? name + "_" : name;
}

/// The names of the arrays: headings, changed where they cannot name a file, each another one.
std::vector<std::string> array_names(const protocol::QueryReply& chunk) {
  std::vector<std::string> names = distinct_names(chunk);
  std::set<std::string> taken;
  for (const std::string& heading : names) {
    if (file_name(heading) == heading) {
      taken.insert(heading);
    }
  }
  for (std::string& name : names) {
    const std::string wanted = file_name(name);
    if (wanted == name) {
      continue;
    }
    name = wanted;
    for (int i = 2; !taken.insert(name).second; ++i) {
      name = wanted + "_" + std::to_string(i);
    }
  }
  return names;
}

std::uint32_t crc_of(NpyColumn& column) {
  uLong crc = crc32_z(0, nullptr, 0);
  column.write([&crc](std::string_view bytes) {
    crc = crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  });
  return static_cast<std::uint32_t>(crc);
}

}  // namespace

void write_npz(const std::vector<NamedColumn>& columns, Sink& sink) {
  ZipWriter archive(sink);
  for (const auto& [name, column] : columns) {
    // The longest text is known to fit once this was done.
    const std::uint32_t crc = crc_of(*column);
    archive.begin(name + ".npy", column->bytes_in_all(), crc);
    column->write([&archive](std::string_view bytes) { archive.append(bytes); });
  }
  archive.end();
}

void NpzPrinter::print(const protocol::QueryReply& chunk) {
  if (columns_.empty()) {
    for (std::string& name : array_names(chunk)) {
      const std::size_t i = columns_.size();
      columns_.push_back(
          {std::move(name),
           std::make_unique<NpyColumn>(folder_, std::vector<std::uint64_t>(),
                                       i < usual_.size() ? usual_[i] : protocol::CellKind::kNull)});
    }
  }
  protocol::ChunkRows rows(chunk);
  while (rows.next()) {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      columns_[i].column->add(rows.cell(i));
    }
  }
}

void NpzPrinter::end() {
  write_npz(columns_, sink_);
}

}  // namespace oblique::client
