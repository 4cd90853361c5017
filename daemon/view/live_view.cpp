#include "daemon/view/live_view.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "protocol/error.hpp"
#include "protocol/fold_json.hpp"
#include "protocol/json_value.hpp"
#include "protocol/status_json.hpp"

namespace splid::view {
namespace {

constexpr std::array<double, 6> windows_s{10, 30, 60, 300, 900, 3600};
constexpr std::size_t minute = 2;                   // the index of 60 s
constexpr std::size_t longest_message = 1U << 18U;  // a frame has some 1,000 bytes

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
    : endpoint_(std::move(endpoint)), clock_(clock) {
  for (const double window_s : windows_s) histories_.emplace_back(window_s);
}

void LiveView::put(Last& last, std::string json) const {
  last.json = std::move(json);
  ++last.number;
  last.came_ns = clock_.steady_ns();
}

double LiveView::age_s(const Last& last) const {
  return static_cast<double>(clock_.steady_ns() - last.came_ns) * 1e-9;
}

void LiveView::take(const std::string& topic, const std::string& json) {
  if (json.size() > longest_message) {
    ++unread_;
  } else if (topic == topic_frame) {
    take_frame(json);
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
    for (History& history : histories_) history.add(frame, ring_fill_ratio_);
    frames_.add(frame);
    put(frame_, json);
    if (frame.valid()) put(valid_, json);
  } catch (const Error&) {
    ++unread_;
  }
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
  const auto* at =
      std::lower_bound(windows_s.begin(), windows_s.end(), static_cast<double>(seconds));
  Cursor cursor;
  cursor.window =
      std::min<std::size_t>(static_cast<std::size_t>(at - windows_s.begin()), windows_s.size() - 1);
  return cursor;
}

bool LiveView::has_news(const Cursor& cursor) const {
  const History& history = histories_.at(cursor.window);
  return !cursor.has_bins || cursor.change != history.change() || cursor.frame != frame_.number ||
         cursor.status != status_.number || cursor.version != version_.number ||
         cursor.page != page_ || (cursor.wants_fold && cursor.fold != fold_.number);
}

std::string LiveView::page_json() const {
  const nlohmann::json page{{"endpoint", endpoint_},
                            {"trouble", trouble_},
                            {"viewers", web_.viewers},
                            {"refused", web_.refused},
                            {"unread_messages", unread_}};
  return json_text(page);
}

// How old the last frame is, and the last valid one with it.
std::string LiveView::past_json() const {
  std::string json = fmt::format(R"({{"frame_age_s":{:.3f})", age_s(frame_));
  if (valid_.number > 0) {
    json += fmt::format(R"(,"valid_age_s":{:.3f},"valid":{})", age_s(valid_), valid_.json);
  }
  return json + "}";
}

std::string LiveView::bins_json(const History& history, const Cursor& cursor) const {
  const bool anew = !cursor.has_bins || cursor.epoch != history.epoch();
  const History& last_minute = histories_.at(minute);
  return fmt::format(
      R"({{"anew":{},"window_s":{:g},"width_s":{:g},"best":{{"count_rate":{},"signal_rate":{},"sbr":{}}},"rows":{}}})",
      anew, history.window_s(), history.width_s(),
      number_or_null(last_minute.best(Series::count_rate)),
      number_or_null(last_minute.best(Series::signal_rate)),
      number_or_null(last_minute.best(Series::sbr)), history.rows_after(anew ? 0 : cursor.change));
}

std::string LiveView::news(Cursor& cursor) const {
  std::string out;
  const auto add = [&](const char* name, const Last& last, std::uint64_t& seen) {
    if (last.number != seen) out += event(name, last.json);
    seen = last.number;
  };
  if (cursor.page != page_) out += event("page", page_json());
  cursor.page = page_;
  if (cursor.frame == 0 && frame_.number > 0) out += event("past", past_json());
  add("version", version_, cursor.version);
  add("status", status_, cursor.status);
  const History& history = histories_.at(cursor.window);
  if (!cursor.has_bins || cursor.change != history.change()) {
    out += event("bins", bins_json(history, cursor));
  }
  cursor.has_bins = true;
  cursor.change = history.change();
  cursor.epoch = history.epoch();
  add("frame", frame_, cursor.frame);
  if (cursor.wants_fold) add("fold", fold_, cursor.fold);
  return out;
}

}  // namespace splid::view
