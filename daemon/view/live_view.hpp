#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/base/clock.hpp"
#include "daemon/view/frame_table.hpp"
#include "daemon/view/view_history.hpp"

// The room daemon/view shows people what a daemon publishes. Read this header first. For the page
// in a browser Viewing (viewing.hpp) hears the daemon's messages, LiveView in this header keeps
// what the page can show, and WebServer (web_server.hpp) serves it. The picture in a terminal is
// WatchPicture (watch_picture.hpp).

namespace splid::view {

// All that the live page can show: the daemon's last messages as they came, and the history of the
// values. Its size does not grow with time.
//
// Threads: one. Errors: none.
class LiveView {
 public:
  // endpoint: which daemon is shown. clock: outlives this.
  LiveView(std::string endpoint, const Clock& clock);

  // Takes one message of the topics frame, fold, status and version. A message that cannot be read,
  // or is larger than any that a daemon sends, is counted and passed over.
  void take(const std::string& topic, const std::string& json);

  // Why the daemon cannot be reached, in words; empty: it can.
  void set_connection(const std::string& trouble);
  struct Web {
    std::uint64_t viewers = 0, refused = 0;
    friend bool operator==(const Web&, const Web&) = default;
  };
  void set_web(const Web& web);

  // Nobody looks at the pictures: who asks for them again is not to get old ones.
  void forget_fold() { fold_ = {}; }

  // How much of all this a viewer has got.
  struct Cursor {
    std::size_t window = 0;  // index of its history
    std::uint64_t epoch = 0, change = 0;
    bool has_bins = false;
    std::uint64_t frame = 0, status = 0, version = 0, page = 0, fold = 0;
    bool wants_fold = false;  // the pictures of the topic fold too
  };
  // Of a viewer that has nothing yet. seconds: what it wants to see; the shortest history that has
  // it is taken, or the longest.
  [[nodiscard]] static Cursor cursor(std::int64_t seconds);
  [[nodiscard]] bool has_news(const Cursor& cursor) const;
  // The frames that came last, as a table: see FrameTable::csv().
  [[nodiscard]] std::optional<std::string> frames_csv(double from_s, double to_s) const {
    return frames_.csv(from_s, to_s);
  }
  // What the viewer has not got, as server-sent events; afterwards it has got all. A viewer that
  // fell behind gets the last of each message and the bins that changed: what is older is dropped.
  std::string news(Cursor& cursor) const;

  [[nodiscard]] std::uint64_t unread() const { return unread_; }

 private:
  // A message as it came, the number of its arrival, 0: none came, and when it came.
  struct Last {
    std::string json;
    std::uint64_t number = 0;
    std::int64_t came_ns = 0;
  };
  void put(Last& last, std::string json) const;
  [[nodiscard]] double age_s(const Last& last) const;
  void take_frame(const std::string& json);
  [[nodiscard]] std::string page_json() const;
  [[nodiscard]] std::string past_json() const;
  [[nodiscard]] std::string bins_json(const History& history, const Cursor& cursor) const;

  std::string endpoint_;
  const Clock& clock_;
  std::string trouble_;
  Web web_;
  std::uint64_t unread_ = 0;
  double ring_fill_ratio_ = 0;
  Last frame_, fold_, status_, version_;
  Last valid_;  // the last frame that is valid
  std::uint64_t page_ = 1;
  std::vector<History> histories_;  // shortest first
  FrameTable frames_;
};

}  // namespace splid::view
