#include "client/io/row_output.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <system_error>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 4> kFormatNames{"table", "csv", "json", "jsonl"};

/// Whether a column name ends with its unit, such as vt_in_m_s and impulse_n_Ns.
bool ends_in_unit(const std::string& name, const std::string& unit) {
  std::string suffix = "_";
  for (const char letter : unit) {
    if (letter != ' ' && letter != '^') {
      suffix += letter == '/' ? '_' : letter;
    }
  }
  return name.ends_with(suffix);
}

constexpr const char* kName = "standard output";

/// Returns the command of the pager, or an empty text for no pager.
std::string pager_command() {
  for (const char* name : {"OBLIQUE_PAGER", "PAGER"}) {
    if (const auto command = environment_variable(name)) {
      return *command == "cat" ? std::string() : *command;
    }
  }
  return "if command -v less >/dev/null; then less -FRSX; else cat; fi";
}

[[noreturn]] void refuse(std::string_view flag, const std::string& path, int error) {
  throw solver::InputError(
      fmt::format("{} {} cannot be written: {}", flag, path, std::strerror(error)));
}

[[noreturn]] void fail_to_write(const std::string& name) {
  throw std::runtime_error(fmt::format("{} could not be written: {}", name, std::strerror(errno)));
}

std::string name_of(int descriptor) {
  return fmt::format("/proc/self/fd/{}", descriptor);
}

/// The file that receives the output for `path`, which may be a symbolic link.
struct FilePlace {
  std::string path;  // path after following the links
  // True for devices, pipes and /dev/stdout, which are opened and written directly.
  bool is_in_place = false;
};

FilePlace file_place(const std::string& path, std::string_view flag) {
  constexpr int kMaxLinks = 40;  // maximum number of links that Linux follows
  FilePlace place{path};
  std::error_code ignored;
  for (int links = 0; fs::is_symlink(fs::symlink_status(place.path, ignored)); ++links) {
    if (links == kMaxLinks) {
      refuse(flag, path, ELOOP);
    }
    const fs::path link = fs::absolute(place.path);
    // Links in /proc, such as the target of /dev/stdout, refer to open files. Output is written
    // directly to the open file.
    if (fs::weakly_canonical(link.parent_path(), ignored).string().starts_with("/proc/")) {
      place.is_in_place = true;
      return place;
    }
    const fs::path target = fs::read_symlink(link, ignored);
    place.path = target.is_absolute() ? target : link.parent_path() / target;
  }
  if (fs::is_directory(place.path, ignored)) {
    throw solver::InputError(fmt::format("{} {} is a folder", flag, path));
  }
  place.is_in_place = fs::exists(place.path, ignored) && !fs::is_regular_file(place.path, ignored);
  return place;
}

}  // namespace

std::span<const std::string_view> format_names() {
  return kFormatNames;
}

std::size_t choice_of(std::string_view flag, std::string_view name,
                      std::span<const std::string_view> allowed) {
  const auto found = std::find(allowed.begin(), allowed.end(), name);
  if (found == allowed.end()) {
    throw solver::InputError(fmt::format("{} {} is not allowed: it must be one of {}{}", flag, name,
                                         protocol::joined(allowed),
                                         protocol::did_you_mean(name, allowed)));
  }
  return static_cast<std::size_t>(found - allowed.begin());
}

Format format_named(std::string_view name, std::span<const std::string_view> allowed) {
  static_cast<void>(choice_of("--format", name, allowed));
  return static_cast<Format>(choice_of("--format", name, kFormatNames));
}

