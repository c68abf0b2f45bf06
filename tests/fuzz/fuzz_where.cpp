#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include <unistd.h>

#include "server/reader.h"
#include "server/store.h"

namespace {

/// A reader of an empty database of ours, whose file is gone once it is open.
oblique::server::Reader& reader() {
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("oblique-fuzz-" + std::to_string(getpid()) + ".db"))
                               .string();
  const oblique::server::Store store(path);
  static oblique::server::Reader opened(path);
  opened.query("SELECT 1", {});
  for (const char* suffix : {"", "-wal", "-shm"}) {
    std::filesystem::remove(path + suffix);
  }
  return opened;
}

}  // namespace

/// A condition on results, as users write it behind --where: an answer or a QueryError, and never a
/// change of the database.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static oblique::server::Reader& database = reader();
  const std::string condition(reinterpret_cast<const char*>(data), size);
  try {
    database.query("SELECT point FROM runs WHERE (" + condition + "\n) LIMIT 5", {10, 10'000, 50, 1'000'000});
  } catch (const oblique::server::QueryError&) {
  }
  return 0;
}
