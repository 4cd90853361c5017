#include "daemon/forward/nats_connection.hpp"

#include <fmt/core.h>

#include <cstdint>

namespace splid::forward {
namespace {

constexpr std::int64_t connect_ms = 2000;
constexpr std::int64_t write_ms = 5000;
constexpr std::int64_t ping_ms = 5000;

using NatsOptions = std::unique_ptr<natsOptions, Destroyer<natsOptions_Destroy>>;

natsStatus prepare(const Destination& server, natsOptions* options) {
  natsStatus status = natsOptions_SetURL(options, nats_place(server).c_str());
  const auto then = [&status](natsStatus next) {
    if (status == NATS_OK) status = next;
  };
  then(natsOptions_SetName(options, ("splid forward " + server.device).c_str()));
  then(natsOptions_SetTimeout(options, connect_ms));
  then(natsOptions_SetAllowReconnect(options, false));
  then(natsOptions_SetPingInterval(options, ping_ms));
  then(natsOptions_SetWriteDeadline(options, write_ms));
  then(natsOptions_SetErrorHandler(
      options, [](natsConnection*, natsSubscription*, natsStatus, void*) {}, nullptr));
  if (!server.nats_creds.empty()) {
    then(natsOptions_SetUserCredentialsFromFiles(options, server.nats_creds.c_str(), nullptr));
  }
  if (!server.user.empty()) {
    then(natsOptions_SetUserInfo(options, server.user.c_str(), server.password.c_str()));
  }
  if (!server.ca.empty()) {
    then(natsOptions_SetSecure(options, true));
    then(natsOptions_LoadCATrustedCertificates(options, server.ca.c_str()));
  }
  if (!server.certificate.empty()) {
    then(natsOptions_LoadCertificatesChain(options, server.certificate.c_str(),
                                           server.private_key.c_str()));
  }
  return status;
}

}  // namespace

std::string nats_place(const Destination& server) {
  return fmt::format("nats://{}:{}", server.host, server.port);
}

std::string nats_error(natsStatus status) {
  const char* text = nats_GetLastError(nullptr);
  return text == nullptr || *text == 0 ? natsStatus_GetText(status) : text;
}

natsStatus connect_nats(const Destination& server, Connection& connection, Context& context) {
  natsOptions* options = nullptr;
  natsStatus status = natsOptions_Create(&options);
  const NatsOptions owner(options);
  if (status == NATS_OK) status = prepare(server, options);
  natsConnection* made = nullptr;
  if (status == NATS_OK) status = natsConnection_Connect(&made, options);
  connection.reset(made);
  jsCtx* jet_stream = nullptr;
  if (status == NATS_OK) status = natsConnection_JetStream(&jet_stream, made, nullptr);
  context.reset(jet_stream);
  return status;
}

void close_nats(Connection& connection, Context& context, Subscription& subscription) {
  if (connection) natsConnection_Close(connection.get());
  subscription.reset();
  context.reset();
  connection.reset();
}

}  // namespace splid::forward
