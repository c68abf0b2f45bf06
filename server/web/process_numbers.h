#pragma once

#include <cstdint>
#include <string>

namespace oblique::server {

/// What the system says of this process. NaN: it does not say.
struct ProcessNumbers {
  double cpu_s;
  double resident_bytes;
  double open_descriptors;
  double most_descriptors;
  double began_s;  ///< since 1970
};
ProcessNumbers process_numbers();

/// What the file system says of the database. NaN: it does not say.
struct DiskNumbers {
  double database_bytes;
  double wal_bytes;  ///< 0 when there is no write-ahead log
  double free_bytes;
};
DiskNumbers disk_numbers(const std::string& database);

}  // namespace oblique::server
