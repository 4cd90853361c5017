#include "daemon/sockets/message_client.hpp"

#include <memory>
#include <utility>
#include <zmq.hpp>

#include "protocol/error.hpp"

namespace splid::sockets {
namespace {

class MessageClient final : public MessageSocket {
 public:
  MessageClient(std::shared_ptr<zmq::context_t> context, zmq::socket_type type,
                const std::string& place)
      : context_(std::move(context)), socket_(*context_, type) {
    constexpr int between_tries_ms = 100;
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::reconnect_ivl, between_tries_ms);
    try {
      socket_.connect("tcp://" + place);
    } catch (const zmq::error_t& error) {
      throw Error(Fault::usage, place + ": " + error.what() + "; write HOST:PORT");
    }
  }

  void send(const std::string& message) override {
    (void)socket_.send(zmq::buffer(message), zmq::send_flags::dontwait);
  }

  std::optional<std::string> receive(std::chrono::milliseconds patience) override {
    zmq::message_t message;
    try {
      zmq::pollitem_t item{socket_.handle(), 0, ZMQ_POLLIN, 0};
      if (zmq::poll(&item, 1, patience) == 0) return std::nullopt;
      if (!socket_.recv(message, zmq::recv_flags::dontwait)) return std::nullopt;
    } catch (const zmq::error_t&) {
      return std::nullopt;  // a signal's handler ran
    }
    return message.to_string();
  }

 private:
  std::shared_ptr<zmq::context_t> context_;
  zmq::socket_t socket_;
};

}  // namespace

OpenSocket message_clients() {
  auto context = std::make_shared<zmq::context_t>(1);
  return [context](SocketKind kind, const std::string& place) {
    const auto type = kind == SocketKind::pair ? zmq::socket_type::pair : zmq::socket_type::req;
    return std::make_unique<MessageClient>(context, type, place);
  };
}

}  // namespace splid::sockets
