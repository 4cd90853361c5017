#include <fmt/core.h>
#include <nats/nats.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "daemon/forward/broker.hpp"
#include "daemon/forward/nats_connection.hpp"
#include "protocol/json_value.hpp"

namespace splid::forward {
namespace {

constexpr const char* message_id = "Nats-Msg-Id";
constexpr std::int64_t answer_ms = 5000;

// A connection lasts until anything goes wrong; then all that was not acknowledged is given to the
// next one, which first asks what the stream has of it.
class NatsBroker : public Broker {
 public:
  explicit NatsBroker(Destination destination) : to_(std::move(destination)) {}
  ~NatsBroker() override { close(); }
  NatsBroker(const NatsBroker&) = delete;
  NatsBroker& operator=(const NatsBroker&) = delete;

  Outcome carry(std::span<const Message> batch) override {
    Outcome outcome;
    if (!connection_) outcome.fault = connect();
    std::vector<bool> waiting(batch.size(), true);
    if (outcome.fault.empty() && asks_) outcome.fault = find_stored(batch, waiting);
    if (outcome.fault.empty()) outcome.fault = hand_over(batch, waiting, outcome.refused);
    while (outcome.done < waiting.size() && !waiting[outcome.done]) ++outcome.done;
    if (!outcome.fault.empty()) close();
    return outcome;
  }

 private:
  [[nodiscard]] std::string place() const { return nats_place(to_); }
  [[nodiscard]] std::string subject(const std::string& topic) const {
    return "splid." + to_.device + "." + topic;
  }

  void close() { close_nats(connection_, jet_stream_, answers_); }

  std::string connect() {
    natsStatus status = connect_nats(to_, connection_, jet_stream_);
    if (status == NATS_OK) status = find_stream();
    natsInbox* inbox = nullptr;
    if (status == NATS_OK) status = natsInbox_Create(&inbox);
    if (status == NATS_OK) {
      inbox_ = inbox;
      natsInbox_Destroy(inbox);
      natsSubscription* answers = nullptr;
      status = natsConnection_SubscribeSync(&answers, connection_.get(), (inbox_ + ".*").c_str());
      answers_.reset(answers);
    }
    asks_ = true;
    return status == NATS_OK ? std::string{} : place() + ": " + nats_error(status);
  }

  // Makes the stream where there is none; its limits are then the administrator's.
  natsStatus find_stream() {
    jsStreamInfo* info = nullptr;
    jsErrCode code{};
    natsStatus status = js_GetStreamInfo(&info, jet_stream_.get(), stream_name, nullptr, &code);
    jsStreamInfo_Destroy(info);
    if (status != NATS_NOT_FOUND) return status;
    jsStreamConfig config;
    jsStreamConfig_Init(&config);
    const char* subjects = "splid.>";
    config.Name = stream_name;
    config.Subjects = &subjects;
    config.SubjectsLen = 1;
    config.Storage = js_FileStorage;
    config.AllowDirect = true;
    info = nullptr;
    status = js_AddStream(&info, jet_stream_.get(), &config, nullptr, &code);
    jsStreamInfo_Destroy(info);
    return status == NATS_ERR && code == JSStreamNameExistErr ? NATS_OK : status;
  }

  struct Stored {
    std::string id;       // of the last message of the topic in the stream; empty: none
    std::size_t end = 0;  // of the batch, its messages of the topic before this place are there
  };

  std::string find_last(const std::string& topic, Stored& stored) {
    natsMsg* found = nullptr;
    jsErrCode code{};
    const natsStatus status = js_GetLastMsg(&found, jet_stream_.get(), stream_name,
                                            subject(topic).c_str(), nullptr, &code);
    const NatsMessage owner(found);
    if (status == NATS_NOT_FOUND) return {};
    if (status != NATS_OK) return place() + ": " + nats_error(status);
    const char* id = nullptr;
    if (natsMsgHeader_Get(found, message_id, &id) == NATS_OK) stored.id = id;
    return {};
  }

