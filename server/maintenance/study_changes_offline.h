#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "proto/oblique.pb.h"

// Functions that change a study in a database that no server uses. All except `stored_recipe` lock
// the database as a server does. All throw StorageError.
namespace oblique::server {

/// The study does not exist, or its new name is not allowed. The message has the reason.
class StudyRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Renames a study. Throws StudyRefused for an unknown number, or if the name is in use or not
/// allowed.
void rename_study(const std::string& path, std::uint64_t study_id, const std::string& name);

/// Deletes a study with all its results. If the process is ended early, the study is gone, and the
/// next server deletes the remaining rows. Returns false if another program reads the database, so
/// that rows remain or the log was not merged. Throws StudyRefused if no study has this number.
bool delete_study(const std::string& path, std::uint64_t study_id);

/// Reads a study's recipe; a server may use the database. Throws StudyRefused for an unknown
/// number.
protocol::Recipe stored_recipe(const std::string& path, std::uint64_t study_id);

}  // namespace oblique::server
