#include "daemon/output/publisher.hpp"

#include <pthread.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <thread>
#include <utility>
#include <zmq.hpp>

#include "daemon/base/wake_descriptor.hpp"
#include "daemon/output/outgoing_queue.hpp"
#include "daemon/security/server_security.hpp"
#include "daemon/sockets/gate.hpp"
#include "protocol/fold_json.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/scene_json.hpp"
#include "protocol/status_json.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// The largest message that is taken from a subscriber, who has nothing to say but topics; bytes.
constexpr std::int64_t max_incoming_bytes = 1024;

// Where a pixel's topic begins; who subscribes to this asks for all pixels' frames.
constexpr std::string_view pixel_prefix = "frame/";
constexpr std::size_t most_topic_bytes = 64;

// How many subscriptions are read before messages are sent again.
constexpr int subscriptions_a_turn = 1000;

// New subscribers that come within this time are greeted together.
constexpr milliseconds between_greetings{20};

// More messages than this wait only where the sending thread gets no processor.
constexpr std::size_t least_queue = 1000;

constexpr int heartbeat_interval_ms = 2000;
constexpr int heartbeat_timeout_ms = 6000;
constexpr int handshake_ms = 5000;

bool is_prefix(std::string_view prefix, std::string_view text) {
  return text.substr(0, prefix.size()) == prefix;
}

// An endpoint, and the way from it to the socket.
struct Entrance {
  Entrance(sockets::ListeningSocket listener, zmq::socket_t& socket, bool curve,
           security::Refusals& refusals)
      : door(socket),
        gate(std::move(listener), {door, sockets::subscriber_limits, curve}, refusals,
             host_clock()) {}
  sockets::PrivateDoor door;
  sockets::Gate gate;
};

}  // namespace

class Publisher::Service {
 public:
  Service(const std::string& endpoint, int queue_messages, const Access& access);
  ~Service();
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }
  [[nodiscard]] const std::string& local_endpoint() const { return local_endpoint_; }
  [[nodiscard]] std::size_t dropped() const { return queue_.dropped(); }
  [[nodiscard]] std::string last_status() const {
    const std::scoped_lock lock(mutex_);
    return status_;
  }
  void keep_status(const std::string& json) {
    const std::scoped_lock lock(mutex_);
    status_ = json;
  }
  void push(std::string topic, std::string json) {
    if (queue_.push({std::move(topic), std::move(json)})) wake_.notify();
  }
  [[nodiscard]] bool fold_is_wanted() const { return fold_wanted_.load(std::memory_order_relaxed); }
  std::optional<std::vector<std::string>> pixel_topics(std::uint64_t& known) const {
    if (pixel_topics_version_.load(std::memory_order_relaxed) == known) return std::nullopt;
    const std::scoped_lock lock(mutex_);
    known = pixel_topics_version_.load(std::memory_order_relaxed);
    return std::vector<std::string>(pixel_topics_.begin(), pixel_topics_.end());
  }
  bool wait_for_subscriber(milliseconds timeout) {
    std::unique_lock lock(mutex_);
    return subscribed_.wait_for(lock, timeout, [this] { return frames_wanted_; });
  }

 private:
  void prepare(int queue_messages);
  void open(const std::string& endpoint, const Access& access, security::Refusals& refusals);
  void run();
  void wait() const;
  void read_subscriptions();
  void note_pixel_topic(std::string_view topic, bool subscribes);
  bool send_queued();
  void send(const OutgoingMessage& message);
  void greet();

  security::Refusals nobody_hears_{[](const std::string&) {}, host_clock()};
  security::Authenticator* authenticator_;
  std::optional<Entrance> local_;  // its gate lets the last out when the socket is closed
  std::optional<Entrance> main_;
  std::string endpoint_;
  std::string local_endpoint_;
  zmq::context_t own_context_{1};  // used where there is no authenticator
  zmq::socket_t xpub_;
  OutgoingQueue queue_;
  WakeDescriptor wake_;  // a message is there, or the end

  // The thread's.
  OutgoingMessage last_version_{topic_version, ""};
  OutgoingMessage last_status_{topic_status, ""};
  bool version_wanted_ = false;
  bool status_wanted_ = false;
  steady_clock::time_point greeted_{};

  mutable std::mutex mutex_;
  std::condition_variable subscribed_;
  std::atomic<bool> fold_wanted_{false};
  std::atomic<std::uint64_t> pixel_topics_version_{0};
  std::set<std::string> pixel_topics_;  // guarded by mutex_
  bool frames_wanted_ = false;          // guarded by mutex_
  std::string status_;                  // guarded by mutex_
  bool ending_ = false;                 // guarded by mutex_
  std::thread thread_;
};

