#include "daemon/service/reloader.hpp"

#include <pthread.h>

#include <exception>
#include <new>
#include <utility>
#include <vector>

#include "daemon/base/log.hpp"
#include "daemon/service/reload.hpp"

namespace splid {
namespace {

std::string joined(const std::vector<std::string>& pointers) {
  std::string text;
  for (const std::string& pointer : pointers) text += (text.empty() ? "" : ", ") + pointer;
  return text;
}

}  // namespace

Reloader::Reloader(const Config& original, DeviceMonitor& device, StopSignals* signals, Apply apply)
    : original_(original),
      device_(device),
      signals_(signals),
      apply_(std::move(apply)),
      readers_(original.security.allow_list),
      controllers_(original.control.allow_list) {
  if (signals_ == nullptr) return;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  signals_->on_hangup([this] {
    const std::scoped_lock lock(mutex_);
    asked_ = true;
    changed_.notify_all();
  });
}

Reloader::~Reloader() {
  if (signals_ != nullptr) signals_->on_hangup(nullptr);
}

// Several signals while a reload is under way are one.
void Reloader::run(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "reload");
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return asked_; }) && !stop.stop_requested()) {
    asked_ = false;
    lock.unlock();
    reload();
    lock.lock();
  }
}

void Reloader::reload() {
  notifier_.reloading();
  try {
    auto next = std::make_shared<const Config>(load_config(original_.file));
    for (const std::string& note : next->notes) log_warning(note);
    const ConfigChanges since_start = changes_between(original_, *next, original_);
    ConfigChanges now = changes_between(in_use_ ? *in_use_ : original_, *next, original_);
    const std::string& readers = next->security.allow_list;
    const std::string& controllers = next->control.allow_list;
    if (readers == readers_) std::erase(now.live, "/security/allow_list");
    if (controllers == controllers_) std::erase(now.live, "/control/allow_list");
    const std::string besides = apply_(next, !now.live.empty());
    if (!readers.empty()) readers_ = readers;
    if (!controllers.empty()) controllers_ = controllers;
    in_use_ = std::move(next);
    std::string what = joined(now.live);
    if (!besides.empty()) what += (what.empty() ? "" : "; ") + besides;
    std::string sentence =
        "reloaded " + original_.file + ": " + (what.empty() ? "nothing new" : what);
    log_info(sentence);
    // The earlier refusal ends before the notice is given, since a status may go out between the
    // two.
    refuse(since_start.restart.empty() ? "" : "takes a restart: " + joined(since_start.restart));
    device_.notice(sentence);
  } catch (const std::bad_alloc&) {
    refuse("not reloaded, going on as before: there is not enough memory");
  } catch (const std::exception& error) {
    refuse(std::string("not reloaded, going on as before: ") + error.what());
  }
  notifier_.reloaded();
}

// Tells which part of the file is not in use, and why; an empty sentence says that all of it is.
void Reloader::refuse(const std::string& sentence) {
  if (!sentence.empty()) log_warning(sentence);
  device_.set_configuration_fault(sentence);
}

}  // namespace splid
