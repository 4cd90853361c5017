#include "daemon/forward/nats_reader.hpp"

#include <chrono>
#include <cstddef>
#include <thread>
#include <utility>

#include "daemon/base/log.hpp"

namespace splid::forward {
namespace {

constexpr std::int64_t next_message_ms = 100;
constexpr std::chrono::milliseconds before_next_connection{250};

}  // namespace

NatsReader::NatsReader(Destination from, Sink sink)
    : from_(std::move(from)), sink_(std::move(sink)) {}

void NatsReader::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const bool was_connected = messages_ != nullptr;
    const std::string fault = was_connected ? take() : connect();
    if (!fault.empty() || !was_connected) tell(fault);
    if (fault.empty()) continue;
    close();
    std::this_thread::sleep_for(before_next_connection);
  }
  close();
}

void NatsReader::close() { close_nats(connection_, jet_stream_, messages_); }

void NatsReader::tell(const std::string& fault) {
  if (fault.empty()) {
    ++connections_;
    log_info("connected to the broker");
  } else if (fault != told_) {
    log_warning("{}; tried again until it answers", fault);
  }
  told_ = fault;
}

std::string NatsReader::connect() {
  natsStatus status = connect_nats(from_, connection_, jet_stream_);
  jsStreamInfo* info = nullptr;
  jsErrCode code{};
  if (status == NATS_OK) {
    status = js_GetStreamInfo(&info, jet_stream_.get(), stream_name, nullptr, &code);
  }
  const StreamInfo owner(info);
  if (status == NATS_NOT_FOUND) {
    next_ = 1;
    return nats_place(from_) + ": has no stream " + stream_name + " yet";
  }
  if (status == NATS_OK) {
    const std::uint64_t end = info->State.LastSeq + 1;
    if (next_ == 0) next_ = end;
    if (next_ > end) next_ = 1;  // the stream was made anew
    jsSubOptions options;
    jsSubOptions_Init(&options);
    options.Ordered = true;
    options.Config.DeliverPolicy = js_DeliverByStartSequence;
    options.Config.OptStartSeq = next_;
    natsSubscription* messages = nullptr;
    status = js_SubscribeSync(&messages, jet_stream_.get(),
                              ("splid." + from_.device + ".*").c_str(), nullptr, &options, &code);
    messages_.reset(messages);
  }
  return status == NATS_OK ? std::string{} : nats_place(from_) + ": " + nats_error(status);
}

std::string NatsReader::take() {
  natsMsg* found = nullptr;
  natsStatus status = natsSubscription_NextMsg(&found, messages_.get(), next_message_ms);
  const NatsMessage message(found);
  if (status == NATS_TIMEOUT && !natsConnection_IsClosed(connection_.get())) return {};
  jsMsgMetaData* about = nullptr;
  if (status == NATS_OK) status = natsMsg_GetMetaData(&about, found);
  if (status != NATS_OK) return nats_place(from_) + ": " + natsStatus_GetText(status);
  const std::uint64_t sequence = about->Sequence.Stream;
  jsMsgMetaData_Destroy(about);
  const std::string subject = natsMsg_GetSubject(found);
  sink_(subject.substr(subject.rfind('.') + 1),
        {natsMsg_GetData(found), static_cast<std::size_t>(natsMsg_GetDataLength(found))});
  next_ = sequence + 1;
  return {};
}

}  // namespace splid::forward
