#pragma once

#include <arpa/inet.h>
#include <nats/nats.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/eventually.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::test {

// Where Debian puts a program; empty: it is not installed.
inline std::string installed(const std::string& name) {
  for (const char* folder : {"/usr/sbin/", "/usr/bin/"}) {
    if (std::filesystem::exists(folder + name)) return folder + name;
  }
  return {};
}

// A port of this machine that is free now.
inline int free_port() {
  const int probe = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool bound = ::bind(probe, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                     ::getsockname(probe, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  ::close(probe);
  if (!bound) throw std::runtime_error("no free port");
  return ntohs(address.sin_port);
}

// Whether something listens at the port of this machine.
inline bool answers(int port) {
  const int probe = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  const bool is_there =
      ::connect(probe, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  ::close(probe);
  return is_there;
}

// A real broker, which keeps its data and its port when it is started again.
class Broker {
 public:
  // Who may connect, and how; empty: everybody, without TLS.
  struct Security {
    std::string certificate, private_key;  // files of the broker's
    std::string user, password;
  };

  // program: mosquitto or nats-server. data: its folder; empty: one of the broker's own.
  explicit Broker(std::string program, const std::string& data = {}) : Broker(program, data, {}) {}
  Broker(std::string program, const std::string& data, const Security& security)
      : program_(std::move(program)), data_(data.empty() ? folder_.path("data") : data) {
    std::filesystem::create_directories(data_);
    if (program_ == "mosquitto") {
      set_up_mosquitto(security);
    } else {
      set_up_nats(security);
    }
  }

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] std::string address() const {
    return (program_ == "mosquitto" ? "mqtt" : "nats") + std::string("://127.0.0.1:") +
           std::to_string(port_);
  }

  // clock: a program and its arguments that run the broker, as shifted_clock does.
  void start(std::vector<std::string> clock = {}) {
    if (clock.empty()) {
      running_.emplace(arguments_, installed(program_));
    } else {
      const std::string first = clock.front();
      clock.erase(clock.begin());
      clock.push_back(installed(program_));
      clock.insert(clock.end(), arguments_.begin(), arguments_.end());
      running_.emplace(clock, first);
    }
    if (!eventually([this] { return answers(port_); })) {
      throw std::runtime_error(program_ + " does not listen: " + running_->err());
    }
  }
  void end(int signal) {
    running_->signal(signal);
    running_->wait();
    running_.reset();
  }
  [[nodiscard]] pid_t id() const { return running_->id(); }
  void halt() { running_->signal(SIGSTOP); }
  void go_on() { running_->signal(SIGCONT); }

 private:
  // What a subscriber that is away should get is kept; what is acknowledged goes out at once.
  void set_up_mosquitto(const Security& security) {
    std::string text = "listener " + std::to_string(port_) +
                       " 127.0.0.1\nuser root\npersistence true\npersistence_location " + data_ +
                       "/\nmax_inflight_messages 0\nmax_queued_messages 0\n" +
                       "queue_qos0_messages true\n";
    if (security.user.empty()) {
      text += "allow_anonymous true\n";
    } else {
      const std::string file = folder_.path("passwords");
      Program({"-b", "-c", file, security.user, security.password}, installed("mosquitto_passwd"))
          .wait();
      text += "allow_anonymous false\npassword_file " + file + "\n";
    }
    if (!security.certificate.empty()) {
      text += "certfile " + security.certificate + "\nkeyfile " + security.private_key + "\n";
    }
    arguments_ = {"-c", folder_.write("mosquitto.conf", text)};
  }
  void set_up_nats(const Security& security) {
    arguments_ = {"-js", "-a", "127.0.0.1", "-p", std::to_string(port_), "-sd", data_};
    if (!security.user.empty()) {
      arguments_.insert(arguments_.end(), {"--user", security.user, "--pass", security.password});
    }
    if (!security.certificate.empty()) {
      arguments_.insert(arguments_.end(), {"--tls", "--tlscert", security.certificate, "--tlskey",
                                           security.private_key});
    }
  }

  TempFolder folder_;
  std::string program_;
  std::string data_;
  std::vector<std::string> arguments_;
  int port_ = free_port();
  std::optional<Program> running_;
};

// A stream as `splid forward` makes it, but for how long it knows the ids of messages.
inline void make_stream(const Broker& broker, std::int64_t ids_known_ns) {
  natsConnection* connection = nullptr;
  jsCtx* context = nullptr;
  jsStreamConfig config;
  jsStreamConfig_Init(&config);
  const char* subjects = "splid.>";
  config.Name = "SPLID";
  config.Subjects = &subjects;
  config.SubjectsLen = 1;
  config.Duplicates = ids_known_ns;
  jsErrCode code{};
  const bool is_made = natsConnection_ConnectTo(&connection, broker.address().c_str()) == NATS_OK &&
                       natsConnection_JetStream(&context, connection, nullptr) == NATS_OK &&
                       js_AddStream(nullptr, context, &config, nullptr, &code) == NATS_OK;
  jsCtx_Destroy(context);
  natsConnection_Destroy(connection);
  if (!is_made) throw std::runtime_error("no stream could be made");
}

// Stores a message as `splid forward` does.
inline void store(const Broker& broker, const std::string& subject, const std::string& id,
                  const std::string& json) {
  natsConnection* connection = nullptr;
  jsCtx* context = nullptr;
  jsPubOptions options;
  jsPubOptions_Init(&options);
  options.MsgId = id.c_str();
  const bool is_stored =
      natsConnection_ConnectTo(&connection, broker.address().c_str()) == NATS_OK &&
      natsConnection_JetStream(&context, connection, nullptr) == NATS_OK &&
      js_Publish(nullptr, context, subject.c_str(), json.data(), static_cast<int>(json.size()),
                 &options, nullptr) == NATS_OK;
  jsCtx_Destroy(context);
  natsConnection_Destroy(connection);
  if (!is_stored) throw std::runtime_error("nothing could be stored");
}

struct StoredMessage {
  std::string subject;
  std::string json;
};

// What a JetStream holds of a subject, from a time of its own clock on; 0: from the begin. Empty
// where there is no such stream, and where a busy broker broke off before its last message: a part
// of a stream would pass for the whole.
inline std::vector<StoredMessage> stored_in(const Broker& broker, const std::string& subject,
                                            std::int64_t from_unix_ns = 0) {
  std::vector<StoredMessage> messages;
  natsConnection* connection = nullptr;
  jsCtx* context = nullptr;
  natsSubscription* subscription = nullptr;
  jsSubOptions options;
  jsSubOptions_Init(&options);
  options.Ordered = true;
  options.Config.DeliverPolicy = from_unix_ns == 0 ? js_DeliverAll : js_DeliverByStartTime;
  options.Config.OptStartTime = from_unix_ns;
  bool goes_on = natsConnection_ConnectTo(&connection, broker.address().c_str()) == NATS_OK &&
                 natsConnection_JetStream(&context, connection, nullptr) == NATS_OK &&
                 js_SubscribeSync(&subscription, context, subject.c_str(), nullptr, &options,
                                  nullptr) == NATS_OK;
  constexpr std::int64_t longest_ms = 2000;
  bool is_whole = false;
  while (goes_on && !is_whole) {
    natsMsg* message = nullptr;
    goes_on = natsSubscription_NextMsg(&message, subscription, longest_ms) == NATS_OK;
    if (!goes_on) break;
    messages.push_back({natsMsg_GetSubject(message), natsMsg_GetData(message)});
    jsMsgMetaData* about = nullptr;
    goes_on = natsMsg_GetMetaData(&about, message) == NATS_OK;
    is_whole = goes_on && about->NumPending == 0;
    jsMsgMetaData_Destroy(about);
    natsMsg_Destroy(message);
  }
  if (!is_whole) messages.clear();
  natsConnection_Close(connection);  // ends its thread, which would use a destroyed subscription
  natsSubscription_Destroy(subscription);
  jsCtx_Destroy(context);
  natsConnection_Destroy(connection);
  return messages;
}

}  // namespace splid::test
