#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/base/clock.hpp"
#include "daemon/view/frame_table.hpp"
#include "daemon/view/scene_past.hpp"
#include "daemon/view/track.hpp"

// The room daemon/view shows people what a daemon publishes. Read this header first. For the page
// in a browser Viewing (viewing.hpp) hears the daemon's messages, LiveView in this header keeps
// what the page can show, and WebServer (web_server.hpp) serves it. The picture in a terminal is
// WatchPicture (watch_picture.hpp).

namespace splid::view {

// All that the live page can show: the daemon's last messages as they came, and the history of the
// values; of several pixels the last scenes, and the histories of those pixels that viewers look
// at. Its size does not grow with time.
//
// Threads: one. Errors: none.
class LiveView {
 public:
  // endpoint: which daemon is shown. clock: outlives this.
  LiveView(std::string endpoint, const Clock& clock);

  // Takes one message of the topics frame, frame/NAME, scene, fold, status and version. A message
  // that cannot be read, or is larger than any that a daemon sends, is counted and passed over.
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
    std::size_t window = 0;              // index of its history
    std::shared_ptr<const Track> pixel;  // which of several it wants; null: none
    std::shared_ptr<const Track> track;  // what the counts up to `frame` are of
    std::uint64_t epoch = 0, change = 0;
    bool has_bins = false;
    std::uint64_t frame = 0;
    std::uint64_t status = 0, version = 0, page = 0, fold = 0, layout = 0, picture = 0;
    bool wants_fold = false;  // the pictures of the topic fold too
  };
  // Of a viewer that has nothing yet. seconds: what it wants to see; the shortest history that has
  // it is taken, or the longest.
  [[nodiscard]] static Cursor cursor(std::int64_t seconds);
  // The viewer looks at this pixel, as long as there is a copy of its cursor. A daemon of one pixel
  // shows that all the same.
  void look_at(const std::string& pixel, Cursor& cursor);
  // The pixels that viewers look at, whose topics are to be heard.
  [[nodiscard]] std::vector<std::string> looked_at() const;
  [[nodiscard]] bool has_news(const Cursor& cursor) const;
  // The frames that came last, as a table: see FrameTable::csv(). pixel: which of several.
  [[nodiscard]] std::optional<std::string> frames_csv(const std::string& pixel, double from_s,
                                                      double to_s) const;
  // What the viewer has not got, as server-sent events; afterwards it has got all. A viewer that
  // fell behind gets the last of each message and the bins that changed: what is older is dropped.
  std::string news(Cursor& cursor) const;

  [[nodiscard]] std::uint64_t unread() const { return unread_; }

 private:
  void put(LastMessage& last, std::string json) const;
  void take_frame(const std::string& json);
  void take_pixel(const std::string& pixel, const std::string& json);
  void take_scene(const std::string& json);
  void forget_scenes();
  [[nodiscard]] std::shared_ptr<const Track> track_of(const Cursor& cursor) const;
  [[nodiscard]] std::string page_json() const;
  static std::string bins_json(const Track& track, const Cursor& cursor);
  static std::string track_news(const std::shared_ptr<const Track>& track, Cursor& cursor);

  std::string endpoint_;
  const Clock& clock_;
  std::string trouble_;
  Web web_;
  std::uint64_t unread_ = 0;
  double ring_fill_ratio_ = 0;
  LastMessage fold_, status_, version_;
  LastMessage layout_, picture_;  // of the last scene
  std::uint64_t page_ = 1;
  std::shared_ptr<Track> only_;  // where the daemon has one pixel
  FrameTable frames_;            // of that
  ScenePast past_;
  std::map<std::string, std::shared_ptr<Track>> pixels_;  // that viewers look at or have looked at
};

}  // namespace splid::view