Format format_of_output(const std::string& flag, const std::string& file,
                        std::span<const std::string_view> allowed, Format usual) {
  const std::string ending = fs::path(file).extension().string();
  const auto meant = std::string_view(ending).substr(ending.empty() ? 0 : 1);
  const bool is_known =
      meant != "table" && std::find(allowed.begin(), allowed.end(), meant) != allowed.end();
  if (!flag.empty()) {
    const Format format = format_named(flag, allowed);
    if (is_known && flag != meant) {
      throw solver::InputError(
          fmt::format("--format {} and --out {} contradict each other: that file name means {}; "
                      "omit the flag or change the ending",
                      flag, file, meant));
    }
    return format;
  }
  if (is_known) {
    return format_named(meant);
  }
  if (file.empty() || is_written_in_place(file)) {
    return usual;
  }
  throw solver::InputError(
      fmt::format("the ending of --out {} is not a format: end the name in {}, or add --format",
                  file, allowed.size() > 2 ? ".csv, .json or .jsonl" : ".csv or .json"));
}

ShownColumn shown_column(const std::string& name, const std::string& unit) {
  const auto* field = solver::find_result_column(name);
  if (field != nullptr && field->shown_per_unit != 1.0) {
    return {fmt::format("{} [{}]", name, field->shown_unit), field->shown_per_unit};
  }
  return {unit.empty() || ends_in_unit(name, unit) ? name : fmt::format("{} [{}]", name, unit)};
}

std::vector<ShownColumn> shown_columns(const protocol::QueryReply& chunk) {
  std::vector<ShownColumn> shown;
  for (int i = 0; i < chunk.columns_size(); ++i) {
    shown.push_back(
        shown_column(chunk.columns(i), i < chunk.units_size() ? chunk.units(i) : std::string()));
  }
  return shown;
}

std::string text_of(const std::vector<protocol::QueryReply>& chunks,
                    const OutputSettings& settings) {
  std::string text;
  const auto printer = make_printer(settings);
  for (const auto& chunk : chunks) {
    printer->print(chunk, text);
  }
  printer->end(text);
  return text;
}

void print(std::ostream& out, const protocol::Table& rows, Format format) {
  out << text_of({protocol::chunk_of(rows)}, {.format = format});
}

void print_out(const protocol::Table& rows, Format format) {
  RowOutput out({.format = format, .may_page = false, .may_leave_out = false});
  out.print(protocol::chunk_of(rows));
  out.finish();
}

RowOutput::RowOutput(OutputSettings settings) {
  if (settings.file.empty()) {
    const TerminalSize terminal = terminal_size(STDOUT_FILENO);
    if (terminal.lines > 0) {
      settings.width = terminal.columns;
      settings.first_rows = terminal.lines;
    }
    sink_ =
        std::make_unique<StandardOutput>(settings.may_page && settings.format == Format::kTable);
  } else {
    sink_ = std::make_unique<AtomicFile>(settings.file);
  }
  printer_ = make_printer(settings);
}

void RowOutput::print(const protocol::QueryReply& chunk) {
  std::string text;
  printer_->print(chunk, text);
  sink_->append(text);
}

void RowOutput::finish() {
  std::string text;
  printer_->end(text);
  sink_->append(text);
  sink_->finish();
}

bool RowOutput::is_paged() const {
  const auto* output = dynamic_cast<const StandardOutput*>(sink_.get());
  return output != nullptr && output->is_paged();
}

void write_all(int descriptor, std::string_view bytes, const std::string& name) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EPIPE) {
      throw ClosedPipe();
    } else if (errno != EINTR) {
      fail_to_write(name);
    }
  }
}

StandardOutput::StandardOutput(bool may_page)
    : is_terminal_(isatty(STDOUT_FILENO) == 1),
      pager_command_(may_page && is_terminal_ ? pager_command() : std::string()) {
  std::cout.flush();
}

StandardOutput::~StandardOutput() {
  wait_for_pager();
}

