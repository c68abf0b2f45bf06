#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

#include "proto/oblique.pb.h"
#include "server/store/changes.h"

// What people do with a study of a database on which no server works. All but `stored_recipe` lock
// it as a server does. All throw StorageError.
namespace oblique::server {

/// There is no such study, or a name is not to be had. The message says why.
class StudyRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Gives a study another name. Throws StudyRefused when there is no study of that number, when
/// another one has the name, or when no study may be called so.
void rename_study(const std::string& path, std::uint64_t study_id, const std::string& name);

/// Called now and then with how many rows are deleted.
using RowsDeleted = std::function<void(std::uint64_t rows)>;

/// Deletes a study with all its results. When the process ends on the way
/// the study is gone, and the next server deletes what is left of it. False when that is left to it
/// or the write-ahead log could not be merged, because another program goes on reading the
/// database. Throws StudyRefused when there is no study of that number.
bool delete_study(const std::string& path, std::uint64_t study_id, const RowsDeleted& deleted);

/// How long those who read a database are waited for while nothing can be done.
struct Patience {
  int waits = 30;
  std::chrono::milliseconds pause{100};
};

/// Deletes what deleted studies left, and calls `part_is_done` after each part. False when it
/// would have had to wait for longer. Throws as `Storage::commit` does.
bool clear_all_away(Storage& storage, const std::function<void()>& part_is_done,
                    const Patience& patience = {});

/// The recipe of a study; only reads, also while a server works on the database. Throws
/// StudyRefused when there is no study of that number.
protocol::Recipe stored_recipe(const std::string& path, std::uint64_t study_id);

}  // namespace oblique::server
