#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "proto/oblique.pb.h"

// Changes of a study in a database that no server uses. All functions except `stored_recipe` lock
// the database as a server does. All throw StorageError.
namespace oblique::server {

/// There is no such study, or its new name is not allowed. The message says why.
class StudyRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Renames a study. Throws StudyRefused when there is no study of that number, when another one has
/// the name, or when the name is not allowed.
void rename_study(const std::string& path, std::uint64_t study_id, const std::string& name);

/// Deletes a study with all its results. If the process ends early, the study is gone and the next
/// server deletes the remaining rows. False if rows remain or the write-ahead log could not be
/// merged, because another program keeps reading the database. Throws StudyRefused when there is no
/// study of that number.
bool delete_study(const std::string& path, std::uint64_t study_id);

/// The recipe of a study. Only reads; a server may use the database. Throws StudyRefused when there
/// is no study of that number.
protocol::Recipe stored_recipe(const std::string& path, std::uint64_t study_id);

}  // namespace oblique::server
