#pragma once

#include <string>
#include <vector>
#include <zmq.hpp>

namespace splid::test {

// A client of a control socket that may send what it likes.
class ControlPeer {
 public:
  explicit ControlPeer(const std::string& endpoint,
                       zmq::socket_type type = zmq::socket_type::dealer, int patience_ms = 120'000)
      : socket_(context_, type) {
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::rcvtimeo, patience_ms);
    socket_.set(zmq::sockopt::sndtimeo, patience_ms);
    socket_.connect(endpoint);
  }

  // One message of these parts.
  void send(const std::vector<std::string>& parts) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const bool last = i + 1 == parts.size();
      (void)socket_.send(zmq::buffer(parts[i]),
                         last ? zmq::send_flags::none : zmq::send_flags::sndmore);
    }
  }
  // The next reply, of one part; empty where none came within the patience.
  std::string receive() {
    zmq::message_t message;
    do {
      if (!socket_.recv(message)) return "";
    } while (message.more());
    return message.to_string();
  }
  std::string ask(const std::string& text) {
    send({text});
    return receive();
  }

 private:
  zmq::context_t context_{1};
  zmq::socket_t socket_;
};

}  // namespace splid::test
