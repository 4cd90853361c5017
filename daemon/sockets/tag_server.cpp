#include "daemon/sockets/tag_server.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <iterator>
#include <utility>

namespace splid::sockets {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::steady_clock;

// Design note: 256 KiB stay in the second-level cache from the decoder to the socket, and a block
// of them costs nothing beside its tags.
constexpr std::size_t tags_a_block = 16'384;
constexpr std::size_t block_bytes = Tags16Decoder::header_bytes +
                                    tags_a_block * Tags16Decoder::tag_bytes +
                                    Tags16Encoder::least_room;
constexpr std::size_t most_waiting = 128;  // blocks, 32 MiB of full ones

// A client takes a second without a block for a fault, and 200 ms without a tag or heartbeat for a
// silent instrument.
constexpr nanoseconds between_signs = milliseconds{50};
constexpr std::size_t most_sayings = 8;

std::int64_t now_ns() { return nanoseconds(steady_clock::now().time_since_epoch()).count(); }

// unix:PATH and tcp:HOST:PORT as endpoints.
std::string endpoint_at(const std::string& address) {
  const std::size_t colon = address.find(':');
  const std::string place = address.substr(colon + 1);
  return (address.starts_with("unix:") ? "ipc://" : "tcp://") + place;
}

}  // namespace

TagServer::TagServer(const std::string& key, const std::string& address)
    : listener_(key, endpoint_at(address), address), room_(tags_a_block) {
  thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
}

TagServer::~TagServer() {
  thread_.request_stop();
  wake_.notify();
}

std::span<Tag> TagServer::claim(std::size_t max_count) {
  return std::span(room_).first(std::clamp<std::size_t>(max_count, 1, room_.size()));
}

void TagServer::publish(std::size_t count) {
  const std::int64_t now = now_ns();
  published_ns_ = now;
  const bool tells = tell();
  if (count == 0 && !tells && now - sent_ns_ < between_signs.count()) return;
  std::span<const Tag> tags = std::span(room_).first(count);
  do {
    Block block = take_room();
    const auto done = encoder_.encode(tags, block.bytes);
    tags = tags.subspan(done.tags);
    block.size = done.bytes;
    block.sent = 0;
    std::unique_lock lock(mutex_);
    if (!queue(std::move(block), lock)) continue;
    sent_ns_ = now;
    lock.unlock();
    wake_.notify();
  } while (!tags.empty());
}

// Has the encoder say what is to be told; false where there is nothing.
bool TagServer::tell() {
  const std::lock_guard lock(mutex_);
  if (!has_client_) return false;
  const bool is_new = told_clients_ != clients_;
  const bool is_again = std::exchange(tells_again_, false);
  if (is_again || (is_new && (holds_.kind != NoticeKind::caution || !holds_.text.empty()))) {
    encoder_.tell(holds_.kind, holds_.text);
  }
  told_clients_ = clients_;
  for (const Saying& each : sayings_) encoder_.tell(each.kind, each.text);
  const bool tells = is_new || is_again || !sayings_.empty();
  sayings_.clear();
  return tells;
}

void TagServer::report(const DeviceReport& report) {
  Saying holds{NoticeKind::caution, report.caution};
  if (report.state == DeviceState::no_device) holds = {NoticeKind::absent, report.reason};
  if (report.state == DeviceState::failing) holds = {NoticeKind::failing, report.reason};
  const std::lock_guard lock(mutex_);
  const bool is_event = report.state == DeviceState::connected && !report.reason.empty();
  if (is_event) say({NoticeKind::event, report.reason});
  if (holds.kind == holds_.kind && holds.text == holds_.text) return;
  holds_ = holds;
  say(std::move(holds));
}

// A client that comes later hears what then holds, and no events of before.
void TagServer::say(Saying saying) {
  if (!has_client_) return;
  if (sayings_.size() == most_sayings) sayings_.erase(sayings_.begin());
  sayings_.push_back(std::move(saying));
}

// The block that was last used is the likeliest to be in a cache.
TagServer::Block TagServer::take_room() {
  const std::lock_guard lock(mutex_);
  if (spare_.empty()) return {std::vector<std::byte>(block_bytes)};
  Block block = std::move(spare_.back());
  spare_.pop_back();
  return block;
}

// False where the block was dropped.
bool TagServer::queue(Block block, std::unique_lock<std::mutex>& lock) {
  const auto may_go = [this] { return !has_client_ || waiting_.size() < most_waiting; };
  if (!may_go() && !is_stalled_) is_stalled_ = !has_room_.wait_for(lock, patience, may_go);
  if (!has_client_ || waiting_.size() >= most_waiting) {
    spare_.push_back(std::move(block));
    tells_again_ = has_client_;
    return false;
  }
  is_stalled_ = false;
  waiting_.push_back(std::move(block));
  return true;
}

void TagServer::serve(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    bool has_blocks = false;
    {
      const std::lock_guard lock(mutex_);
      has_blocks = !waiting_.empty();
    }
    const short wanted = has_blocks ? POLLOUT | POLLIN : POLLIN;
    std::array<pollfd, 3> entries = {
        {{listener_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}, {client_.get(), wanted, 0}}};
    if (::poll(entries.data(), entries.size(), -1) < 0) continue;
    if (entries[1].revents != 0) wake_.clear();
    if (entries[2].revents != 0) send();
    if (entries[0].revents != 0) accept();
  }
}

void TagServer::accept() {
  FileDescriptor next(::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!next.is_open()) return;
  drop_client();
  client_ = std::move(next);
  const std::lock_guard lock(mutex_);
  has_client_ = true;
  is_stalled_ = false;
  tells_again_ = false;
  ++clients_;
}

// What waits for a client is of no use to the next: it would begin inside a block.
void TagServer::drop_client() {
  client_.reset();
  const std::lock_guard lock(mutex_);
  has_client_ = false;
  std::move(waiting_.begin(), waiting_.end(), std::back_inserter(spare_));
  waiting_.clear();
  has_room_.notify_one();
}

// Sends as much as the client takes. What a client sends is not looked at, but for its end.
void TagServer::send() {
  std::unique_lock lock(mutex_);
  while (!waiting_.empty()) {
    Block& block = waiting_.front();  // a deque's other end leaves it where it is
    lock.unlock();
    const ssize_t sent = ::send(client_.get(), block.bytes.data() + block.sent,
                                block.size - block.sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && (errno == EAGAIN || errno == EINTR)) break;
    if (sent < 0) return drop_client();
    lock.lock();
    block.sent += static_cast<std::size_t>(sent);
    if (block.sent < block.size) continue;
    spare_.push_back(std::move(block));
    waiting_.pop_front();
    has_room_.notify_one();
  }
  if (lock.owns_lock()) lock.unlock();
  std::array<std::byte, 4096> heard;
  const ssize_t got = ::recv(client_.get(), heard.data(), heard.size(), MSG_DONTWAIT);
  if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) drop_client();
}

}  // namespace splid::sockets
