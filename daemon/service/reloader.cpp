#include "daemon/service/reloader.hpp"

#include <spdlog/spdlog.h>

#include <new>
#include <utility>
#include <vector>

#include "daemon/service/reload.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

std::string joined(const std::vector<std::string>& pointers) {
  std::string text;
  for (const std::string& pointer : pointers) text += (text.empty() ? "" : ", ") + pointer;
  return text;
}

}  // namespace

Reloader::Reloader(const Config& original, DeviceMonitor& device, StopSignals* signals, Apply apply)
    : original_(original), device_(device), signals_(signals), apply_(std::move(apply)) {
  if (signals_ != nullptr) signals_->on_hangup([this] { reload(); });
}

Reloader::~Reloader() {
  if (signals_ != nullptr) signals_->on_hangup(nullptr);
}

void Reloader::reload() {
  notifier_.reloading();
  try {
    auto next = std::make_shared<const Config>(load_config(original_.file));
    const ConfigChanges since_start = changes_between(original_, *next);
    const ConfigChanges now = changes_between(in_use_ ? *in_use_ : original_, *next);
    const std::string besides = apply_(next, !now.live.empty());
    in_use_ = std::move(next);
    std::string what = joined(now.live);
    if (!besides.empty()) what += (what.empty() ? "" : "; ") + besides;
    say(true, "reloaded " + original_.file + ": " + (what.empty() ? "nothing new" : what));
    if (!since_start.restart.empty()) {
      say(false, "takes a restart: " + joined(since_start.restart));
    }
  } catch (const std::bad_alloc&) {
    say(false, "not reloaded, going on as before: there is not enough memory");
  } catch (const Error& error) {
    say(false, std::string("not reloaded, going on as before: ") + error.what());
  }
  notifier_.reloaded();
}

void Reloader::say(bool well, const std::string& sentence) {
  spdlog::log(well ? spdlog::level::info : spdlog::level::warn, "{}", sentence);
  device_.notice(sentence);
}

}  // namespace splid