void StandardOutput::append(std::string_view bytes) {
  if (!is_terminal_) {
    write_all(STDOUT_FILENO, bytes, kName);
    return;
  }
  const std::string text = protocol::visible_lines(bytes);
  if (pager_command_.empty() || pager_ != nullptr) {
    write_all(pager_ == nullptr ? STDOUT_FILENO : to_pager_.number(), text, kName);
    return;
  }
  first_screen_ += text;
  const auto lines = std::count(first_screen_.begin(), first_screen_.end(), '\n');
  if (static_cast<std::size_t>(lines) + 1 >= terminal_size(STDOUT_FILENO).lines) {
    start_pager();
    write_all(to_pager_.number(), std::exchange(first_screen_, {}), kName);
  }
}

void StandardOutput::start_pager() {
  Pipe pipe;
  pager_ = std::make_unique<ChildProcess>(ChildSettings{
      .program = "sh",
      // `cat` prints the text if the pager is not installed (127), or if the command has only
      // blanks and assignments, such as LESS=-S.
      .arguments =
          {"-c",
           "for word in $0; do case $word in *=*) ;; *) eval \"$0\"; [ $? = 127 ] || exit; "
           "break; esac; done; exec cat",
           pager_command_},
      .show_errors = true,
      .stays_in_our_group = true,
      .input_from = pipe.read.number(),
      .show_output = true});
  to_pager_ = std::move(pipe.write);
  // Ignores SIGPIPE, so that writing after the user has quit the pager returns an error. Ignores
  // Ctrl-C, which goes to the pager.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGINT, SIG_IGN);
}

void StandardOutput::finish() {
  write_all(STDOUT_FILENO, std::exchange(first_screen_, {}), kName);
  wait_for_pager();
}

void StandardOutput::wait_for_pager() {
  if (to_pager_.is_open()) {
    to_pager_.close();
    pager_->wait();
    std::signal(SIGINT, SIG_DFL);
  }
}

bool is_written_in_place(const std::string& path) {
  return file_place(path, "--out").is_in_place;
}

AtomicFile::AtomicFile(const std::string& path, std::string_view flag) : name_(path) {
  const FilePlace place = file_place(path, flag);
  path_ = place.path;
  is_in_place_ = place.is_in_place;
  if (is_in_place_) {
    // /dev/stdout may be a file, so output is appended to its contents.
    descriptor_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
  } else {
    open_draft();
  }
  if (!descriptor_.is_open()) {
    refuse(flag, name_, errno);
  }
}

/// Opens an unnamed file where possible, so that nothing remains if the program ends early.
void AtomicFile::open_draft() {
  draft_ = fmt::format("{}.part-{}", path_, ::getpid());
  descriptor_ = Descriptor(
      ::open(fs::absolute(path_).parent_path().c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0666));
  if (descriptor_.is_open() && ::access(name_of(descriptor_.number()).c_str(), F_OK) != 0) {
    descriptor_.close();  // the file can be named later only through /proc
    errno = EOPNOTSUPP;
  }
  if (!descriptor_.is_open() && (errno == EOPNOTSUPP || errno == EISDIR || errno == EINVAL)) {
    descriptor_ =
        Descriptor(::open(draft_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
    has_name_ = descriptor_.is_open();
  }
}

AtomicFile::~AtomicFile() {
  if (has_name_) {
    ::unlink(draft_.c_str());
  }
}

void AtomicFile::append(std::string_view bytes) {
  write_all(descriptor_.number(), bytes, name_);
}

void AtomicFile::finish() {
  const auto require = [this](bool succeeded) {
    if (!succeeded) {
      fail_to_write(name_);
    }
  };
  if (is_in_place_) {
    require(::close(descriptor_.release()) == 0);
    return;
  }
  // Some file systems report a full disk only at fsync.
  require(::fsync(descriptor_.number()) == 0);
  if (!has_name_) {
    require(::linkat(AT_FDCWD, name_of(descriptor_.number()).c_str(), AT_FDCWD, draft_.c_str(),
                     AT_SYMLINK_FOLLOW) == 0);
    has_name_ = true;
  }
  require(::close(descriptor_.release()) == 0);
  require(std::rename(draft_.c_str(), path_.c_str()) == 0);
  has_name_ = false;
}

}  // namespace oblique::client
