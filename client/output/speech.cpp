#include "client/output/speech.h"

#include "proto/text.h"

namespace oblique::client {
namespace {

/// In front of a stream's own buffer.
class SpeechBuffer : public std::streambuf {
 public:
  SpeechBuffer(std::streambuf* behind, Speech speech) : behind_(behind), speech_(speech) {}

  Speech speech() const { return speech_; }
  void begin_error() { ++errors_; }
  void end_error() { --errors_; }

 protected:
  int_type overflow(int_type letter) override {
    if (traits_type::eq_int_type(letter, traits_type::eof()) || is_dropped()) {
      return traits_type::not_eof(letter);
    }
    return behind_->sputc(traits_type::to_char_type(letter));
  }
  std::streamsize xsputn(const char* text, std::streamsize count) override {
    return is_dropped() ? count : behind_->sputn(text, count);
  }
  int sync() override { return behind_->pubsync(); }

 private:
  bool is_dropped() const { return speech_ == Speech::kQuiet && errors_ == 0; }

  std::streambuf* behind_;
  Speech speech_;
  int errors_ = 0;
};

SpeechBuffer* buffer_of(std::ostream& out) {
  return dynamic_cast<SpeechBuffer*>(out.rdbuf());
}

}  // namespace

SpeechOf::SpeechOf(std::ostream& out, Speech speech)
    : out_(out), before_(out.rdbuf()), buffer_(std::make_unique<SpeechBuffer>(before_, speech)) {
  out_.rdbuf(buffer_.get());
}

SpeechOf::~SpeechOf() {
  out_.rdbuf(before_);
}

ErrorOn::ErrorOn(std::ostream& out) : out_(out) {
  if (SpeechBuffer* buffer = buffer_of(out_)) {
    buffer->begin_error();
  }
}

ErrorOn::~ErrorOn() {
  if (SpeechBuffer* buffer = buffer_of(out_)) {
    buffer->end_error();
  }
}

bool is_verbose(std::ostream& out) {
  const SpeechBuffer* buffer = buffer_of(out);
  return buffer != nullptr && buffer->speech() == Speech::kVerbose;
}

void tell_detail(std::ostream& out, const std::string& sentence) {
  if (is_verbose(out)) {
    out << protocol::visible(sentence) << '\n';
  }
}

}  // namespace oblique::client