  // Of a batch that the connection before may have handed over: what the stream holds. JetStream
  // itself knows the ids of its last two minutes alone, and a broker may be away for longer.
  std::string find_stored(std::span<const Message> batch, std::vector<bool>& waiting) {
    std::map<std::string, Stored> topics;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto [topic, is_new] = topics.try_emplace(batch[i].topic);
      if (is_new) {
        std::string fault = find_last(topic->first, topic->second);
        if (!fault.empty()) return fault;
      }
      if (topic->second.id == batch[i].id) topic->second.end = i + 1;
    }
    for (std::size_t i = 0; i < batch.size(); ++i) {
      if (i < topics[batch[i].topic].end) waiting[i] = false;
    }
    asks_ = batch.empty();
    return {};
  }

  natsStatus publish(const Message& message, std::size_t place_in_batch) {
    natsMsg* made = nullptr;
    natsStatus status = natsMsg_Create(&made, subject(message.topic).c_str(),
                                       fmt::format("{}.{}", inbox_, place_in_batch).c_str(),
                                       message.json.data(), static_cast<int>(message.json.size()));
    const NatsMessage owner(made);
    if (status == NATS_OK) status = natsMsgHeader_Set(made, message_id, message.id.c_str());
    if (status == NATS_OK) status = natsConnection_PublishMsg(connection_.get(), made);
    return status;
  }

  std::string hand_over(std::span<const Message> batch, std::vector<bool>& waiting,
                        std::vector<std::size_t>& refused) {
    constexpr std::int64_t room_for_header = 512;
    const std::int64_t longest = natsConnection_GetMaxPayload(connection_.get()) - room_for_header;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      if (!waiting[i]) continue;
      if (static_cast<std::int64_t>(batch[i].json.size()) > longest) {
        waiting[i] = false;
        refused.push_back(i);
        continue;
      }
      const natsStatus status = publish(batch[i], i);
      if (status != NATS_OK) return place() + ": " + nats_error(status);
    }
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds{answer_ms};
    while (std::find(waiting.begin(), waiting.end(), true) != waiting.end()) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          deadline - std::chrono::steady_clock::now());
      std::string fault = take_answer(left.count(), waiting);
      if (!fault.empty()) return fault;
    }
    if (natsConnection_IsClosed(connection_.get())) return place() + ": the connection is closed";
    return {};
  }

  // An answer that is an error ends the batch: what comes behind it must not be stored before it.
  std::string take_answer(std::int64_t patience_ms, std::vector<bool>& waiting) {
    natsMsg* answer = nullptr;
    const natsStatus status =
        natsSubscription_NextMsg(&answer, answers_.get(), std::max<std::int64_t>(patience_ms, 1));
    const NatsMessage owner(answer);
    if (status == NATS_NO_RESPONDERS) return place() + ": JetStream is off, or takes no splid.>";
    if (status == NATS_TIMEOUT) return place() + ": JetStream acknowledges nothing for 5 s";
    if (status != NATS_OK) return place() + ": " + natsStatus_GetText(status);
    const auto said = json_value_if_any(
        {natsMsg_GetData(answer), static_cast<std::size_t>(natsMsg_GetDataLength(answer))});
    if (!said.is_object() || !said.contains("seq") || said.contains("error")) {
      const bool has_words = said.is_object() && said.contains("error");
      return place() + ": JetStream refuses: " +
             (has_words ? json_text(said["error"]) : std::string("no acknowledgement"));
    }
    const std::string name = natsMsg_GetSubject(answer);
    std::size_t i = waiting.size();
    std::from_chars(name.data() + inbox_.size() + 1, name.data() + name.size(), i);
    if (i < waiting.size()) waiting[i] = false;
    return {};
  }

  const Destination to_;
  Connection connection_;
  Context jet_stream_;
  Subscription answers_;
  std::string inbox_;
  bool asks_ = true;  // the next batch may be in the stream already
};

}  // namespace

std::unique_ptr<Broker> open_nats(const Destination& destination) {
  return std::make_unique<NatsBroker>(destination);
}

}  // namespace splid::forward
