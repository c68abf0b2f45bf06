#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

#include "proto/oblique.pb.h"

// What people do with a study of a database on which no server works. All but `stored_recipe` lock
// it as a server does, bring an older schema to the present one, and throw StorageError.
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

/// Deletes a study with all its results, and gives the space back. When the process ends on the way
/// the study is gone, and the next server deletes what is left of it. False when another program,
/// which reads the database, kept the write-ahead log from being merged. Throws StudyRefused when
/// there is no study of that number.
bool delete_study(const std::string& path, std::uint64_t study_id, const RowsDeleted& deleted);

/// The recipe of a study, of this or an earlier schema; only reads, also while a server works on
/// the database. Throws StorageError, and StudyRefused when there is no study of that number.
protocol::Recipe stored_recipe(const std::string& path, std::uint64_t study_id);

}  // namespace oblique::server
