#pragma once

#include <memory>
#include <ostream>
#include <streambuf>
#include <string>

namespace oblique::client {

/// How much is said beside the data: errors alone; what people should know; or also what is done,
/// where, and how long it takes.
enum class Speech { kQuiet, kUsual, kVerbose };

/// For as long as it lives, `out` says so much. Progress, notes and sentences about what was done
/// are written to it as ever, and dropped where they are not wanted.
class SpeechOf {
 public:
  SpeechOf(std::ostream& out, Speech speech);
  ~SpeechOf();
  SpeechOf(const SpeechOf&) = delete;
  SpeechOf& operator=(const SpeechOf&) = delete;

 private:
  std::ostream& out_;
  std::streambuf* before_;
  std::unique_ptr<std::streambuf> buffer_;
};

/// For as long as it lives, what is written to `out` is an error and said in any case.
class ErrorOn {
 public:
  explicit ErrorOn(std::ostream& out);
  ~ErrorOn();
  ErrorOn(const ErrorOn&) = delete;
  ErrorOn& operator=(const ErrorOn&) = delete;

 private:
  std::ostream& out_;
};

bool is_verbose(std::ostream& out);
/// A line for those who want to know what is done: written where `out` is verbose.
void tell_detail(std::ostream& out, const std::string& sentence);

}  // namespace oblique::client
