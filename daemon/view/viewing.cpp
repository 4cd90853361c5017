#include "daemon/view/viewing.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "config/endpoint.hpp"
#include "daemon/base/clock.hpp"
#include "protocol/fold_json.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/scene_json.hpp"
#include "protocol/status_json.hpp"

namespace splid::view {
namespace {

// Of a replay at full speed a part is lost rather than memory without bound; the frames'
// `sequence` tells.
constexpr int most_waiting = 10'000;

}  // namespace

std::string who_can_read(const std::string& address) {
  const std::string http = with_host(address);
  if (is_on_this_machine("tcp://" + http)) return {};
  return "everybody who reaches " + http +
         " over the network can read what is measured: the page asks for no password and is not "
         "encrypted. With --http 127.0.0.1:9874 only this machine can";
}

Viewing::Viewing(std::string endpoint, const std::string& http,
                 std::optional<security::CurveClient> client)
    : endpoint_(std::move(endpoint)),
      client_(std::move(client)),
      subscriber_(endpoint_, {topic_frame, topic_scene, topic_status, topic_version}, client_,
                  most_waiting),
      view_(endpoint_, host_clock()),
      server_(with_host(http), view_, host_clock()) {}

void Viewing::run(const std::stop_token& stop, const HearState& hear) {
  while (!stop.stop_requested()) {
    subscriber_.wait(server_.descriptor(), server_.patience());
    take_messages();
    look_at_connection(hear);
    view_.set_web(server_.counts());
    server_.run();
    ask_for_fold();
    ask_for_pixels();
  }
}

// As many as came, up to what takes some milliseconds: browsers are not kept waiting. Of scenes
// that come faster than they can be read, which are large and of which 10,000 would wait, a part is
// lost.
void Viewing::take_messages() {
  constexpr int most_at_once = 200;
  constexpr std::int64_t longest_ns = 20'000'000;
  const std::int64_t begin_ns = host_clock().steady_ns();
  for (int i = 0; i < most_at_once; ++i) {
    const auto message = subscriber_.receive(std::chrono::milliseconds{0});
    if (!message) return;
    const bool is_late = host_clock().steady_ns() - begin_ns > longest_ns;
    if (message->topic == topic_scene && is_late) continue;
    view_.take(message->topic, message->json);
  }
}

// The daemon makes the pictures of the photons only while somebody looks at them.
void Viewing::ask_for_fold() {
  const bool is_wanted = server_.fold_is_wanted();
  if (is_wanted == hears_fold_) return;
  hears_fold_ = is_wanted;
  if (is_wanted) {
    subscriber_.subscribe(topic_fold);
  } else {
    subscriber_.unsubscribe(topic_fold);
    view_.forget_fold();
  }
}

// A pixel's frames have more values than the scene, and nobody else may need them.
void Viewing::ask_for_pixels() {
  std::vector<std::string> pixels = view_.looked_at();
  if (pixels == heard_pixels_) return;
  const auto without = [](const std::vector<std::string>& all,
                          const std::vector<std::string>& others) {
    std::vector<std::string> rest;
    std::set_difference(all.begin(), all.end(), others.begin(), others.end(),
                        std::back_inserter(rest));
    return rest;
  };
  for (const std::string& pixel : without(pixels, heard_pixels_)) {
    subscriber_.subscribe(pixel_topic(pixel));
  }
  for (const std::string& pixel : without(heard_pixels_, pixels)) {
    subscriber_.unsubscribe(pixel_topic(pixel));
  }
  heard_pixels_ = std::move(pixels);
}

void Viewing::look_at_connection(const HearState& hear) {
  const State state = subscriber_.state();
  if (state == said_) return;
  said_ = state;
  const std::string words = in_words(state, endpoint_, client_ ? &*client_ : nullptr);
  view_.set_connection(state == State::connected ? "" : words);
  hear(state, words);
}

}  // namespace splid::view