// Design note: one socket with two endpoints, since libzmq applies a socket's options to what it
// binds from then on: the plain endpoint is bound before the socket is protected. A message then
// has the same place in both queues and is packed once, and each subscriber has a queue of its own.
Publisher::Service::Service(const std::string& endpoint, int queue_messages, const Access& access)
    : authenticator_(access.authenticator),
      xpub_(authenticator_ == nullptr ? own_context_ : authenticator_->context(),
            zmq::socket_type::xpub),
      queue_(std::max(least_queue, static_cast<std::size_t>(queue_messages))) {
  prepare(queue_messages);
  open(endpoint, access, access.refusals == nullptr ? nobody_hears_ : *access.refusals);
  thread_ = std::thread([this] { run(); });
}

Publisher::Service::~Service() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  wake_.notify();
  thread_.join();
  xpub_.close();
  own_context_.close();
  if (authenticator_ != nullptr) authenticator_->name_peers(security::publish_domain, nullptr);
}

void Publisher::Service::prepare(int queue_messages) {
  xpub_.set(zmq::sockopt::xpub_verbose, true);
  xpub_.set(zmq::sockopt::sndhwm, queue_messages);
  xpub_.set(zmq::sockopt::linger, static_cast<int>(linger.count()));
  xpub_.set(zmq::sockopt::maxmsgsize, max_incoming_bytes);
  xpub_.set(zmq::sockopt::heartbeat_ivl, heartbeat_interval_ms);
  xpub_.set(zmq::sockopt::heartbeat_timeout, heartbeat_timeout_ms);
  xpub_.set(zmq::sockopt::handshake_ivl, handshake_ms);
}

void Publisher::Service::open(const std::string& endpoint, const Access& access,
                              security::Refusals& refusals) {
  if (!access.local_endpoint.empty()) {
    sockets::ListeningSocket listener("publish.local_endpoint", access.local_endpoint);
    local_.emplace(std::move(listener), xpub_, false, refusals);
    local_endpoint_ = local_->gate.endpoint();
  }
  if (endpoint.empty()) return;
  sockets::ListeningSocket listener("publish.endpoint", endpoint);
  if (authenticator_ != nullptr) authenticator_->protect(xpub_, security::publish_domain);
  main_.emplace(std::move(listener), xpub_, authenticator_ != nullptr, refusals);
  endpoint_ = main_->gate.endpoint();
  if (authenticator_ == nullptr) return;
  authenticator_->name_peers(security::publish_domain,
                             [this] { return main_->gate.judged_peer(); });
}

void Publisher::Service::run() {
  pthread_setname_np(pthread_self(), "messages");
  for (bool end = false; !end;) {
    wait();
    wake_.clear();
    {
      const std::scoped_lock lock(mutex_);
      end = ending_;
    }
    read_subscriptions();
    greet();  // before what is queued, which a new subscriber hears in any case
    while (send_queued()) {
    }
  }
}

void Publisher::Service::wait() const {
  std::array<zmq_pollitem_t, 2> items{{{const_cast<void*>(xpub_.handle()), 0, ZMQ_POLLIN, 0},
                                       {nullptr, wake_.get(), ZMQ_POLLIN, 0}}};
  const bool greets = version_wanted_ || status_wanted_;
  (void)zmq_poll(items.data(), items.size(), greets ? between_greetings.count() : -1);
}

