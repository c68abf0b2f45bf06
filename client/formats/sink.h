#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

namespace oblique::client {

/// Whoever read what was written has gone, as `head` does: no failure, and nothing to be said of.
class ClosedPipe : public std::runtime_error {
 public:
  ClosedPipe() : std::runtime_error("nobody reads the output any more") {}
};

/// Takes bytes, some of which it holds back until there are more.
class Sink {
 public:
  Sink() = default;
  virtual ~Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  void append(std::string_view bytes) {
    held_ += bytes;
    flush_if_long();
  }
  /// What is held back, to be appended to; then `flush_if_long`.
  std::string& held() { return held_; }
  void flush_if_long() {
    if (held_.size() >= kLong) {
      flush();
    }
  }
  /// Passes on all that is held back. Throws ClosedPipe, or std::runtime_error with the reason.
  void flush();
  /// There is no more: what was written becomes what it is to be. Throws as `flush` does.
  virtual void finish() { flush(); }

 protected:
  virtual void write(std::string_view bytes) = 0;

 private:
  static constexpr std::size_t kLong = std::size_t{64} << 10U;

  std::string held_;
};

/// Writes all to a descriptor, called `name` in errors.
void write_all(int descriptor, std::string_view bytes, const std::string& name);

/// Standard output, behind what was printed there by std::cout. Texts become visible (proto/text.h)
/// where a terminal shows them.
class StandardOutput : public Sink {
 public:
  StandardOutput();

 protected:
  void write(std::string_view bytes) override;

 private:
  bool is_terminal_;
};

/// A text.
class TextSink : public Sink {
 public:
  const std::string& text() const { return text_; }

 protected:
  void write(std::string_view bytes) override { text_ += bytes; }

 private:
  std::string text_;
};

}  // namespace oblique::client
