#include "client/formats/npy_column.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/formats/cell_text.h"
#include "client/formats/sink.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using protocol::Cell;
using protocol::CellKind;

constexpr std::size_t kBlock = std::size_t{64} << 10U;
constexpr std::uint64_t kLongestText = 100'000;  // characters
constexpr char32_t kNoCharacter = 0xfffd;
constexpr double kNull = std::numeric_limits<double>::quiet_NaN();
constexpr char kOrder = std::endian::native == std::endian::little ? '<' : '>';

template <typename Number>
std::string_view bytes_of(const Number& number) {
  return {reinterpret_cast<const char*>(&number), sizeof number};
}

template <typename Number>
Number number_at(std::string_view bytes) {
  Number number{};
  std::memcpy(&number, bytes.data(), sizeof number);
  return number;
}

/// Calls `take` with each number of a file of nothing else.
template <typename Number, typename Take>
void for_each_number(ScratchFile& file, const Take& take) {
  file.read(sizeof(Number), [&](std::string_view block) {
    for (; !block.empty(); block.remove_prefix(sizeof(Number))) {
      take(number_at<Number>(block));
    }
  });
}

/// Code points of a text that may not be UTF-8, each to `take`.
template <typename Take>
void for_each_character(std::string_view text, const Take& take) {
  while (!text.empty()) {
    const auto next = protocol::first_character(text);
    take(next.bytes == 0 ? kNoCharacter : next.code);
    text.remove_prefix(std::max<std::size_t>(next.bytes, 1));
  }
}

}  // namespace

ScratchFile::ScratchFile(const std::string& folder) {
  std::string name =
      (folder.empty() ? std::filesystem::temp_directory_path() : std::filesystem::path(folder)) /
      "oblique-XXXXXX";
  descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (descriptor_ < 0) {
    throw std::runtime_error(
        fmt::format("no temporary file can be made as {}: {}", name, std::strerror(errno)));
  }
  ::unlink(name.c_str());
}

ScratchFile::~ScratchFile() {
  ::close(descriptor_);
}

void ScratchFile::append(std::string_view bytes) {
  held_ += bytes;
  if (held_.size() >= kBlock) {
    flush();
  }
}

void ScratchFile::flush() {
  write_all(descriptor_, held_, "a temporary file");
  bytes_ += held_.size();
  held_.clear();
}

void ScratchFile::read(std::size_t unit, const std::function<void(std::string_view)>& take) {
  flush();
  std::string block(kBlock / unit * unit, '\0');
  for (std::uint64_t at = 0; at < bytes_;) {
    const auto wanted = std::min<std::uint64_t>(block.size(), bytes_ - at);
    std::size_t got = 0;
    while (got < wanted) {
      const ssize_t more =
          ::pread(descriptor_, block.data() + got, wanted - got, static_cast<off_t>(at + got));
      if (more <= 0 && errno != EINTR) {
        throw std::runtime_error(
            fmt::format("a temporary file cannot be read: {}", std::strerror(errno)));
      }
      got += static_cast<std::size_t>(std::max<ssize_t>(more, 0));
    }
    take(std::string_view(block).substr(0, got));
    at += got;
  }
}

void NpyColumn::put(std::int64_t value) {
  values_->append(bytes_of(value));
}

void NpyColumn::put(double value) {
  values_->append(bytes_of(value));
}

void NpyColumn::put(std::string_view text) {
  std::uint64_t characters = 0;
  for_each_character(text, [&characters](char32_t) { ++characters; });
  longest_ = std::max(longest_, characters);
  const auto length = static_cast<std::uint32_t>(text.size());
  values_->append(bytes_of(length));
  values_->append(text);
}

/// Writes what is there again as values of another kind.
void NpyColumn::become(Kind kind) {
  const auto old = std::exchange(values_, std::make_unique<ScratchFile>(folder_));
  const auto put_number = [&](auto number) {
    if (kind == Kind::kReal) {
      put(static_cast<double>(number));
    } else if (static_cast<double>(number) != static_cast<double>(number)) {
      put(std::string_view());
    } else {
      std::string text;
      append_number(text, number);
      put(std::string_view(text));
    }
  };
  switch (std::exchange(kind_, kind)) {
    case Kind::kNull:
      for (std::uint64_t row = 0; row < rows_; ++row) {
        put_number(kNull);
      }
      break;
    case Kind::kInteger:
      for_each_number<std::int64_t>(*old, put_number);
      break;
    case Kind::kReal:
      for_each_number<double>(*old, put_number);
      break;
    case Kind::kText:
      break;
  }
}

