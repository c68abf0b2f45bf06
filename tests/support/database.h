#pragma once

#include <string>
#include <utility>
#include <vector>

namespace oblique::test {

/// Queries a database while a server may write to it.
class Database {
 public:
  explicit Database(std::string file) : file_(std::move(file)) {}

  /// Returns the first column of every row, NULL as 0. Throws std::runtime_error on SQL errors.
  std::vector<double> numbers(const std::string& sql) const;
  std::vector<std::string> texts(const std::string& sql) const;
  double number(const std::string& sql) const { return numbers(sql).at(0); }

  /// Returns the number of results, or 0 if the database does not exist yet.
  double rows() const;

 private:
  std::string file_;
};

}  // namespace oblique::test
