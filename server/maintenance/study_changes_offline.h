#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "proto/oblique.pb.h"

// Changes to a study in a database that no server uses. All functions except `stored_recipe` lock
// the database as a server does. All throw StorageError.
namespace oblique::server {

/// There is no such study, or its new name is not allowed. The message has the reason.
class StudyRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Renames a study. Throws StudyRefused if there is no study of that number, or if the name is not
/// allowed or in use.
void rename_study(const std::string& path, std::uint64_t study_id, const std::string& name);

/// Deletes a study with all its results. If the process ends early, the study is gone and the next
/// server deletes the remaining rows. False if another program reads the database, so that rows
/// remain or the log could not be merged. Throws StudyRefused if there is no study of that number.
bool delete_study(const std::string& path, std::uint64_t study_id);

/// Reads the recipe of a study; a server may use the database. Throws StudyRefused if there is no
/// study of that number.
protocol::Recipe stored_recipe(const std::string& path, std::uint64_t study_id);

}  // namespace oblique::server
