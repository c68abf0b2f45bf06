#pragma once

#include <string>
#include <utility>
#include <vector>

namespace oblique::test {

/// Queries a database, which a server may be writing to.
class Database {
 public:
  explicit Database(std::string file) : file_(std::move(file)) {}

  /// First column of every row; NULL as 0. Throws std::runtime_error with SQLite's message.
  std::vector<double> numbers(const std::string& sql) const;
  std::vector<std::string> texts(const std::string& sql) const;
  double number(const std::string& sql) const { return numbers(sql).at(0); }

  /// Number of results; 0 if the database does not exist yet.
  double rows() const;

 private:
  std::string file_;
};

}  // namespace oblique::test
