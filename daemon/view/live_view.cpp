#include "daemon/view/live_view.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/view/page_scene.hpp"
#include "protocol/error.hpp"
#include "protocol/fold_json.hpp"
#include "protocol/json_value.hpp"
#include "protocol/status_json.hpp"

namespace splid::view {
namespace {

constexpr std::size_t longest_message = 1U << 18U;  // a frame has some 1,000 bytes
constexpr std::size_t longest_scene = 1U << 20U;    // some 200 bytes a pixel

// An event of a stream of server-sent events. A line feed would end the data, and none belongs into
// a message.
std::string event(const char* name, std::string data) {
  std::replace_if(
      data.begin(), data.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return std::string("event: ") + name + "\ndata: " + data + "\n\n";
}

std::string number_or_null(const std::optional<double>& value) {
  return value ? fmt::format("{:.7g}", *value) : "null";
}

}  // namespace

LiveView::LiveView(std::string endpoint, const Clock& clock)
    : endpoint_(std::move(endpoint)), clock_(clock), only_(std::make_shared<Track>(clock)) {}

void LiveView::put(LastMessage& last, std::string json) const {
  last.put(std::move(json), clock_.steady_ns());
}

void LiveView::take(const std::string& topic, const std::string& json) {
  if (json.size() > (topic == topic_scene ? longest_scene : longest_message)) {
    ++unread_;
  } else if (topic == topic_frame) {
    take_frame(json);
  } else if (topic == topic_scene) {
    take_scene(json);
  } else if (topic.starts_with(pixel_topic(""))) {
    take_pixel(topic.substr(pixel_topic("").size()), json);
  } else if (topic == topic_status || topic == topic_version || topic == topic_fold) {
    const auto message = json_value_if_any(json);
    if (!message.is_object()) {
      ++unread_;
      return;
    }
    const auto fill = message.find("ring_fill_ratio");
    if (fill != message.end() && fill->is_number()) ring_fill_ratio_ = fill->get<double>();
    put(topic == topic_status ? status_ : topic == topic_version ? version_ : fold_, json);
  }
}

void LiveView::take_frame(const std::string& json) {
  try {
    const FrameMessage frame = frame_from_json(json);
    forget_scenes();
    only_->take(frame, json, ring_fill_ratio_);
    frames_.add(frame);
  } catch (const Error&) {
    ++unread_;
  }
}

// Of a pixel that a viewer looks at; another of whose topic that is the beginning comes, too.
void LiveView::take_pixel(const std::string& pixel, const std::string& json) {
  const auto found = pixels_.find(pixel);
  if (found == pixels_.end()) return;
  try {
    found->second->take(frame_from_json(json), json, ring_fill_ratio_);
  } catch (const Error&) {
    ++unread_;
  }
}

void LiveView::take_scene(const std::string& json) {
  try {
    const SceneMessage scene = scene_from_json(json);
    if (only_->frame().number > 0) only_ = std::make_shared<Track>(clock_);
    past_.add(scene, clock_.steady_ns());
    const std::string layout = layout_json(scene.pixels);
    if (layout != layout_.json) put(layout_, layout);
    put(picture_, picture_json(scene));
    for (const auto& [name, track] : pixels_) {
      const auto frame = past_.last_of(name);
      if (frame) track->take_from_scene(*frame, ring_fill_ratio_);
    }
  } catch (const Error&) {
    ++unread_;
  }
}

// The daemon has one pixel now.
void LiveView::forget_scenes() {
  if (past_.empty()) return;
  past_.forget();
  put(layout_, "null");
  put(picture_, "null");
}

void LiveView::look_at(const std::string& pixel, Cursor& cursor) {
  std::erase_if(pixels_, [](const auto& entry) { return entry.second.use_count() == 1; });
  std::shared_ptr<Track>& track = pixels_[pixel];
  if (!track) {
    track = std::make_shared<Track>(clock_);
    track->begin(past_, pixel);
  }
  cursor.pixel = track;
}

std::vector<std::string> LiveView::looked_at() const {
  std::vector<std::string> names;
  for (const auto& [name, track] : pixels_) {
    if (track.use_count() > 1) names.push_back(name);
  }
  return names;
}

std::optional<std::string> LiveView::frames_csv(const std::string& pixel, double from_s,
                                                double to_s) const {
  return past_.empty() ? frames_.csv(from_s, to_s) : past_.csv(pixel, from_s, to_s);
}

void LiveView::set_connection(const std::string& trouble) {
  if (trouble == trouble_) return;
  trouble_ = trouble;
  ++page_;
}

void LiveView::set_web(const Web& web) {
  if (web == web_) return;
  web_ = web;
  ++page_;
}

LiveView::Cursor LiveView::cursor(std::int64_t seconds) {
  Cursor cursor;
  cursor.window = Track::window_of(seconds);
  return cursor;
}

// Without a choice among several there is an empty track.
std::shared_ptr<const Track> LiveView::track_of(const Cursor& cursor) const {
  return past_.empty() || !cursor.pixel ? only_ : cursor.pixel;
}

bool LiveView::has_news(const Cursor& cursor) const {
  const auto track = track_of(cursor);
  return track != cursor.track || !cursor.has_bins ||
         cursor.change != track->history(cursor.window).change() ||
         cursor.frame != track->frame().number || cursor.status != status_.number ||
         cursor.version != version_.number || cursor.page != page_ ||
         cursor.layout != layout_.number || cursor.picture != picture_.number ||
         (cursor.wants_fold && cursor.fold != fold_.number);
}

std::string LiveView::page_json() const {
  const nlohmann::json page{{"endpoint", endpoint_},
                            {"trouble", trouble_},
                            {"viewers", web_.viewers},
                            {"refused", web_.refused},
                            {"unread_messages", unread_}};
  return json_text(page);
}

std::string LiveView::bins_json(const Track& track, const Cursor& cursor) {
  const History& history = track.history(cursor.window);
  const bool anew = !cursor.has_bins || cursor.epoch != history.epoch();
  const History& last_minute = track.last_minute();
  return fmt::format(
      R"({{"anew":{},"window_s":{:g},"width_s":{:g},"best":{{"count_rate":{},"signal_rate":{},"sbr":{}}},"rows":{}}})",
      anew, history.window_s(), history.width_s(),
      number_or_null(last_minute.best(Series::count_rate)),
      number_or_null(last_minute.best(Series::signal_rate)),
      number_or_null(last_minute.best(Series::sbr)), history.rows_after(anew ? 0 : cursor.change));
}

// Of a pixel that the viewer has not looked at before it has nothing yet.
std::string LiveView::track_news(const std::shared_ptr<const Track>& track, Cursor& cursor) {
  if (cursor.track != track) {
    cursor.track = track;
    cursor.has_bins = false;
    cursor.frame = 0;
  }
  std::string out;
  const LastMessage& frame = track->frame();
  if (cursor.frame == 0 && frame.number > 0) out += event("past", track->past_json());
  const History& history = track->history(cursor.window);
  if (!cursor.has_bins || cursor.change != history.change()) {
    out += event("bins", bins_json(*track, cursor));
  }
  cursor.has_bins = true;
  cursor.change = history.change();
  cursor.epoch = history.epoch();
  if (cursor.frame != frame.number) out += event("frame", frame.json);
  cursor.frame = frame.number;
  return out;
}

std::string LiveView::news(Cursor& cursor) const {
  std::string out;
  const auto add = [&](const char* name, const LastMessage& last, std::uint64_t& seen) {
    if (last.number != seen) out += event(name, last.json);
    seen = last.number;
  };
  if (cursor.page != page_) out += event("page", page_json());
  cursor.page = page_;
  add("version", version_, cursor.version);
  add("status", status_, cursor.status);
  add("layout", layout_, cursor.layout);
  add("picture", picture_, cursor.picture);
  out += track_news(track_of(cursor), cursor);
  if (cursor.wants_fold) add("fold", fold_, cursor.fold);
  return out;
}

}  // namespace splid::view
