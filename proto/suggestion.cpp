#include "proto/suggestion.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <numeric>
#include <vector>

#include "proto/text.h"

namespace oblique::protocol {
namespace {

char lower(char letter) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
}

// Levenshtein's distance, one row of its table at a time.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (lower(a[i]) == lower(b[j]) ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string_view nearest(std::string_view word, std::span<const std::string_view> candidates) {
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(1, word.size() / 2) + 1;
  for (const auto candidate : candidates) {
    // The distance is at least the difference of the lengths.
    if (word.size() >= candidate.size() + best_distance) {
      continue;
    }
    const std::size_t candidate_distance = distance(word, candidate);
    // A candidate that shares no letter with the word is no suggestion.
    if (candidate_distance < best_distance &&
        candidate_distance < std::max(word.size(), candidate.size())) {
      best_distance = candidate_distance;
      best = candidate;
    }
  }
  return best;
}

std::string did_you_mean(std::string_view word, std::span<const std::string_view> candidates) {
  const auto best = nearest(word, candidates);
  return best.empty() ? std::string() : " (did you mean `" + std::string(best) + "`?)";
}

std::string unknown_key(std::string_view name, std::span<const std::string_view> known) {
  return "unknown key `" + excerpt(name) + "`" + did_you_mean(name, known);
}

std::string joined(std::span<const std::string_view> names) {
  std::string text;
  for (const auto name : names) {
    text += text.empty() ? "" : ", ";
    text += name;
  }
  return text;
}

}  // namespace oblique::protocol
