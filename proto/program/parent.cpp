#include "proto/program/parent.h"

#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <string>
#include <system_error>

namespace oblique::protocol {
namespace {

/// Empty for the id of a process, and for no value at all.
std::string objection_to_process(const std::string& text) {
  pid_t process = 0;
  return text.empty() || (CLI::detail::lexical_cast(text, process) && process > 0)
             ? ""
             : "\"" + text + "\" is no process id";
}

}  // namespace

StopWithParent::StopWithParent() : parent_(getppid()) {}

const CLI::Option* StopWithParent::add_to(CLI::App& app) {
  option_ = app.add_option("--stop-with-parent", named_,
                           "Stop when the parent process is gone; with its id, also when it was "
                           "before this one began")
                ->expected(0, 1)
                ->check(objection_to_process)
                ->type_name("[PID]")
                ->default_str("");  // none: the option may stand alone
  return option_;
}

bool StopWithParent::is_wanted() const {
  return option_ != nullptr && option_->count() > 0;
}

bool StopWithParent::begin() const {
  if (!is_wanted()) {
    return true;
  }
  if (prctl(PR_SET_PDEATHSIG, SIGTERM) != 0) {
    throw std::system_error(errno, std::generic_category(), "cannot watch the parent process");
  }
  // Who ended before the system was asked is missed by nobody else.
  return getppid() == (named_ > 0 ? named_ : parent_);
}

}  // namespace oblique::protocol
