#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/reserved_port.h"

namespace oblique::test {

/// A folder of its own for one test; it is gone afterwards.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string file(const std::string& name) const { return (path_ / name).string(); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Waits until `condition` holds. Throws std::runtime_error that names `what` after a time that no
/// sound run needs.
void wait_until(const std::string& what, const std::function<bool()>& condition);

/// Whether the process lives; one that ended and is not yet waited for does not.
bool is_running(pid_t pid);

/// Processes that `pid` started and that still have it as their parent.
std::vector<pid_t> children_of(pid_t pid);

/// Processes in whose environment the name of this folder stands, whoever their parent is.
std::vector<pid_t> processes_of(const Folder& folder);

/// Variables for a program, beside our own or in place of them.
using Environment = std::map<std::string, std::string>;

/// A program under test, in a process group of its own. Its output goes to files in the folder.
class Process {
 public:
  /// Starts `program` with `arguments`. `ready_fd`, when not −1, is its descriptor 3.
  Process(const Folder& folder, const std::string& program,
          const std::vector<std::string>& arguments, const Environment& environment = {},
          int ready_fd = -1);
  /// Kills what still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  void send(int signal) const;
  /// Nothing while it runs.
  std::optional<int> exit_code();
  /// Waits for the end. The exit code, or 128 + the signal that ended it.
  int wait();
  /// What it has written so far.
  std::string output() const;
  std::string errors() const;

 private:
  bool reap();

  std::string output_file_;
  std::string errors_file_;
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

/// Runs `oblique` with `arguments` to its end.
struct Ran {
  int exit_code;
  std::string output;
  std::string errors;
};
Ran run_client(const Folder& folder, const std::vector<std::string>& arguments);

/// An `oblique-server` on loopback that is ready when constructed.
class Server {
 public:
  /// At ports that the system picks, and gives nobody else while this or a successor lives.
  Server(const Folder& folder, const std::string& database, const Environment& environment = {});
  /// At the same ports as one that has ended.
  Server(const Folder& folder, const std::string& database, const Server& before,
         const Environment& environment = {});

  const std::string& worker_url() const { return worker_url_; }
  const std::string& client_url() const { return client_url_; }
  Process& process() { return *process_; }

 private:
  struct Ports {
    ReservedPort worker;
    ReservedPort client;
  };
  void start(const Folder& folder, const std::string& database, const Environment& environment);

  std::shared_ptr<const Ports> ports_;
  std::string worker_url_;
  std::string client_url_;
  std::optional<Process> process_;
};

/// An `oblique-worker` of `server`.
class Worker : public Process {
 public:
  Worker(const Folder& folder, const std::string& server_url,
         const std::vector<std::string>& arguments = {}, const Environment& environment = {});
};

/// Answers of a database that a server may be writing to.
class Database {
 public:
  explicit Database(std::string file) : file_(std::move(file)) {}

  /// First column of every row, NULL as 0. Throws std::runtime_error with SQLite's reason.
  std::vector<double> numbers(const std::string& sql) const;
  std::vector<std::string> texts(const std::string& sql) const;
  double number(const std::string& sql) const { return numbers(sql).at(0); }

  /// Points that have a row; 0 while there is no database yet.
  double rows() const;

 private:
  std::string file_;
};

std::string client_program();
std::string server_program();
std::string worker_program();

}  // namespace oblique::test
