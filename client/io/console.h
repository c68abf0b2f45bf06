#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace oblique::client {

std::optional<std::string> environment_variable(const char* name);

struct TerminalSize {
  std::size_t columns = 0;  ///< 0 if the output is not a terminal
  std::size_t lines = 0;    ///< 0 if the output is not a terminal
};
/// Returns the size of the terminal behind a descriptor; 80 x 24 if it does not report its size.
TerminalSize terminal_size(int descriptor);

/// Whether the descriptor is a terminal with colours according to TERM, and NO_COLOR is not set.
bool may_colour(int descriptor);

/// Returns the number of characters in a UTF-8 text.
std::size_t width_of(std::string_view text);
/// Breaks a text between words into lines of at most `width` characters; longer words are not
/// broken. Returns at least one line.
std::vector<std::string> wrapped(std::string_view text, std::size_t width);

// ---- Numbers formatted for people. Programs get all digits, in SI units. ----

/// Formats a duration: "0.4 s", "12 s", "3 min 05 s", "2 h 10 min", "3 d 04 h".
std::string format_duration(double seconds);

/// Formats a count: "950", "14,300".
std::string format_count(std::uint64_t count);
/// Formats a count with its noun: "1 point", "14,300 points".
std::string counted(std::uint64_t count, std::string_view one, std::string_view many);

/// Formats a rate with three digits; from 100 on as a whole number: "0.31", "84.4", "14,300".
std::string format_rate(double per_s);

/// Formats a size: "120 bytes", "1.3 MB", "24 GB"; 1 kB is 1000 bytes.
std::string format_bytes(std::uint64_t bytes);

enum class Verbosity {
  kQuiet,   ///< data and errors
  kNormal,  ///< data, errors, progress and notes
  kVerbose  ///< also what the command does, where, and how long it takes
};

/// Output streams of a command, its verbosity, and the terminal behind the error stream.
class Console {
 public:
  /// Features of the terminal behind the error stream. By default the stream is a file.
  struct Terminal {
    bool is_terminal = false;  ///< a line can be overwritten
    bool has_colours = false;
    std::function<std::size_t()> columns = [] { return std::size_t{80}; };  ///< may change
  };

  /// Both streams must outlive the console.
  Console(std::ostream& out, std::ostream& err, Terminal terminal)
      : out_(out), err_(err), terminal_(std::move(terminal)) {}
  Console(std::ostream& out, std::ostream& err) : Console(out, err, Terminal()) {}
  /// Returns a console with the standard streams and terminal of this process.
  static Console of_process();

  void set_verbosity(Verbosity verbosity) { verbosity_ = verbosity; }

  std::ostream& out() { return out_; }
  /// Stream for errors, which are written at every verbosity.
  std::ostream& errors() { return err_; }
  /// Stream for progress and notes; with kQuiet it discards everything.
  std::ostream& notes() { return verbosity_ == Verbosity::kQuiet ? dropped_ : err_; }

  /// Writes a line to `notes`; makes control characters visible (proto/text.h).
  void note(std::string_view sentence);
  /// Writes a note if the verbosity is kVerbose.
  void detail(std::string_view sentence);
  /// Writes an error as "oblique query: message". The message may have several lines.
  void error(std::string_view command, std::string_view message);

  /// Whether a line of `notes` can be overwritten.
  bool can_redraw() const { return terminal_.is_terminal; }
  /// Overwrites the last redrawn line of `notes`; an empty line erases it. Only on a terminal.
  void redraw(std::string_view line);
  /// Maximum length of a redrawn line. It leaves the last column free, because some terminals wrap
  /// a line that reaches it.
  std::size_t columns() const;

 private:
  std::ostream& out_;
  std::ostream& err_;
  std::ostream dropped_{nullptr};
  Terminal terminal_;
  Verbosity verbosity_ = Verbosity::kNormal;
};

}  // namespace oblique::client
