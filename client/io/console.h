#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>

namespace oblique::client {

/// Value of an environment variable, if it is set.
std::optional<std::string> environment_variable(const char* name);

/// Columns and lines of a terminal.
struct TerminalSize {
  std::size_t columns = 0;  ///< 0: no terminal
  std::size_t lines = 0;    ///< 0: no terminal
};
/// Size of the terminal behind a descriptor; 80 x 24 for a terminal that does not report its size.
TerminalSize terminal_size(int descriptor);

/// Whether colours may be written to a descriptor: it is a terminal, TERM names one that has
/// colours, and NO_COLOR is not set.
bool may_colour(int descriptor);

enum class Verbosity {
  kQuiet,   ///< data and errors
  kNormal,  ///< also progress and notes
  kVerbose  ///< also what is done, where, and how long it takes
};

/// Where a command writes, how much, and what the terminal of its error stream can do. `main` makes
/// it and passes it on.
class Console {
 public:
  /// What the terminal behind the error stream can do; the default is that of a file.
  struct Terminal {
    bool is_terminal = false;  ///< a line can be drawn over itself
    bool has_colours = false;
    std::function<std::size_t()> columns = [] { return std::size_t{80}; };  ///< may change
  };

  /// The streams must outlive the console.
  Console(std::ostream& out, std::ostream& err, Terminal terminal)
      : out_(out), err_(err), terminal_(std::move(terminal)) {}
  Console(std::ostream& out, std::ostream& err) : Console(out, err, Terminal()) {}
  /// The streams and terminal of this process.
  static Console of_process();

  void set_verbosity(Verbosity verbosity) { verbosity_ = verbosity; }

  /// Data.
  std::ostream& out() { return out_; }
  /// Errors; written at every verbosity.
  std::ostream& errors() { return err_; }
  /// Progress and notes; a stream that drops everything with kQuiet.
  std::ostream& notes() { return verbosity_ == Verbosity::kQuiet ? dropped_ : err_; }

  /// Writes a line to `notes`; control characters of `sentence` are made visible (proto/text.h).
  void note(std::string_view sentence);
  /// Likewise, with kVerbose only.
  void detail(std::string_view sentence);
  /// Writes an error as "oblique query: ...", in several lines if `message` has them.
  void error(std::string_view command, std::string_view message);

  /// Whether a line of `notes` can be drawn over itself.
  bool can_redraw() const { return terminal_.is_terminal; }
  /// Characters a line of the error stream's terminal has; 80 where it has none.
  std::size_t columns() const { return terminal_.columns(); }

 private:
  std::ostream& out_;
  std::ostream& err_;
  std::ostream dropped_{nullptr};
  Terminal terminal_;
  Verbosity verbosity_ = Verbosity::kNormal;
};

}  // namespace oblique::client
