#include "server/web/page/page_files.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>
#include <vector>

#include <zlib.h>

namespace oblique::server {
namespace {

constexpr unsigned kFound = 200;
constexpr unsigned kNotModified = 304;

/// For the few who do not take what is gzipped.
std::string unpacked(std::span<const unsigned char> gzipped) {
  constexpr int kGzip = 16 + MAX_WBITS;
  z_stream stream{};
  if (inflateInit2(&stream, kGzip) != Z_OK) {
    throw std::runtime_error("no memory to unpack a file of the page");
  }
  stream.next_in = const_cast<unsigned char*>(gzipped.data());  // it only reads it
  stream.avail_in = static_cast<unsigned>(gzipped.size());
  std::string text;
  std::vector<unsigned char> some(std::size_t{64} * 1024);
  int said = Z_OK;
  while (said == Z_OK) {
    stream.next_out = some.data();
    stream.avail_out = static_cast<unsigned>(some.size());
    said = inflate(&stream, Z_NO_FLUSH);
    text.append(some.begin(), some.end() - static_cast<std::ptrdiff_t>(stream.avail_out));
  }
  inflateEnd(&stream);
  return text;
}

/// Null: there is none.
const PageFile* file_at(std::string_view path) {
  const auto files = page_files();
  const auto file = std::find_if(files.begin(), files.end(), [&](const PageFile& f) {
    return f.path == (path == "/" ? "/index.html" : path);
  });
  return file == files.end() ? nullptr : &*file;
}

}  // namespace

bool is_page_file(std::string_view path) {
  return file_at(path) != nullptr;
}

std::optional<HttpAnswer> file_answer(const HttpQuestion& question) {
  const PageFile* const file = file_at(question.path);
  if (file == nullptr) {
    return std::nullopt;
  }
  // The browser keeps it, and asks each time whether it is still the same.
  HttpAnswer answer{kFound,
                    std::string(file->content_type),
                    {},
                    {{"ETag", std::string(file->tag)},
                     {"Cache-Control", "no-cache"},
                     {"Vary", "Accept-Encoding"}}};
  if (question.known_tag.find(file->tag) != std::string::npos) {
    answer.status = kNotModified;
  } else if (question.takes_gzip) {
    answer.body.assign(file->gzipped.begin(), file->gzipped.end());
    answer.headers.emplace_back("Content-Encoding", "gzip");
  } else {
    answer.body = unpacked(file->gzipped);
  }
  return answer;
}

}  // namespace oblique::server
