#pragma once

#include <nats/nats.h>

#include <memory>
#include <string>

#include "daemon/forward/broker.hpp"

namespace splid::forward {

// The stream that holds the messages of all sensors, in subjects splid.DEVICE.TOPIC.
inline constexpr const char* stream_name = "SPLID";

template <auto destroy>
struct Destroyer {
  template <class Value>
  void operator()(Value* value) const {
    destroy(value);
  }
};
using Connection = std::unique_ptr<natsConnection, Destroyer<natsConnection_Destroy>>;
using Subscription = std::unique_ptr<natsSubscription, Destroyer<natsSubscription_Destroy>>;
using NatsMessage = std::unique_ptr<natsMsg, Destroyer<natsMsg_Destroy>>;
using Context = std::unique_ptr<jsCtx, Destroyer<jsCtx_Destroy>>;
using StreamInfo = std::unique_ptr<jsStreamInfo, Destroyer<jsStreamInfo_Destroy>>;

// nats://HOST:PORT, for messages.
std::string nats_place(const Destination& server);

// The error of the last call of libnats on this thread.
std::string nats_error(natsStatus status);

// Connects, at most for 2 s. A connection that breaks stays broken: whoever has it makes a new one.
natsStatus connect_nats(const Destination& server, Connection& connection, Context& context);

// Ends the connection's thread before its subscription: libnats 3.4 lets that thread lock a
// subscription that is destroyed while a message comes in, and hangs for ever. All may be null.
void close_nats(Connection& connection, Context& context, Subscription& subscription);

}  // namespace splid::forward
