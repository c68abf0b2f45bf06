#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto/program/completion/typed.h"

namespace oblique::protocol {

/// One thing that the word may become.
struct Offer {
  std::string value;    ///< of the whole word; begins with what was typed
  std::string shown;    ///< the part of it that matters, as the last column of a list
  std::string meaning;  ///< one line; may be empty
};

/// Names of files, which shells know best.
struct FileNames {
  std::string ending;        ///< those that end so come first, as "toml"; empty: any
  bool are_folders = false;  ///< folders alone
};

/// All that the word may become.
struct Offers {
  std::vector<Offer> offers;
  bool goes_on = false;  ///< what is taken may be written on: no space follows
  std::optional<FileNames> files = {};
};

/// What a value may be where the options themselves do not tell; nothing: they do.
using ValuesOf = std::function<std::optional<Offers>(const Typed& typed)>;

/// Verbs, flags, choices that were noted (choices.h), names of files where the type of an option is
/// FILE or DIR, and what `values` gives.
Offers offers_for(const Typed& typed, const ValuesOf& values = {});

/// Makes `offers.offers` from values of the one that is typed, keeping those that begin so.
void offer_value(Offers& offers, const Typed& typed, const std::string& value,
                 const std::string& meaning = {});

}  // namespace oblique::protocol
