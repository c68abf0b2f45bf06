#include "server/loop/shown_web.h"

#include <stdexcept>
#include <string>
#include <utility>

#include <spdlog/spdlog.h>

namespace oblique::server {

std::unique_ptr<Web> web_of(const LoopSettings& settings) {
  if (!settings.web) {
    return nullptr;
  }
  WebSettings web = *settings.web;
  web.database = settings.database;
  web.solver_version = settings.service.solver_version;
  try {
    return std::make_unique<Web>(std::move(web));
  } catch (const std::runtime_error& error) {
    const std::string what =
        std::string(error.what()) + " (--http names another address, or \"off\")";
    if (!settings.web->may_be_missing) {
      throw std::runtime_error(what);
    }
    spdlog::warn("no metrics over HTTP: {}", what);
    return nullptr;
  }
}

}  // namespace oblique::server