void NpyColumn::add(const Cell& cell) {
  const bool is_first = rows_ == 0;
  if (cell.kind == CellKind::kText && kind_ != Kind::kText) {
    become(Kind::kText);
  } else if (cell.kind == CellKind::kInteger && kind_ == Kind::kNull) {
    become(is_first ? Kind::kInteger : Kind::kReal);
  } else if ((cell.kind == CellKind::kReal && (kind_ == Kind::kNull || kind_ == Kind::kInteger)) ||
             (cell.kind == CellKind::kNull && kind_ == Kind::kInteger)) {
    become(Kind::kReal);
  }
  ++rows_;
  const bool is_integer = cell.kind == CellKind::kInteger;
  const bool is_null = cell.kind == CellKind::kNull;
  switch (kind_) {
    case Kind::kNull:
      break;
    case Kind::kInteger:
      put(cell.integer);
      break;
    case Kind::kReal:
      put(is_null ? kNull : is_integer ? static_cast<double>(cell.integer) : cell.real);
      break;
    case Kind::kText: {
      std::string text;
      if (cell.kind == CellKind::kText) {
        text = cell.text;
      } else if (is_integer) {
        append_number(text, cell.integer);
      } else if (!is_null) {
        append_number(text, cell.real);
      }
      put(std::string_view(text));
      break;
    }
  }
}

/// A column of nothing but NULL, or of nothing, is of its usual kind, as far as that has NULL.
NpyColumn::Kind NpyColumn::kind_in_file() const {
  if (kind_ != Kind::kNull) {
    return kind_;
  }
  return usual_ == CellKind::kText                    ? Kind::kText
         : usual_ == CellKind::kInteger && rows_ == 0 ? Kind::kInteger
                                                      : Kind::kReal;
}

std::uint64_t NpyColumn::item_bytes() const {
  return kind_in_file() == Kind::kText ? longest_ * sizeof(char32_t) : sizeof(double);
}

std::string NpyColumn::header() const {
  const Kind kind = kind_in_file();
  const std::string type = kind == Kind::kText      ? fmt::format("U{}", longest_)
                           : kind == Kind::kInteger ? "i8"
                                                    : "f8";
  std::uint64_t rows = rows_;
  std::string row_shape;
  for (const std::uint64_t size : row_shape_) {
    rows /= size;
    row_shape += fmt::format(" {},", size);
  }
  std::string words = fmt::format("{{'descr': '{}{}', 'fortran_order': False, 'shape': ({},{}), }}",
                                  kOrder, type, rows, row_shape);
  // Magic, version and length before; all of it a multiple of 64, ended by a line feed.
  constexpr std::size_t kBefore = 10;
  constexpr std::size_t kAlignment = 64;
  const std::size_t whole = (kBefore + words.size() + kAlignment) / kAlignment * kAlignment;
  words.resize(whole - kBefore - 1, ' ');
  words += '\n';
  const std::size_t length = words.size();
  return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(length & 0xffU) +
         static_cast<char>(length >> 8U) + words;
}

std::uint64_t NpyColumn::bytes_in_all() {
  return header().size() + rows_ * item_bytes();
}

void NpyColumn::write_texts(const std::function<void(std::string_view)>& take) {
  std::string length;  // of the text under way, as far as it was read
  std::string text;
  std::string item;
  std::uint64_t left = 0;  // bytes of the text
  const auto end_text = [&] {
    for_each_character(text, [&item](char32_t code) { item += bytes_of(code); });
    item.resize(item_bytes(), '\0');
    take(item);
    item.clear();
    text.clear();
    length.clear();
  };
  values_->read(1, [&](std::string_view block) {
    while (!block.empty()) {
      if (length.size() < sizeof(std::uint32_t)) {
        length += block.front();
        block.remove_prefix(1);
        left = length.size() == sizeof(std::uint32_t) ? number_at<std::uint32_t>(length) : 1;
      } else {
        const auto part = std::min<std::uint64_t>(left, block.size());
        text += block.substr(0, part);
        block.remove_prefix(part);
        left -= part;
      }
      if (left == 0) {
        end_text();
      }
    }
  });
}

void NpyColumn::write(const std::function<void(std::string_view)>& take) {
  if (longest_ > kLongestText) {
    throw solver::InputError(
        fmt::format("a text of {} characters is too long for --format npz, where each takes as "
                    "much as the longest (at most {}): leave it out with --select",
                    longest_, kLongestText));
  }
  take(header());
  if (kind_ == Kind::kText) {
    write_texts(take);
  } else if (values_ != nullptr) {
    values_->read(sizeof(double), take);
  } else {
    const bool is_text = kind_in_file() == Kind::kText;
    const std::string nothing =
        is_text ? std::string(item_bytes(), '\0') : std::string(bytes_of(kNull));
    for (std::uint64_t row = 0; row < rows_; ++row) {
      take(nothing);
    }
  }
}

}  // namespace oblique::client