void Publisher::Service::read_subscriptions() {
  bool frames_wanted = false;
  zmq::message_t message;
  for (int i = 0; i < subscriptions_a_turn; ++i) {
    if (!xpub_.recv(message, zmq::recv_flags::dontwait)) break;
    const std::string_view text = message.to_string_view();
    if (text.empty()) continue;
    // 1 subscribes, and 0 tells that the last subscriber of a topic has gone; the topic follows.
    const bool subscribes = text.front() == '\x01';
    const std::string_view topic = text.substr(1);
    if (topic.starts_with(pixel_prefix)) note_pixel_topic(topic, subscribes);
    if (topic == topic_fold) fold_wanted_.store(subscribes, std::memory_order_relaxed);
    if (!subscribes) continue;
    version_wanted_ |= is_prefix(topic, topic_version);
    status_wanted_ |= is_prefix(topic, topic_status);
    frames_wanted |= is_prefix(topic, topic_frame) || is_prefix(topic, topic_scene) ||
                     topic.starts_with(pixel_prefix);
  }
  if (!frames_wanted) return;
  const std::scoped_lock lock(mutex_);
  frames_wanted_ = true;
  subscribed_.notify_all();
}

void Publisher::Service::note_pixel_topic(std::string_view topic, bool subscribes) {
  const std::scoped_lock lock(mutex_);
  if (subscribes && pixel_topics_.size() < most_pixel_topics && topic.size() < most_topic_bytes) {
    pixel_topics_.emplace(topic);
  } else if (!subscribes) {
    pixel_topics_.erase(std::string(topic));
  }
  pixel_topics_version_.fetch_add(1, std::memory_order_relaxed);
}

// Returns false where no message waits.
bool Publisher::Service::send_queued() {
  std::deque<OutgoingMessage> messages = queue_.take();
  for (OutgoingMessage& message : messages) {
    send(message);
    const std::string_view topic = message.topic;
    if (topic == topic_version) {
      last_version_ = std::move(message);
      version_wanted_ = false;
    } else if (topic == topic_status) {
      last_status_ = std::move(message);
      status_wanted_ = false;
    }
  }
  return !messages.empty();
}

void Publisher::Service::send(const OutgoingMessage& message) {
  // XPUB never blocks, and drops a message for a subscriber whose queue is full: its result tells
  // nothing.
  (void)xpub_.send(zmq::buffer(std::string_view{message.topic}),
                   zmq::send_flags::sndmore | zmq::send_flags::dontwait);
  (void)xpub_.send(zmq::buffer(message.json), zmq::send_flags::dontwait);
}

void Publisher::Service::greet() {
  if (!version_wanted_ && !status_wanted_) return;
  const auto now = steady_clock::now();
  if (now - greeted_ < between_greetings) return;
  greeted_ = now;
  if (std::exchange(version_wanted_, false) && !last_version_.json.empty()) send(last_version_);
  if (std::exchange(status_wanted_, false) && !last_status_.json.empty()) send(last_status_);
}

Publisher::Publisher(const std::string& endpoint, int queue_messages)
    : Publisher(endpoint, queue_messages, {}) {}

Publisher::Publisher(const std::string& endpoint, int queue_messages, const Access& access)
    : service_(std::make_unique<Service>(endpoint, queue_messages, access)) {}

Publisher::~Publisher() = default;

const std::string& Publisher::endpoint() const { return service_->endpoint(); }
const std::string& Publisher::local_endpoint() const { return service_->local_endpoint(); }

void Publisher::publish_frame(std::string json) { service_->push(topic_frame, std::move(json)); }

void Publisher::publish_scene(std::string json) { service_->push(topic_scene, std::move(json)); }

void Publisher::publish_pixel(const std::string& name, std::string json) {
  service_->push(pixel_topic(name), std::move(json));
}

std::optional<std::vector<std::string>> Publisher::pixel_topics(std::uint64_t& known) const {
  return service_->pixel_topics(known);
}

void Publisher::publish_status(std::string json) {
  service_->keep_status(json);
  service_->push(topic_status, std::move(json));
}

void Publisher::publish_version(std::string json) {
  service_->push(topic_version, std::move(json));
}

void Publisher::publish_fold(std::string json) { service_->push(topic_fold, std::move(json)); }

bool Publisher::fold_is_wanted() const { return service_->fold_is_wanted(); }

std::string Publisher::last_status() const { return service_->last_status(); }

std::size_t Publisher::dropped() const { return service_->dropped(); }

bool Publisher::wait_for_subscriber(milliseconds timeout) {
  return service_->wait_for_subscriber(timeout);
}

}  // namespace splid
