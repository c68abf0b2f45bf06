#include "client/formats/npz_printer.h"

#include <utility>

#include <zlib.h>

#include "client/formats/zip_writer.h"
#include "proto/wire/chunk_rows.h"

namespace oblique::client {
namespace {

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
    for (std::string& name : distinct_names(chunk)) {
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
