#include <fmt/core.h>
#include <mosquitto.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "daemon/forward/broker.hpp"
#include "protocol/status_json.hpp"

namespace splid::forward {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::seconds mqtt_patience{5};
constexpr int keepalive_s = 10;
constexpr int loop_ms = 100;

// A connection lasts until anything goes wrong; then all that was not acknowledged is given to the
// next one. libmosquitto does its work in carry() alone, on the caller's thread.
class MqttBroker : public Broker {
 public:
  explicit MqttBroker(Destination destination) : to_(std::move(destination)) {
    mosquitto_lib_init();
  }
  ~MqttBroker() override {
    if (client_) {
      mosquitto_disconnect(client_.get());
      mosquitto_loop(client_.get(), 0, 1);
    }
    client_.reset();
    mosquitto_lib_cleanup();
  }
  MqttBroker(const MqttBroker&) = delete;
  MqttBroker& operator=(const MqttBroker&) = delete;

  Outcome carry(std::span<const Message> batch) override {
    Outcome outcome;
    if (!is_connected_) outcome.fault = connect();
    if (outcome.fault.empty()) outcome.fault = hand_over(batch, outcome.refused);
    while (outcome.done < waiting_.size() && !waiting_[outcome.done]) ++outcome.done;
    if (!outcome.fault.empty()) close();
    waiting_.clear();
    numbers_.clear();
    return outcome;
  }

 private:
  struct Destroy {
    void operator()(mosquitto* client) const { mosquitto_destroy(client); }
  };

  [[nodiscard]] std::string place() const {
    return fmt::format("mqtt://{}:{}", to_.host, to_.port);
  }
  [[nodiscard]] std::string topic(const std::string& name) const {
    return "splid/" + to_.device + "/" + name;
  }
  [[nodiscard]] std::string in_words(int code) const {
    const bool is_system = code == MOSQ_ERR_ERRNO;
    return place() + ": " + (is_system ? std::strerror(errno) : mosquitto_strerror(code));
  }

  void close() {
    client_.reset();
    is_connected_ = false;
  }

  static MqttBroker& self(void* object) { return *static_cast<MqttBroker*>(object); }

  // What a client says before it connects: who it is, and what others hear when it is gone.
  int prepare() {
    mosquitto* client = client_.get();
    mosquitto_connect_callback_set(
        client, [](mosquitto*, void* object, int code) { self(object).answer_ = code; });
    mosquitto_publish_callback_set(client, [](mosquitto*, void* object, int number) {
      const auto found = self(object).numbers_.find(number);
      if (found != self(object).numbers_.end()) self(object).waiting_[found->second] = false;
    });
    mosquitto_int_option(client, MOSQ_OPT_TCP_NODELAY, 1);
    mosquitto_max_inflight_messages_set(client, 0);
    const std::string gone =
        R"({"schema":"splid.forward","v":[1,0],"device":")" + to_.device + R"(","state":"gone"})";
    int code = mosquitto_will_set(client, topic(topic_forward).c_str(),
                                  static_cast<int>(gone.size()), gone.data(), 1, true);
    if (code == MOSQ_ERR_SUCCESS && !to_.user.empty()) {
      code = mosquitto_username_pw_set(client, to_.user.c_str(), to_.password.c_str());
    }
    if (code == MOSQ_ERR_SUCCESS && !to_.ca.empty()) {
      const bool has_own = !to_.certificate.empty();
      code = mosquitto_tls_set(client, to_.ca.c_str(), nullptr,
                               has_own ? to_.certificate.c_str() : nullptr,
                               has_own ? to_.private_key.c_str() : nullptr, nullptr);
    }
    return code;
  }

  std::string connect() {
    close();
    const std::string name = "splid-forward-" + to_.device;
    client_.reset(mosquitto_new(name.c_str(), true, this));
    if (!client_) return place() + ": no memory";
    int code = prepare();
    answer_ = -1;
    if (code == MOSQ_ERR_SUCCESS) {
      std::string host = to_.host;
      if (host.starts_with('[')) host = host.substr(1, host.size() - 2);
      code = mosquitto_connect_async(client_.get(), host.c_str(), to_.port, keepalive_s);
    }
    const auto deadline = SteadyClock::now() + mqtt_patience;
    while (code == MOSQ_ERR_SUCCESS && answer_ < 0) {
      code = mosquitto_loop(client_.get(), loop_ms, 1);
      if (SteadyClock::now() > deadline) return place() + ": no answer for 5 s";
    }
    if (answer_ > 0) return place() + ": " + mosquitto_connack_string(answer_);
    if (code != MOSQ_ERR_SUCCESS) return in_words(code);
    is_connected_ = true;
    return {};
  }

  std::string hand_over(std::span<const Message> batch, std::vector<std::size_t>& refused) {
    waiting_.assign(batch.size(), true);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const Message& message = batch[i];
      const bool is_kept = message.topic == topic_status || message.topic == topic_forward;
      int number = 0;
      const int code =
          mosquitto_publish(client_.get(), &number, topic(message.topic).c_str(),
                            static_cast<int>(message.json.size()), message.json.data(), 1, is_kept);
      if (code == MOSQ_ERR_PAYLOAD_SIZE || code == MOSQ_ERR_OVERSIZE_PACKET) {
        waiting_[i] = false;
        refused.push_back(i);
      } else if (code != MOSQ_ERR_SUCCESS) {
        return in_words(code);
      }
      numbers_[number] = i;
    }
    return await_answers(batch.empty() ? 0 : loop_ms);
  }

  std::string await_answers(int wait_ms) {
    const auto deadline = SteadyClock::now() + mqtt_patience;
    do {
      const int code = mosquitto_loop(client_.get(), wait_ms, 1);
      if (code != MOSQ_ERR_SUCCESS) return in_words(code);
      if (SteadyClock::now() > deadline) return place() + ": acknowledges nothing for 5 s";
    } while (std::find(waiting_.begin(), waiting_.end(), true) != waiting_.end());
    return {};
  }

  const Destination to_;
  std::unique_ptr<mosquitto, Destroy> client_;
  bool is_connected_ = false;
  int answer_ = -1;                     // to the connection; below 0: none yet
  std::vector<bool> waiting_;           // of the batch, those not acknowledged
  std::map<int, std::size_t> numbers_;  // libmosquitto's number of each
};

}  // namespace

std::unique_ptr<Broker> open_mqtt(const Destination& destination) {
  return std::make_unique<MqttBroker>(destination);
}

}  // namespace splid::forward
